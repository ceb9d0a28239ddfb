"""Components that cannot be: every mistake in declarations and equations is told by name."""

import casadi as ca
import pytest

from components.framework import (
    AttitudePlant,
    CalculatedParameter,
    Component,
    ComponentError,
    Condition,
    Input,
    Output,
    Parameter,
    State,
)
from components.framework.vectors import Values

from .lag import Lag


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


@pytest.mark.parametrize("name", ["size", "outputs", "name", "check"])
def test_a_variable_with_a_name_that_components_have(name):
    taken = type("Taken", (Component,), {name: Parameter(unit="1", doc="a number")})
    with pytest.raises(ComponentError, match=f"Taken: a variable cannot be called {name}: every component has"):
        taken()
