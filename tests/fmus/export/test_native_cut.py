"""What a native FMU keeps of parameters and held inputs: the bits of the whole functions, and never of other values."""

import casadi as ca
import numpy as np
import pytest

from components.catalog import CATALOG
from components.framework import CalculatedParameter, Component, Input, Output, Parameter, State
from fmus.export.build import build
from fmus.export.native.cut import cut
from fmus.export.native.functions import flown, native_functions

from .slaves import Slave, unpack

EXTREMES = [0.0, -0.0, 1.0, -1.0, 1e300, -1e300, 5e-324]


class Kept(Component):
    """Most of it follows from a parameter and the input."""

    solver_step = 1e-3

    a = Parameter(unit="1", start=0.7, tunable=True, doc="a")
    b = CalculatedParameter(unit="1", doc="follows from a")
    u = Input(unit="1", shape=(2,), start=(0.4, -0.3), doc="u")
    x = State(unit="1", shape=(2,), start=(1.0, 2.0), output=True, doc="x")
    y = Output(unit="1", doc="y")

    def calculate(self, p):
        return {"b": ca.cos(p.a)}

    def derivatives(self, t, x, u, p):
        return {"x": self._torque(u, p) * x.x[::-1] + ca.exp(ca.sin(p.a * p.b)) * ca.sin(t)}

    def outputs(self, t, x, u, p):
        return {"y": ca.sum1(self._torque(u, p)) * x.x[0] + ca.tanh(u.u[0] * p.b)}

    def _torque(self, u, p):
        return ca.sin(ca.exp(u.u) * ca.cos(p.a) + ca.atan(u.u[::-1])) / (p.b + ca.cosh(u.u[0]))


class Calling(Component):
    """Equations that call a function which CasADi does not write out."""

    solver_step = 1e-3

    p = Parameter(unit="1", start=0.7, doc="p")
    x = State(unit="1", start=1.0, output=True, doc="x")

    def derivatives(self, t, x, u, p):
        z = ca.SX.sym("z")
        return {"x": ca.Function("f", [z], [ca.sin(z)], {"never_inline": True})(x.x + ca.sin(ca.exp(p.p)))}


@pytest.fixture(scope="module")
def kept(tmp_path_factory):
    return unpack(build(Kept(), tmp_path_factory.mktemp("kept") / "Kept.fmu"))


class Twin:
    """The whole functions, called by CasADi; arrays as the FMU's vectors."""

    def __init__(self):
        self.f, self.t, self.x, self.u, self.a = Kept().functions, 0.0, [1.0, 2.0], [0.4, -0.3], 0.7

    @property
    def p(self) -> list[float]:
        return [self.a, Kept.solver_step]

    def step(self, h: float, u1=(0.0, 0.0)) -> list[float]:
        n = round(h / Kept.solver_step)
        c, zero = self.f.calculate(self.p), [0.0, 0.0]
        for i in range(n):
            self.x = self.f.advance(self.t, self.x, self.u, u1, zero, zero, self.p, c, i * (h / n), h / n)
        self.t += h
        self.u = [u + h * slope for u, slope in zip(self.u, u1, strict=True)]
        y = self.f.outputs(self.t, self.x, self.u, self.p, c, [])
        return [*self.x.full().ravel(), float(y)]


def stepped(slave: Slave, t: float, h: float = 0.004) -> list[float]:
    slave.doStep(t, h)
    return slave.get("x[1]", "x[2]", "y")


def test_something_is_kept_of_each_kind():
    functions = {f.name(): f for f in native_functions(Kept())}
    assert {"fixed", "held", "held_rates"} <= functions.keys()
    assert functions["rates"].size1_in("g") < functions["outputs"].size1_in("g") == functions["held"].size1_out(0)


def test_a_parameter_that_changes_in_flight(kept):
    slave, twin = Slave(kept).start(), Twin()
    assert stepped(slave, 0.0) == twin.step(0.004)
    slave.set({"a": 0.2})
    twin.a = 0.2
    assert stepped(slave, 0.004) == twin.step(0.004)
    slave.freeInstance()


def test_inputs_that_change_between_steps_and_before_outputs(kept):
    slave, twin = Slave(kept).start(), Twin()
    assert stepped(slave, 0.0) == twin.step(0.004)
    slave.set({"u[2]": 0.9})
    twin.u = [0.4, 0.9]
    y = twin.f.outputs(twin.t, twin.x, twin.u, twin.p, twin.f.calculate(twin.p), [])
    assert slave.get("y") == [float(y)]
    assert stepped(slave, 0.004) == twin.step(0.004)
    slave.freeInstance()


def test_inputs_that_move(kept):
    slave, twin = Slave(kept).start(), Twin()
    for k in range(3):  # 4 internal steps of 1 ms each: the end of one is the next one's beginning, but for rounding
        slave.setRealInputDerivatives(slave.vr("u[1]", "u[2]"), [1, 1], [0.3, -0.7 + k])
        assert stepped(slave, 0.004 * k) == twin.step(0.004, (0.3, -0.7 + k))
    assert stepped(slave, 0.012) == twin.step(0.004)
    slave.freeInstance()


def test_a_state_taken_back_has_its_own_parameters(kept):
    slave, twin = Slave(kept).start(), Twin()
    assert stepped(slave, 0.0) == twin.step(0.004)
    state = slave.getFMUstate()
    slave.set({"a": 1.9, "u[1]": -0.8})
    stepped(slave, 0.004)
    data = slave.serializeFMUstate(state)
    other = Slave(kept, "other").start()
    other.set({"a": 1.1})
    stepped(other, 0.0)
    other.setFMUstate(other.deSerializeFMUstate(data))
    slave.setFMUstate(state)
    expected = twin.step(0.004)
    assert stepped(slave, 0.004) == expected
    assert stepped(other, 0.004) == expected
    slave.freeInstance()
    other.freeInstance()


def test_a_reset_forgets(kept):
    slave = Slave(kept).start()
    slave.set({"a": 1.9, "u[1]": -0.8})
    stepped(slave, 0.0)
    slave.reset()
    slave.start()
    assert stepped(slave, 0.0) == Twin().step(0.004)
    slave.freeInstance()


def test_rates_shown_before_a_step_are_its_first_only_for_the_same_values(kept):
    """Output derivatives need them; what is set afterwards must not fly with them."""
    slave, twin = Slave(kept).start(), Twin()
    names = slave.vr("x[1]", "x[2]")
    slave.getRealOutputDerivatives(names, [1, 1])
    assert stepped(slave, 0.0) == twin.step(0.004)
    slave.getRealOutputDerivatives(names, [1, 1])
    slave.set({"u[1]": 0.8, "u[2]": -0.3})
    twin.u = [0.8, -0.3]
    assert stepped(slave, 0.004) == twin.step(0.004)
    slave.getRealOutputDerivatives(names, [1, 1])
    slave.set({"a": 0.1})
    twin.a = 0.1
    assert stepped(slave, 0.008) == twin.step(0.004)
    slave.freeInstance()


def test_a_function_that_calls_another_is_left_whole(tmp_path):
    functions = {f.name(): f for f in native_functions(Calling())}
    assert functions["rates"].size1_in("k") == functions["rates"].size1_in("g") == 0
    slave = Slave(unpack(build(Calling(), tmp_path / "Calling.fmu"))).start()
    slave.doStep(0.0, 1e-3)
    (x,) = slave.get("x")
    f = Calling().functions
    assert x == float(f.advance(0, 1, [], [], [], [], [0.7, 1e-3], [], 0, 1e-3))
    slave.freeInstance()


# ---- the catalog -----------------------------------------------------------------------------------------------------


def operations(f: ca.Function) -> int:
    plain = {ca.OP_INPUT, ca.OP_OUTPUT, ca.OP_CONST}
    return sum(f.instruction_id(i) not in plain for i in range(f.n_instructions()))


@pytest.mark.parametrize("name", CATALOG)
def test_bits_are_those_of_the_whole_functions(name):
    component, rng = CATALOG[name](), np.random.default_rng(len(name))
    functions = flown(component)
    parts = cut(functions)
    sizes = {n: f.size1_in(i) for f in functions.values() for i, n in enumerate(f.name_in())}
    for trial in range(10):
        v = {n: rng.normal(size=size) * 10.0 ** rng.integers(-3, 4) for n, size in sizes.items()}
        if trial % 2:
            v = {n: np.where(rng.random(len(a)) < 0.3, rng.choice(EXTREMES, len(a)), a) for n, a in v.items()}
        k = parts["fixed"](v["p"], v["c"]) if "fixed" in parts else []
        g = {}
        if "held" in parts:
            g["outputs"] = g["rates"] = parts["held"](v["u"], v["p"], v["c"], k)
        if "held_rates" in parts:
            g["rates"] = parts["held_rates"](v["u"], v["p"], v["c"], k)
        for n, f in functions.items():
            arguments = [v[a] for a in f.name_in()]
            own = g.get(n, []) if parts[n].size1_in("g") else []
            for expected, found in zip(f.call(arguments), parts[n].call([*arguments, k, own]), strict=True):
                assert expected.full().tobytes() == found.full().tobytes(), n


@pytest.mark.parametrize(
    ("name", "left"), [("PrescribedPerformance", 0.41), ("PID", 0.17), ("IntegralSlidingMode", 0.07)]
)
def test_what_is_left_of_a_right_side_at_held_inputs(name, left):
    """By operations; counted by hand in the printed table of CasADi's instructions."""
    functions = flown(CATALOG[name]())
    assert operations(cut(functions)["rates"]) <= left * operations(functions["rates"])


def test_little_is_not_cut_off():
    """What moves with time alone gives nothing; 11 of 616 operations of the drag-free satellite are too few."""
    assert "fixed" not in cut(flown(CATALOG["AttitudeStep"]()))
    assert "held" not in cut(flown(CATALOG["DragFreeSatellite"]()))
