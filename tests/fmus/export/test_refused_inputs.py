"""Inputs that a condition refuses: a warning at the end of initialization, an error at the first step.

A host that knows its inputs only when it steps gives the numbers of one that gave them in initialization mode, bit for
bit: states that are calculated from them, step means and samples too.
"""

import math

import casadi as ca
import pytest
from fmpy.fmi1 import FMICallException

from components.catalog import CATALOG
from components.framework import Component, Condition, Input, Output, Parameter, PythonComponent, State
from cosim import Connection, Experiment, System, simulate
from cosim.errors import InitializationFailed
from fmus.description.annotations import INPUTS_REFUSED
from fmus.export.build import build
from fmus.export.python.failure import RuntimeFailure
from fmus.export.python.runtime import Runtime

from .slaves import Slave, unpack


class Direction(Component):
    """A state that is calculated from inputs, an exact output, a step mean; three kinds of conditions."""

    k = Parameter(unit="1/s", start=2.0, tunable=True, doc="rate")
    n = Input(unit="1", shape=(2,), start=(0.6, 0.8), doc="a direction")
    drive = Input(unit="1/s", start=0.5, doc="any number")
    side = State(unit="1", calculated=True, output=True, doc="sign of the direction at the start")
    angle = State(unit="rad", start=0.3, doc="angle")
    L = State(unit="1/s", calculated=True, doc="follows the rate and the drive")
    rate = Output(unit="1/s", start=0.25, exact=True, doc="rate")
    pull = Output(unit="1/s", step_mean=True, doc="mean of L'")
    scaled = Output(unit="1/s", doc="direction that has no value at zero")

    def initial(self, t, x, u, p):
        return {"side": ca.if_else(u.n[0] >= 0, 1, -1) / ca.norm_2(u.n), "L": 2 * x.rate + u.drive}

    def derivatives(self, t, x, u, p):
        return {"side": 0, "angle": p.k * x.side * u.n[0], "L": ca.sin(x.angle) - x.L * u.n[1]}

    def step_means(self, t, x, p):
        return {"pull": x.L}

    def outputs(self, t, x, u, p):
        return {"rate": (x.L - u.drive) / 2, "scaled": u.n[0] / ca.norm_2(u.n) + x.angle}

    def check(self, t, x, u, p):
        length = ca.norm_2(u.n)
        return [
            Condition(p.k, "k = {} 1/s must be positive.", (p.k,)),
            Condition(1e-6 - ca.fabs(length - 1), "n has norm {}: it must be 1.", (length,)),
            Condition(x.side + 2, "side = {} is below -2.", (x.side,)),
            Condition(1 - x.angle, "angle = {} rad must be below 1.", (x.angle,)),
        ]


class Sampled(Component):
    """The same with samples."""

    sample_time = 0.05
    n = Input(unit="1", shape=(2,), start=(0.6, 0.8), doc="a direction")
    last = State(unit="1", calculated=True, output=True, doc="what was seen last")
    shown = Output(unit="1", doc="a direction")

    def initial(self, t, x, u, p):
        return {"last": u.n[0] / ca.norm_2(u.n)}

    def update(self, t, x, u, p):
        return {"last": 0.5 * x.last + u.n[0] / ca.norm_2(u.n)}

    def outputs(self, t, x, u, p):
        return {"shown": x.last + u.n[1] / ca.norm_2(u.n)}

    def check(self, t, x, u, p):
        return [Condition(ca.norm_2(u.n) - 0.5, "n has norm {}: it must be 1.", (ca.norm_2(u.n),))]


class InWords(PythonComponent):
    """In plain Python, where the check reads an input."""

    gain = Parameter(unit="1", start=1.0, doc="gain")
    n = Input(unit="1", shape=(2,), start=(0.6, 0.8), doc="a direction")
    y = Output(unit="1", doc="a direction")

    def outputs(self, t, x, u, p):
        return {"y": p.gain * float(u.n[0]) / math.hypot(*u.n)}

    def check(self, t, x, u, p):
        length = math.hypot(*u.n)
        return [Condition(length - 0.5, "n has norm {}: it must be 1.", (length,))]


class Deaf(PythonComponent):
    """In plain Python, where the check reads no input."""

    gain = Parameter(unit="1", start=1.0, doc="gain")
    n = Input(unit="1", start=1.0, doc="anything")
    y = Output(unit="1", doc="the same")

    def outputs(self, t, x, u, p):
        return {"y": p.gain * u.n}

    def check(self, t, x, u, p):
        return [Condition(p.gain, "gain = {}: it must be positive.", (p.gain,))]


GOOD = {"n[1]": -0.8, "n[2]": 0.6}
ZERO = {"n[1]": 0.0, "n[2]": 0.0}
REFUSED = "n has norm 0: it must be 1."

KINDS = [(cls, backend) for cls in (Direction, Sampled) for backend in ("native", "python")]
KINDS += [(InWords, "python"), (Deaf, "python")]


@pytest.fixture(scope="module")
def folders(tmp_path_factory):
    """A function: class and back end -> its FMU, unpacked; each built once."""
    place, built = tmp_path_factory.mktemp("refused"), {}

    def folder(cls, backend):
        if (cls, backend) not in built:
            built[cls, backend] = unpack(build(cls(), place / f"{cls.__name__}_{backend}.fmu", backend))
        return built[cls, backend]

    return folder


@pytest.fixture
def opened(folders):
    """A function: class and back end -> an instance in initialization mode, with some inputs; freed at the end."""
    slaves = []

    def one(cls, backend, inputs):
        slaves.append(Slave(folders(cls, backend), logging=True).begin())
        slaves[-1].set(inputs)
        return slaves[-1]

    yield one
    for slave in slaves:
        slave.fmi2FreeInstance(slave.component)


def name_of(cls, backend):
    return f"{cls.__name__}_{backend}"


def moved(slave, at=0):
    """All variables after each of some steps, with inputs that change."""
    rows = []
    for k in range(at, at + 4):
        slave.doStep(k * 0.1, 0.1)
        rows.append(slave.everything())
        slave.set({"n[1]": 0.28, "n[2]": 0.96})
    return rows


@pytest.mark.parametrize(("cls", "backend"), KINDS[:5])
def test_inputs_that_come_in_time(opened, cls, backend):
    waiting, told = opened(cls, backend, ZERO), opened(cls, backend, GOOD)
    start = opened(cls, backend, {})
    for slave in (waiting, told, start):  # fmi2OK, for there are hosts that take fmi2Warning for an error
        assert slave.fmi2ExitInitializationMode(slave.component) == 0
    assert waiting.messages == [f"{name_of(cls, backend)}: {said}" for said in (REFUSED, f"{INPUTS_REFUSED}.")]
    assert told.messages == start.messages == []
    inputs = waiting.vr("n[1]", "n[2]")
    assert waiting.getReal(inputs) == [0.0, 0.0]  # what was set
    others = sorted(set(waiting.reference.values()) - set(inputs))
    assert waiting.getReal(others) == start.getReal(others)  # start values stand for them
    for one in GOOD.items():  # one by one, as some hosts do: between them a direction that has no length of 1
        waiting.set(dict([one]))
        assert all(map(math.isfinite, waiting.getReal(others)))
    assert waiting.everything() == told.everything()
    assert moved(waiting) == moved(told)


@pytest.mark.parametrize(("cls", "backend"), KINDS[:5])
def test_inputs_that_do_not_come(opened, cls, backend):
    waiting, told = opened(cls, backend, ZERO), opened(cls, backend, GOOD)
    for slave in (waiting, told):
        slave.exitInitializationMode()
    for _ in range(2):
        with pytest.raises(FMICallException) as caught:
            waiting.doStep(0.0, 0.1)
        assert caught.value.status == (3 if backend == "native" else 4)
        assert f"{name_of(cls, backend)}: {REFUSED}" in waiting.messages[2:]
        del waiting.messages[2:]
    waiting.set(GOOD)  # a refused step leaves the FMU as it was
    assert moved(waiting) == moved(told)
    assert waiting.messages == waiting.messages[:2]


@pytest.mark.parametrize("backend", ["native", "python"])
def test_what_is_of_no_input_is_an_error_at_once(opened, backend):
    for wrong, said in (({"k": -1.0}, "k = -1 1/s must be positive."), ({"angle": 2.0}, "angle = 2 rad must be below")):
        slave = opened(Direction, backend, ZERO | wrong)
        with pytest.raises(FMICallException):
            slave.exitInitializationMode()
        said_all = " ".join(slave.messages)
        assert said in said_all and REFUSED in said_all and INPUTS_REFUSED not in said_all


def test_a_condition_of_a_state_that_follows_an_input(opened):
    """side = -1 / |n| with n = (-0.1, 0) is -10."""
    slave = opened(Direction, "native", {"n[1]": -0.1, "n[2]": 0.0})
    slave.exitInitializationMode()
    assert [m.partition(": ")[2] for m in slave.messages] == [
        "n has norm 0.1: it must be 1.", "side = -10 is below -2.", f"{INPUTS_REFUSED}."
    ]  # fmt: skip


def test_parameters_of_an_instance_that_waits(opened):
    waiting, told = opened(Direction, "native", ZERO), opened(Direction, "native", GOOD)
    for slave in (waiting, told):
        slave.exitInitializationMode()
        with pytest.raises(FMICallException):
            slave.set({"k": -1.0})
        slave.set({"k": 3.0})
        slave.set({**GOOD, "drive": 0.75})
    for slave in (waiting, told):  # `told` has begun with another drive
        slave.doStep(0.0, 0.1)
    late = opened(Direction, "native", {**GOOD, "drive": 0.75, "k": 3.0})
    late.exitInitializationMode()
    late.doStep(0.0, 0.1)
    assert waiting.everything() == late.everything()
    assert waiting.get("L") != told.get("L")


@pytest.mark.parametrize(("cls", "backend"), KINDS[:4])
def test_the_state_of_an_instance_that_waits(opened, cls, backend):
    slave, told = opened(cls, backend, ZERO), opened(cls, backend, GOOD)
    slave.exitInitializationMode()
    told.exitInitializationMode()
    saved = slave.serializeFMUstate(slave.getFMUstate())
    slave.set(GOOD)
    moved(slave)
    slave.setFMUstate(slave.deSerializeFMUstate(saved))
    assert slave.get("n[1]", "n[2]") == [0.0, 0.0]
    with pytest.raises(FMICallException):
        slave.doStep(0.0, 0.1)
    slave.set(GOOD)
    assert moved(slave) == moved(told)


def test_an_exact_output_stands_while_inputs_are_waited_for(opened):
    """L = 2 rate + drive is calculated from the rate, which is set."""
    slave = opened(Direction, "native", {**ZERO, "rate": 0.5})
    slave.exitInitializationMode()
    assert slave.get("rate", "L") == [0.5, 1.5]
    slave.getRealOutputDerivatives(slave.vr("scaled"), [1])
    slave.set({**GOOD, "drive": 0.25})
    assert slave.get("rate", "L") == [0.5, 1.25]


def test_a_check_in_plain_python_that_reads_no_input(opened):
    slave = opened(Deaf, "python", {"gain": -1.0})
    with pytest.raises(FMICallException):
        slave.exitInitializationMode()
    assert slave.messages[0] == "Deaf_python: gain = -1: it must be positive."


@pytest.mark.parametrize("cls", [Direction, Sampled])
def test_the_twin(opened, cls):
    """The runtime of the python back end, which is flown in one process, against the native FMU."""
    native, twin = opened(cls, "native", ZERO), Runtime(cls(), name_of(cls, "native"))
    said = []
    twin.warn = said.append
    twin.setup(0.0)
    twin.enter_initialization()
    inputs, values = native.vr("n[1]", "n[2]"), [list(ZERO.values()), list(GOOD.values())]
    twin.set(inputs, values[0])
    native.exitInitializationMode()
    twin.exit_initialization()
    assert said == native.messages
    with pytest.raises(RuntimeFailure, match=REFUSED):
        twin.do_step(0.0, 0.1)
    native.set(GOOD)
    twin.set(inputs, values[1])
    native.doStep(0.0, 0.1)
    twin.do_step(0.0, 0.1)
    shared = list(range(len(twin.v)))
    assert native.getReal(shared) == pytest.approx(twin.get(shared), rel=1e-12)  # rounding of another order of RK4


class TestOurMaster:
    """It has no other inputs to give: it refuses when initialization mode ends, in the words of the condition."""

    @pytest.mark.parametrize(("cls", "backend"), KINDS[:4])
    def test_refusal(self, folders, cls, backend):
        folder = folders(cls, backend)
        system = System(name="alone", components={"unit": folder.with_suffix(".fmu")}, held={"unit.n": [0.0, 0.0]})
        if cls is Direction:
            system = System(name="alone", components=system.components, held={**system.held, "unit.drive": 1.0})
        with pytest.raises(InitializationFailed) as caught:
            simulate(system, Experiment(stop_time=1.0, communication_step_size=0.1))
        assert str(caught.value) == (
            "unit cannot be initialized: fmi2ExitInitializationMode returned fmi2Warning\n"
            f"    {name_of(cls, backend)}: {REFUSED}"
        )

    def test_what_makes_a_number_that_is_none(self, folders):
        """scaled = 0 / 0: the words of the one that made it, not of the one that refuses the number."""
        file = folders(Direction, "native").with_suffix(".fmu")
        connection = Connection("a.scaled", "b.drive")
        held = {"a.n": [0.0, 0.0], "b.n": [1.0, 0.0], "a.drive": 0.0}
        system = System(name="two", components={"a": file, "b": file}, connections=[connection], held=held)
        with pytest.raises(InitializationFailed, match=f"^a cannot be initialized: .*\n.*{REFUSED}"):
            simulate(system, Experiment(stop_time=1.0, communication_step_size=0.1))


@pytest.mark.parametrize("backend", ["native", "python"])
def test_a_law_whose_side_is_fixed_at_the_start(tmp_path, backend):
    """PrescribedPerformance chooses its bounds by the sign of the first errors: by those that fly, not by zeros."""
    folder = unpack(build(CATALOG["PrescribedPerformance"](), tmp_path / "law.fmu", backend))
    half = math.radians(20) / 2
    attitudes = {"q_BN[1]": math.cos(half), "q_BN[2]": -math.sin(half), "q_BN[3]": 0.0, "q_BN[4]": 0.0}
    zeros, opened = dict.fromkeys(attitudes, 0.0), []
    for first in (zeros, attitudes):
        opened.append(Slave(folder, logging=True).begin())
        opened[-1].set({"overshoot[2]": 0.5, "overshoot[3]": 0.5, "rho_0[1]": 1.0, **first})
        opened[-1].exitInitializationMode()
        assert all(map(math.isfinite, opened[-1].get("tau_command_B[1]", "z[1]")))
        opened[-1].set(attitudes)
        opened[-1].doStep(0.0, 0.01)
    late, told = opened
    assert "q_BN has norm 0" in late.messages[0]
    assert late.everything() == told.everything()
    for slave in opened:
        slave.terminate()
        slave.freeInstance()
