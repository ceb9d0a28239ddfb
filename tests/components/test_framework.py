"""What is derived from equations: samples, step means, projection, input derivatives, Python-only components."""

import casadi as ca
import numpy as np
from helpers import Point, assert_units, numbers
from numpy.testing import assert_allclose

from components.framework import (
    ActuatorCluster,
    Component,
    Input,
    Output,
    Parameter,
    PythonComponent,
    State,
)
from components.framework.vectors import Values

from .lag import Lag


class Counter(Component):
    """y_n = sum of u over the samples up to n."""

    sample_time = 0.1
    u = Input(unit="rad", doc="input")
    total = State(unit="rad", doc="sum")
    y = Output(unit="rad", doc="the sum")

    def update(self, t, x, u, p):
        return {"total": x.total + u.u}

    def outputs(self, t, x, u, p):
        return {"y": x.total}


def test_sampled():
    counter = Counter()
    assert counter.sampled
    assert [p.name for p in counter.parameters if p.name == "sample_time"] == ["sample_time"]
    assert "solver.step" not in [p.name for p in counter.parameters]
    point = Point(counter, u=0.5, total=2.0)
    assert_allclose(point.rates()["total"], 2.5)  # update
    assert_allclose(point.outputs()["y"], 2.0)
    assert counter.direct_feedthrough == {"y": ("u",)}  # outputs show the sample: update, then outputs
    assert_units(counter)
    _, sy = counter.functions.forward(0, point.x, point.u, point.p, [], 0, [0.25], [0.5], 0 * point.p, [])
    assert_allclose(numbers(sy), 0.75)


class Wheel(Component):
    """A store of momentum on three axes that follows its command; its torque is a step mean."""

    ports = ActuatorCluster

    T = Parameter(unit="s", start=0.5, doc="lag")
    h_B = State(unit="N.m.s", shape=(3,), output=True, doc="momentum")
    lagged = State(unit="N.m", shape=(3,), calculated=True, doc="lagged command, settled at the start")

    def initial(self, t, x, u, p):
        return {"lagged": u.tau_command_B}

    def derivatives(self, t, x, u, p):
        return {"h_B": -x.lagged, "lagged": (u.tau_command_B - x.lagged) / p.T}

    def step_means(self, t, x, p):
        return {"tau_B": -x.h_B}


def test_step_mean_and_calculated_state():
    wheel = Wheel()
    point = Point(wheel, tau_command_B=[0.1, 0.2, -0.3])
    assert_allclose(point.states()["lagged"], [0.1, 0.2, -0.3])
    f = wheel.functions
    means = f.mean_rates(0, point.x, point.u, point.p, point.c)
    assert_allclose(numbers(means), [0.1, 0.2, -0.3])  # before the first step: the derivative itself
    assert wheel.direct_feedthrough == {"tau_B": ()}
    assert_allclose(numbers(f.outputs(0, point.x, point.u, point.p, point.c, [1, 2, 3])), [1, 2, 3])
    initial = f.initial_dependencies
    assert [row["u"] for row in initial["x"]] == [[], [], [], [0], [1], [2]]
    assert [row["u"] for row in initial["y"]] == [[0], [1], [2]]  # of the derivative, through the settled lag
    where, none = (0, point.x, point.u, point.p, []), 0 * point.p
    sx, sm = f.initial_forward(*where, [], 0, 0 * point.x, [1, 0, 0], none, [])
    assert_allclose(numbers(sx), [0, 0, 0, 1, 0, 0])
    assert_allclose(numbers(sm), [1, 0, 0])  # the step mean follows the calculated state
    assert_units(wheel)


def test_projection_follows_each_internal_step():
    class Turning(Component):
        q = State(unit="1", shape=(2,), start=(3.0, 4.0), doc="any vector")

        def derivatives(self, t, x, u, p):
            return {"q": 0 * x.q}

        def project(self, x, p):
            return {"q": x.q / ca.norm_2(x.q)}

    assert_allclose(Point(Turning()).advance(0.1)[:, -1], [0.6, 0.8])


def test_input_derivatives_enter_the_internal_step():
    """x' = u(t) with u = u0 + u1 s + u2 s^2 / 2 + u3 s^3 / 6 is a quartic: RK4 is exact."""

    class Integrator(Component):
        u = Input(unit="1/s", doc="input")
        x = State(unit="1", doc="integral")

        def derivatives(self, t, x, u, p):
            return {"x": u.u}

    f, p = Integrator().functions, [1e-3]
    x = f.advance(0, 0, 2.0, 3.0, 4.0, 5.0, p, [], 0.5, 0.2)  # from s = 0.5 to 0.7
    exact = [2 * s + 3 * s**2 / 2 + 4 * s**3 / 6 + 5 * s**4 / 24 for s in (0.5, 0.7)]
    assert_allclose(float(x), exact[1] - exact[0], rtol=1e-14)


def test_linearise():
    a, b = Lag().linearise(np.zeros(2))
    assert_allclose(a, -0.5 * np.eye(2))
    assert_allclose(b, 0.5 * np.arange(6.0).reshape(2, 3))


class Bang(PythonComponent):
    """A switch with a memory, in plain Python."""

    u = Input(unit="rad", doc="input")
    v = Input(unit="rad", doc="another input")
    last = State(unit="rad", doc="memory")
    y = Output(unit="N.m", doc="output")
    z = Output(unit="rad", doc="memory shown")
    feedthrough = {"z": ()}

    def outputs(self, t, x, u, p):
        return {"y": 1.0 if u.u > 0 else -1.0, "z": x.last}

    def step(self, t, h, x, u, p):
        return {"last": u.u}


def test_python_only():
    bang = Bang()
    assert bang.python_only and not bang.sampled
    assert bang.parameters == ()
    assert bang.direct_feedthrough == {"y": ("u", "v"), "z": ()}
    assert bang.step(0.0, 0.1, Values(last=0.0), Values(u=0.3, v=0.0), Values()) == {"last": 0.3}
