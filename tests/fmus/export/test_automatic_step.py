"""solver.step = 0: the internal step is a tenth of the fastest time constant at the start; both back ends."""

import casadi as ca
import numpy as np
import pytest

from components.framework import Component, Input, Parameter, State
from cosim import Experiment, System, simulate
from cosim.errors import StepFailed
from cosim.flights import find
from cosim.slaves.fmi2 import FmuSlave
from fmus.export.build import build


class Free(Component):
    """x' = A x + B u, at an automatic step."""

    n: int = 2
    A = Parameter(unit="1/s", shape=("n", "n"), tunable=True, doc="matrix")
    u = Input(unit="1/s", doc="drives the first state")
    x = State(unit="1", shape=("n",), start=1.0, output=True, doc="state")

    def derivatives(self, t, x, u, p):
        return {"x": p.A @ x.x + ca.vertcat(u.u, ca.SX.zeros(self.n - 1))}


class Root(Component):
    """x' = sqrt(x), from 0: its rate there is infinite."""

    x = State(unit="1", output=True, doc="state")

    def derivatives(self, t, x, u, p):
        return {"x": ca.sqrt(x.x)}


@pytest.fixture(scope="module", params=["native", "python"])
def free(request, tmp_path_factory):
    return build(Free(), tmp_path_factory.mktemp("free") / f"Free{request.param}.fmu", request.param)


def fly(fmu, A, step, stop=None, **parameters):
    """Fly x' = A x alone, from x = 1, to `stop` or for one step."""
    given = {"unit.A": np.array(A, float)} | {f"unit.{n.replace('_', '.')}": v for n, v in parameters.items()}
    system = System(name="alone", components={"unit": fmu}, parameters=given, hold_unconnected=True)
    return simulate(system, Experiment(stop_time=stop or step, communication_step_size=step), locate=find)


def taken(*arguments, **named):
    return fly(*arguments, **named).info["internal_steps"]["unit"]


def swing(omega):
    return [[0, omega], [-omega, 0]]


@pytest.mark.parametrize(
    ("A", "step", "expected"),
    [
        (swing(10.0), 0.1, 0.01),
        (swing(10.0), 1e-3, 1e-3),  # never longer than the communication step
        (swing(3.0), 0.1, 0.025),  # 0.033 s, of which 0.1 s needs four
        (np.diag([-1e4, -1.0]), 1e-3, 1e-5),
        (np.diag([0.2, -0.1]), 0.1, 0.1),
        (np.zeros((2, 2)), 20.0, 20.0),
        ([[0, 1], [0, 0]], 20.0, 20.0),  # what moves at constant speed has no rate
    ],
)
def test_a_tenth_of_the_fastest_time_constant(free, A, step, expected):
    result = fly(free, A, step)
    assert result.info["internal_steps"]["unit"] == pytest.approx(expected, rel=1e-12)
    assert result.info["messages"] == {}


def test_what_is_set_is_taken(free):
    assert taken(free, swing(10.0), 0.1, solver_step=0.02) == pytest.approx(0.02, rel=1e-12)


def test_its_error(free):
    """RK4 turns by z - z^5/120 in a step of z rad: at z = 0.1, 1000 steps are 8.3e-5 rad late; damping is z^6/144."""
    result = fly(free, swing(10.0), 0.1, 10.0)
    x = result["unit.x"][-1]
    exact = np.cos(100.0) + np.sin(100.0), np.cos(100.0) - np.sin(100.0)
    late = np.arctan2(x[0] * exact[1] - x[1] * exact[0], x @ exact)
    assert abs(late) == pytest.approx(1000 * 0.1**5 / 120, rel=0.02)  # the next term of the series is z^7/336: z^2/3


def test_a_parameter_that_is_set_in_flight_counts(free):
    slave = FmuSlave("unit", free)
    names = slave.description.variables
    A = tuple(names[f"A[{i},{j}]"].value_reference for i in (1, 2) for j in (1, 2))
    step = (names["solver.step_taken"].value_reference,)
    slave.instantiate()
    slave.setup_experiment(0.0)
    slave.set_real(A, np.array(swing(10.0), float).ravel())
    slave.enter_initialization_mode()
    slave.exit_initialization_mode()
    assert slave.get_real(step)[0] == 0  # none was taken yet
    slave.do_step(0.0, 0.1)
    assert slave.get_real(step)[0] == pytest.approx(0.01, rel=1e-12)
    state = slave.get_state()
    slave.set_real(A, np.array(swing(100.0), float).ravel())
    slave.do_step(0.1, 0.1)
    assert slave.get_real(step)[0] == pytest.approx(0.001, rel=1e-12)
    slave.set_state(state)
    slave.do_step(0.1, 0.1)
    assert slave.get_real(step)[0] == pytest.approx(0.01, rel=1e-12)
    slave.free()


@pytest.mark.parametrize("backend", ["native", "python"])
def test_without_a_jacobian_it_is_a_millisecond(tmp_path, backend):
    fmu = build(Root(), tmp_path / "Root.fmu", backend)
    system = System(name="alone", components={"unit": fmu})
    result = simulate(system, Experiment(stop_time=0.01, communication_step_size=0.01), locate=find)
    assert result.info["internal_steps"] == {"unit": pytest.approx(1e-3, rel=1e-12)}


def test_a_negative_step_is_refused(free):
    with pytest.raises(StepFailed, match=r"solver\.step = -0\.01 s does not suit a step of 0\.1 s"):
        fly(free, swing(10.0), 0.1, solver_step=-0.01)
