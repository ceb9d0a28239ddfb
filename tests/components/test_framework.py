"""Declarations and what is derived from them: merging, flattening, sampled, Python-only, step means, every error."""

import casadi as ca
import numpy as np
import pytest
from helpers import Point, assert_units, numbers
from numpy.testing import assert_allclose

from components.framework import (
    ActuatorCluster,
    AttitudeController,
    AttitudePlant,
    CalculatedParameter,
    Component,
    ComponentError,
    Condition,
    Input,
    Output,
    Parameter,
    PythonComponent,
    State,
)
from components.framework.component import start_vector
from components.framework.units import UNITS, rate_unit
from components.framework.vectors import Values, flatten, unflatten


class Lag(Component):
    """A matrix gain before lags: parameters, states and outputs of every shape."""

    n: int = 2

    K = Parameter(unit="1", shape=("n", 3), start=lambda c: np.arange(3.0 * c.n).reshape(c.n, 3), doc="gain")
    T = Parameter(unit="s", start=2.0, tunable=True, doc="time constant")
    rate = CalculatedParameter(unit="1/s", doc="1 / T")
    u = Input(unit="N.m", shape=(3,), start=(1.0, 2.0, 3.0), doc="input")
    x = State(unit="N.m", shape=("n",), output=True, doc="lagged")
    y = Output(unit="N.m", shape=("n", 3), doc="K u_j, element by element")
    w = Output(unit="N.m/s", doc="a rate")

    def calculate(self, p):
        return {"rate": 1 / p.T}

    def derivatives(self, t, x, u, p):
        return {"x": p.rate * (p.K @ u.u - x.x)}

    def outputs(self, t, x, u, p):
        return {"y": p.K * ca.repmat(u.u.T, self.n, 1), "w": p.rate * ca.sum1(x.x)}


# ---- declarations --------------------------------------------------------------------------------------------------


def test_elements_and_flattening_are_row_by_row():
    lag = Lag()
    assert list(lag.parameters[0].elements()) == ["K[1,1]", "K[1,2]", "K[1,3]", "K[2,1]", "K[2,2]", "K[2,3]"]
    assert list(lag.inputs[0].elements()) == ["u[1]", "u[2]", "u[3]"]
    assert list(lag.parameters[1].elements()) == ["T"]
    assert_allclose(start_vector(lag.parameters), [0, 1, 2, 3, 4, 5, 2.0, lag.solver_step])
    assert_allclose(Point(lag).outputs()["y"], [[0, 2, 6], [3, 8, 15]])
    assert_allclose(Point(lag).rates()["x"], np.array([8, 26]) / 2)


def test_unflatten_inverts_flatten():
    lag = Lag(n=3)
    vector = ca.SX.sym("p", lag.size(lag.parameters[:2]))
    again = flatten("Lag", "here", lag.parameters[:2], unflatten(lag.parameters[:2], vector))
    assert ca.is_equal(ca.Function("f", [vector], [again])(np.arange(10.0)), ca.DM(np.arange(10.0)))


def test_structure_and_start_values():
    assert Lag(n=4).states[0].shape == (4,)
    assert_allclose(Lag(n=1).parameters[0].start, [[0, 1, 2]])
    assert_allclose(Lag(x=[1, 2]).states[0].start, [1, 2])
    assert_allclose(Lag(x=0.5).states[0].start, [0.5, 0.5])  # a scalar is repeated
    assert [p.name for p in Lag().parameters] == ["K", "T", "solver.step"]
    assert Lag().calculated_parameters[0].tunable  # it may follow a tunable parameter


def test_feedthrough_comes_from_the_equations():
    assert Lag().direct_feedthrough == {"y": ("u",), "w": ()}


class Body(Component):
    ports = AttitudePlant

    spin = State(unit="rad/s", doc="further state")
    q_BN = State(unit="1", shape=(4,), start=(1, 0, 0, 0), output=True, doc="replaces the port's output in its place")

    def derivatives(self, t, x, u, p):
        return {"q_BN": 0 * x.q_BN, "spin": u.tau_B[0] * 0}

    def outputs(self, t, x, u, p):
        return {"omega_BN_B": ca.SX.zeros(3), "H_N": u.h_B, "energy": 0}


class Heavier(Body):
    mass = Parameter(unit="kg", start=5.0, doc="added by a subclass")
    spin = State(unit="rad/s", start=2.0, doc="replaced by a subclass")


def test_ports_bases_and_class_are_merged():
    body = Heavier()
    assert [v.name for v in body.inputs] == ["tau_B", "h_B", "tau_dist_B"]
    assert [v.name for v in body.states] == ["q_BN", "spin"]
    assert [v.name for v in body.outputs_declared] == ["omega_BN_B", "H_N", "energy"]
    assert body.states[1].doc == "replaced by a subclass" and body.states[1].start == 2.0
    assert [p.name for p in body.parameters] == ["mass", "solver.step"]


def test_ports_of_several_roles():
    class Both(Component):
        ports = (AttitudeController, ActuatorCluster)

    names = [v.name for v in (*Both().inputs, *Both().outputs_declared)]
    assert names.count("tau_command_B") == 1 and "h_B" in names and "q_RN" in names


def test_declare_follows_the_structure():
    class Many(Component):
        n: int = 2

        def declare(self):
            return {f"u_{i}": Input(unit="N", doc="one of n") for i in range(self.n)}

    assert [v.name for v in Many(n=3).inputs] == ["u_0", "u_1", "u_2"]


# ---- errors: declarations ------------------------------------------------------------------------------------------


def component(**body):
    """A component class with a body."""
    return type("Faulty", (Component,), body)


X = State(unit="1", doc="state")
ERRORS = {
    "structure negative": (lambda: Lag(n=-1), "Lag: structural parameter n = -1 is not a whole number >= 0."),
    "structure bool": (lambda: Lag(n=True), "Lag: structural parameter n = True is not a whole number >= 0."),
    "structure float": (lambda: Lag(n=2.0), "Lag: structural parameter n = 2.0 is not a whole number >= 0."),
    "unknown name": (
        lambda: Lag(TT=1),
        "Lag: no variable 'TT'. Did you mean 'T'? Variables: n, K, T, rate, u, x, y, w, solver.step.",
    ),
    "wrong shape": (lambda: Lag(u=[1, 2]), "Lag: u: start value has shape (2,), declared shape is (3,)."),
    "no number": (lambda: Lag(T="fast"), "Lag: T: could not convert string to float: 'fast'."),
    "unknown unit": (
        component(a=Parameter(unit="N.m.S", doc="no such unit")),
        "Faulty: a: unknown unit 'N.m.S'. Did you mean 'N.m.s'",
    ),
    "unknown structure": (
        component(a=Parameter(unit="1", shape=("modes",), doc="no such structure")),
        "Faulty: a: shape names 'modes', the structural parameters are: none.",
    ),
    "port unit": (
        component(ports=AttitudePlant, tau_B=Input(unit="N", shape=(3,), doc="wrong")),
        "Faulty: tau_B is declared with unit N and shape (3,), its port has unit N.m and shape (3,).",
    ),
    "port shape": (
        component(ports=AttitudePlant, energy=Output(unit="J", shape=(2,), doc="wrong")),
        "Faulty: energy is declared with unit J and shape (2,), its port has unit J and shape ().",
    ),
    "declare against port": (
        component(ports=AttitudePlant, declare=lambda self: {"tau_B": Input(unit="N", shape=(3,), doc="wrong")}),
        "Faulty: tau_B is declared with unit N and shape (3,), its port has unit N.m and shape (3,).",
    ),
    "states alone": (component(x=X), "Faulty: has states but neither derivatives nor sample_time with update."),
    "sampled with derivatives": (
        component(x=X, sample_time=0.1, derivatives=lambda self, t, x, u, p: {}),
        "Faulty: a sampled component (sample_time) writes update, not derivatives.",
    ),
}


@pytest.mark.parametrize("case", ERRORS)
def test_declaration_errors(case):
    make, message = ERRORS[case]
    with pytest.raises(ComponentError) as caught:
        make()
    assert str(caught.value).startswith(message), str(caught.value)
    assert caught.value.component == message.split(":")[0]


# ---- errors: equations ---------------------------------------------------------------------------------------------


def rates(values):
    return dict(x=State(unit="1", shape=(2,), doc="state"), derivatives=lambda self, t, x, u, p: values)


def outputs(values, shape=(2,)):
    return dict(y=Output(unit="1", shape=shape, doc="output"), outputs=lambda self, t, x, u, p: values)


EQUATIONS = {
    "missing": (rates({}), "rates", "derivatives does not return 'x'."),
    "extra": (rates({"x": ca.SX.zeros(2), "eta": 0}), "rates", "derivatives returns 'eta', which it should not."),
    "near": (outputs({"yy": 0}), "outputs", "outputs returns 'yy', which it should not. Did you mean 'y'?"),
    "scalar": (rates({"x": 0}), "rates", "derivatives: x is a scalar, declared with shape (2,)."),
    "length": (rates({"x": ca.SX.zeros(3)}), "rates", "derivatives: x has shape (3, 1), declared with (2,)."),
    "transposed": (
        outputs({"y": ca.SX.zeros(3, 2)}, (2, 3)),
        "outputs",
        "outputs: y has shape (3, 2), declared with (2, 3).",
    ),
    "initial": (
        dict(x=State(unit="1", calculated=True, doc="state"), derivatives=lambda self, t, x, u, p: {"x": 0}),
        "initial",
        "initial returns [], the calculated states are ['x'].",
    ),
    "calculate": (
        dict(c=CalculatedParameter(unit="1", doc="never calculated")),
        "calculate",
        "calculate does not return 'c'.",
    ),
    "margin": (
        dict(check=lambda self, t, x, u, p: [Condition(ca.SX.zeros(2), "a and b must be positive")]),
        "check",
        "check: margin of 'a and b must be positive' is no scalar.",
    ),
    "step mean": (
        dict(h=Output(unit="1", step_mean=True, doc="output")),
        "means",
        "step_means does not return 'h'.",
    ),
}


@pytest.mark.parametrize("case", EQUATIONS)
def test_equation_errors(case):
    body, function, message = EQUATIONS[case]
    with pytest.raises(ComponentError) as caught:
        getattr(component(**body)().functions, function)
    assert caught.value.text.startswith(message), str(caught.value)


def test_a_misspelt_variable_in_an_equation_is_named():
    message = r"no variable 'omega' here. Did you mean 'Omega'\? There are: Omega, zeta"
    with pytest.raises(AttributeError, match=message):
        Values(Omega=1, zeta=2).omega


def test_units_test_finds_a_wrong_unit():
    """The check of declared units is itself checked: each of these declarations has one wrong unit."""

    class Wrong(Lag):
        w = Output(unit="N.m/s", doc="a rate")

        def outputs(self, t, x, u, p):
            return super().outputs(t, x, u, p) | {"w": p.T * ca.sum1(x.x)}

    assert_units(Lag())
    with pytest.raises(AssertionError, match=r"unit of Wrong.w in outputs"):
        assert_units(Wrong())


def test_rate_units():
    assert rate_unit("rad") == "rad/s" and rate_unit("N.m.s") == "N.m" and rate_unit("N.m/s") is None
    assert UNITS["kg^(1/2).m"].scale(kg=4.0, m=3.0) == 6.0


@pytest.mark.parametrize(
    ("typed", "unit", "si"),
    [
        ("50 ms", "s", 0.05),
        ("2 h", "s", 7200.0),
        ("6000 rpm", "rad/s", 200 * np.pi),
        ("40 mN.m.s", "N.m.s", 0.04),
        ("30 uN.m", "N.m", 3e-5),
        ("25 %", "1", 0.25),
        ("7000 km", "m", 7e6),
        ("350 g", "kg", 0.35),
    ],
)
def test_units_as_people_type_them(typed, unit, si):
    number, name = typed.split()
    assert_allclose(float(number) / UNITS[unit].display[name], si, rtol=1e-15)


# ---- sampled -------------------------------------------------------------------------------------------------------


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


# ---- step means and calculated states ------------------------------------------------------------------------------


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


def test_an_exact_output_needs_a_continuous_state_that_follows_from_it():
    class Alone(Component):
        omega = Output(unit="rad/s", exact=True, doc="rate")
        x = State(unit="rad", doc="angle")

        def derivatives(self, t, x, u, p):
            return {"x": 1}

    class Sampled(Component):
        sample_time = 1.0
        omega = Output(unit="rad/s", exact=True, doc="rate")
        x = State(unit="rad", calculated=True, doc="angle")

    class Mean(Component):
        omega = Output(unit="rad/s", exact=True, step_mean=True, doc="rate")
        x = State(unit="rad", calculated=True, doc="angle")
        derivatives = Alone.derivatives

    for make in (Alone, Sampled, Mean):
        with pytest.raises(ComponentError) as caught:
            make()
        assert str(caught.value) == (
            f"{make.__name__}: omega is exact, its start is set: then a continuous state must be calculated from it, "
            "State(calculated=True) and initial; a step mean cannot be."
        )


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


# ---- Python-only ---------------------------------------------------------------------------------------------------


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


@pytest.mark.parametrize("name", ["u", "y"])
def test_variables_have_no_value_outside_equations(name):
    assert getattr(Lag(), name).name == ""  # the declaration, never a number


@pytest.mark.parametrize("name", ["size", "outputs", "name", "check"])
def test_a_variable_with_a_name_that_components_have(name):
    taken = type("Taken", (Component,), {name: Parameter(unit="1", doc="a number")})
    with pytest.raises(ComponentError, match=f"Taken: a variable cannot be called {name}: every component has"):
        taken()
