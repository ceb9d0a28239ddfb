"""What a native FMU refuses its Python twin and its python FMU refuse in the same words.

A python FMU's refusals are fmi2Fatal: pythonfmu's wrapper makes that of every exception.
"""

import math

import pytest
from fmpy import fmi2
from fmpy.fmi1 import FMICallException

from fmus.export.python.failure import RuntimeFailure
from fmus.export.python.python_fmu import build_python
from fmus.export.python.runtime import Runtime

from .parts import every
from .slaves import Slave, refused, unpack

PARTS = every()

REFUSALS = {  # method of fmpy's slave, of its twin, arguments
    "no such variable to get": ("getReal", "get", ([999],)),
    "no such variable to set": ("setReal", "set", ([999], [1.0])),
    "set what cannot be set": ("setReal", "set", ([0], [1.0])),
    "set what is not finite": ("setReal", "set", (["torque[2]"], [math.inf])),
    "derivative of a state": ("setRealInputDerivatives", "set_input_derivatives", (["phase"], [1], [1.0])),
    "derivative of order 4": ("setRealInputDerivatives", "set_input_derivatives", (["torque[1]"], [4], [1.0])),
    "derivative of nothing": ("setRealInputDerivatives", "set_input_derivatives", ([999], [1], [1.0])),
    "derivative not finite": ("setRealInputDerivatives", "set_input_derivatives", (["torque[1]"], [2], [math.nan])),
    "no step": ("doStep", "do_step", (0.0, 0.0)),
    "no finite step": ("doStep", "do_step", (0.0, math.inf)),
    "another time": ("doStep", "do_step", (0.5, 0.1)),
    "no time": ("doStep", "do_step", (math.nan, 0.1)),
    "past the stop time": ("doStep", "do_step", (0.0, 1.1)),
}


@pytest.fixture(scope="module")
def python_folder(tmp_path_factory):
    """The python FMU of Swing, unpacked."""
    return unpack(build_python(PARTS["Swing"], tmp_path_factory.mktemp("python") / "Swing.fmu"))


@pytest.fixture
def open_python(python_folder):
    """A function: an instance of the python FMU, freed at the end of the test whatever it has been through."""
    opened: list[Slave] = []

    def slave() -> Slave:
        opened.append(Slave(python_folder, "unit", logging=True))
        return opened[-1]

    yield slave
    for one in opened:
        one.fmi2FreeInstance(one.component)


def fatal(call, *arguments, **named) -> None:
    with pytest.raises(FMICallException) as caught:
        call(*arguments, **named)
    assert caught.value.status == fmi2.fmi2Fatal


@pytest.mark.parametrize(("native", "python", "arguments"), REFUSALS.values(), ids=REFUSALS)
def test_the_twins_refuse_in_the_same_words(open_slave, native, python, arguments):
    slave, twin = open_slave("Swing").start(stop=1.0), Runtime(PARTS["Swing"])
    twin.setup(0.0, 1.0)
    twin.enter_initialization()
    twin.exit_initialization()
    given = [[slave.reference.get(e, e) for e in a] if isinstance(a, list) else a for a in arguments]
    refused(getattr(slave, native), *given)
    with pytest.raises(RuntimeFailure) as caught:
        getattr(twin, python)(*given)
    assert [str(caught.value)] == slave.messages


OF_FMUS = {name: case for name, case in REFUSALS.items() if "derivative" not in name} | {
    "the last reference that there is": ("getReal", "get", ([2**32 - 1],)),
    "the same, to set": ("setReal", "set", ([2**32 - 1], [1.0])),
    "an integer": ("getInteger", "", ([0],)),
    "to set an integer": ("setInteger", "", ([0], [1])),
    "a boolean": ("getBoolean", "", ([2**32 - 1],)),
    "to set a boolean": ("setBoolean", "", ([0], [True])),
    "a string": ("getString", "", ([999],)),
    "to set a string": ("setString", "", ([0], ["x"])),
}


@pytest.mark.parametrize(("call", "_", "arguments"), OF_FMUS.values(), ids=OF_FMUS)
def test_a_python_fmu_refuses_in_the_same_words_and_goes_on(open_slave, open_python, call, _, arguments):
    """FMI ends an instance with fmi2Fatal; ours is sound, as the native one is after fmi2Error."""
    native, python = open_slave("Swing").start(stop=1.0), open_python().start(stop=1.0)
    given = [[native.reference.get(e, e) for e in a] if isinstance(a, list) else a for a in arguments]
    for _ in range(3):
        refused(getattr(native, call), *given)
        fatal(getattr(python, call), *given)
    assert [m for m in python.messages if not m.startswith("Fatal py")] == native.messages
    native.doStep(0.0, 0.1)
    python.doStep(0.0, 0.1)
    size = len(Runtime(PARTS["Swing"]).v)
    assert python.getReal(range(size)) == native.getReal(range(size))


def test_calls_of_other_types_without_variables_are_fine(open_python):
    python = open_python().start()
    assert (python.getInteger([]), python.getBoolean([]), python.getString([])) == ([], [], [])
    for call in (python.setInteger, python.setBoolean, python.setString):
        call([], [])


BEFORE, WITHIN, AFTER, ENDED = ("instantiate", "begin", "start", "terminate")
ORDER = [  # in which mode, which call
    *((BEFORE, call, ()) for call in ("exitInitializationMode", "terminate")),
    (BEFORE, "getReal", ([0],)),
    (BEFORE, "doStep", (0.0, 0.1)),
    *((WITHIN, call, ()) for call in ("setupExperiment", "enterInitializationMode", "terminate")),
    (WITHIN, "doStep", (0.0, 0.1)),
    *((AFTER, call, ()) for call in ("setupExperiment", "enterInitializationMode", "exitInitializationMode")),
    *((ENDED, call, ()) for call in ("setupExperiment", "enterInitializationMode", "exitInitializationMode")),
    (ENDED, "terminate", ()),
    (ENDED, "doStep", (0.0, 0.1)),
    (ENDED, "setReal", ([0], [1.0])),
]


def brought(slave: Slave, mode: str) -> Slave:
    if mode == WITHIN:
        slave.begin()
    elif mode != BEFORE:
        slave.start()
    if mode == ENDED:
        slave.terminate()
    return slave


@pytest.mark.parametrize(
    ("mode", "call", "arguments"), ORDER, ids=lambda value: value if isinstance(value, str) else ""
)
def test_the_order_of_calls(open_slave, open_python, mode, call, arguments):
    native, python = brought(open_slave("Swing"), mode), brought(open_python(), mode)
    refused(getattr(native, call), *arguments)
    fatal(getattr(python, call), *arguments)
    assert python.messages[:1] == native.messages
    assert "not allowed" in native.messages[0]


def test_after_an_error(open_slave, open_python):
    """A condition does not hold: variables can still be read, and the instance ended or reset."""
    for slave, ends in ((open_slave("Swing"), refused), (open_python(), fatal)):
        slave.begin()
        slave.set({"drive": -1.0})
        ends(slave.exitInitializationMode)
        assert slave.get("drive") == [-1.0]
        ends(slave.doStep, 0.0, 0.1)
        assert any("fmi2DoStep: not allowed after an error." in message for message in slave.messages)
        slave.reset()
        assert slave.start().get("drive") == [0.9]


def test_what_is_read_after_the_end(open_slave, open_python):
    values = []
    for slave in (open_slave("Swing"), open_python()):
        slave.start()
        slave.doStep(0.0, 0.1)
        slave.terminate()
        values.append(slave.get("energy", "omega[1]"))
    assert values[0] == values[1]


def test_a_state_of_another_fmu_is_refused(open_python, tmp_path):
    other = Slave(unpack(build_python(PARTS["Wheel"], tmp_path / "Wheel.fmu")), logging=True).start()
    slave, state = open_python().start(), other.getFMUstate()
    fatal(slave.setFMUstate, state)
    assert slave.messages[0] == "fmi2SetFMUstate: the state was saved by another FMU than Swing."
    own = slave.getFMUstate()
    slave.terminate()
    fatal(slave.setFMUstate, own)
    assert "fmi2SetFMUstate: a python FMU cannot come back from fmi2Terminate." in slave.messages[2]
    other.terminate()
    other.freeInstance()


def test_a_folder_that_was_emptied_before_a_reset_is_told(open_python, tmp_path):
    folder = unpack(build_python(PARTS["Gain"], tmp_path / "Gain.fmu"))
    slave = Slave(folder, logging=True).start()
    (folder / "resources" / "component.json").unlink()
    slave.reset()
    for call, arguments in ((slave.setupExperiment, ()), (slave.getReal, ([0],)), (slave.setReal, ([0], [1.0]))):
        fatal(call, *arguments)
    assert slave.messages[0].startswith("fmi2Reset: FileNotFoundError: ")
    slave.fmi2FreeInstance(slave.component)


@pytest.mark.parametrize(("start", "stop"), [(math.nan, None), (math.inf, None), (0.0, -1.0), (0.0, math.nan)])
def test_the_twins_refuse_an_experiment_in_the_same_words(open_slave, start, stop):
    slave, twin = open_slave("Swing"), Runtime(PARTS["Swing"])
    refused(slave.setupExperiment, startTime=start, stopTime=stop)
    with pytest.raises(RuntimeFailure) as caught:
        twin.setup(start, stop)
    assert [str(caught.value)] == slave.messages
