"""Variables as they are declared: merging, flattening, structure, units."""

import casadi as ca
import numpy as np
import pytest
from helpers import Point, assert_units
from numpy.testing import assert_allclose

from components.framework import (
    ActuatorCluster,
    AttitudeController,
    AttitudePlant,
    Component,
    Input,
    Output,
    Parameter,
    State,
)
from components.framework.component import start_vector
from components.framework.units import UNITS, rate_unit
from components.framework.vectors import flatten, unflatten

from .lag import Lag


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


@pytest.mark.parametrize("name", ["u", "y"])
def test_variables_have_no_value_outside_equations(name):
    assert getattr(Lag(), name).name == ""  # the declaration, never a number
