"""Native FMUs: what is refused, with which words."""

import ctypes
import math

import pytest
from fmpy.fmi1 import FMICallException

from fmus.export.native.native_fmu import build_native

from .parts import Braces
from .slaves import Slave, refused, unpack


def test_setting_is_refused_by_name(open_slave):
    slave = open_slave("Swing")
    for name in ("J_inverse[1,1]", "energy", "der(phase)"):
        refused(slave.set, {name: 1.0})
        assert slave.messages.pop() == f"fmi2SetReal: variable {name} cannot be set now."
    refused(slave.set, {"drive": 5.0, "omega[2]": math.nan})
    assert slave.messages.pop() == "fmi2SetReal: variable omega[2] = nan is not finite."
    slave.start()
    assert slave.get("drive") == [0.9]  # nothing of a refused call was taken
    for name in ("J[1,2]", "phase", "drive"):
        refused(slave.set, {name: 1.0})
        assert slave.messages.pop() == f"fmi2SetReal: variable {name} cannot be set now."
    refused(slave.set, {"torque[1]": math.inf})
    assert slave.messages.pop() == "fmi2SetReal: variable torque[1] = inf is not finite."
    for call in (slave.getReal, lambda vr: slave.setReal(vr, [0.0])):
        refused(call, [999])
        assert slave.messages.pop().endswith(": there is no Real variable with value reference 999.")
    wheel = open_slave("Wheel")
    refused(wheel.set, {"speed": 1.0})
    assert wheel.messages == ["fmi2SetReal: variable speed cannot be set now."]


def test_other_types_do_not_exist(open_slave):
    slave = open_slave("Gain").start()
    slave.getInteger([])
    for get, set_, name, value in (
        (slave.getInteger, slave.setInteger, "Integer", 1),
        (slave.getBoolean, slave.setBoolean, "Boolean", True),
        (slave.getString, slave.setString, "String", "a"),
    ):
        refused(get, [0])
        assert slave.messages.pop() == f"fmi2Get{name}: all variables of Gain are Real."
        refused(set_, [0], [value])
        assert slave.messages.pop() == f"fmi2Set{name}: all variables of Gain are Real."


def test_conditions(open_slave):
    slave = open_slave("Swing").begin()
    slave.set({"J[1,2]": 30.0, "drive": -2.0})
    refused(slave.exitInitializationMode)
    assert slave.messages == [
        "Swing: J is not positive definite (determinant -6 kg2.m4, J[1,1] = 2).",
        'Swing: drive = -2 1/s must be positive, "100 %" sure.',
    ]
    refused(slave.doStep, 0.0, 0.1)
    assert slave.messages[-1] == "fmi2DoStep: not allowed after an error."
    assert slave.get("drive") == [-2.0]
    slave.reset()
    slave.start()


def test_condition_that_is_no_number(open_slave):
    """0 / 0 is not > 0."""
    slave = open_slave("Swing").begin()
    slave.set({"J[1,1]": 1e300, "J[2,2]": 1e300, "J[1,2]": 1e300, "J[2,1]": 1e300})
    refused(slave.exitInitializationMode)
    assert "J is not positive definite (determinant " in slave.messages[0]


def test_text_of_a_condition_is_taken_as_it_is(tmp_path):
    slave = Slave(unpack(build_native(Braces(), tmp_path / "Braces.fmu"))).begin()
    refused(slave.exitInitializationMode)
    assert slave.messages == ["Braces: {k} = -1 ??/ \\ Ω %d"]
    slave.freeInstance()


def test_step_is_refused(open_slave):
    slave = open_slave("Swing").start(stop=1.0)
    for t, step, text in (
        (0.0, 0.0, "fmi2DoStep: step 0 s is not positive."),
        (0.0, -0.1, "fmi2DoStep: step -0.1 s is not positive."),
        (0.0, math.nan, "fmi2DoStep: step nan s is not positive."),
        (0.0, math.inf, "fmi2DoStep: step inf s is not positive."),
        (1e-8, 0.1, "fmi2DoStep: asked to start at 1e-08 s, the FMU is at 0 s."),
        (math.nan, 0.1, "fmi2DoStep: asked to start at nan s, the FMU is at 0 s."),
        (0.0, 1.1, "fmi2DoStep: a step to 1.1000000000000001 s passes the stop time 1 s."),
    ):
        refused(slave.doStep, t, step)
        assert slave.messages.pop() == text
    for largest in (-1.0, 1e-12):
        slave.set({"solver.step": largest})
        refused(slave.doStep, 0.0, 0.1)
        assert slave.messages.pop() == f"fmi2DoStep: solver.step = {largest:g} s does not suit a step of 0.1 s."
    slave.set({"solver.step": 0.1})
    for k in range(10):
        slave.doStep(k * 0.1, 0.1)  # a refused step leaves the FMU as it was
    refused(slave.doStep, 1.0, 1e-3)
    sampled = open_slave("Sum").begin()
    sampled.set({"sample_time": 1e-12})
    sampled.exitInitializationMode()
    refused(sampled.doStep, 0.0, 0.1)
    assert sampled.messages == ["fmi2DoStep: sample_time = 1e-12 s does not suit a step of 0.1 s."]


def test_sample_time_is_refused(open_slave):
    for period in (0.0, -1.0):
        slave = open_slave("Sum").begin()
        slave.set({"sample_time": period})
        refused(slave.exitInitializationMode)
        assert slave.messages == [f"Sum: sample_time = {period:g} s is not positive."]


def test_a_state_that_is_not_finite(open_slave):
    slave = open_slave("Blowup").start()
    slave.doStep(0.0, 0.05)
    refused(slave.doStep, 0.05, 0.5)
    assert slave.messages == ["fmi2DoStep: state x[2] is not finite at 0.55 s."]
    assert slave.get("x[1]") == [0.0]
    assert not math.isfinite(slave.get("x[2]")[0])
    assert slave.getRealStatus(2) == 0.05  # fmi2LastSuccessfulTime
    refused(slave.doStep, 0.55, 0.1)
    assert slave.messages[-1] == "fmi2DoStep: not allowed after an error."
    refused(slave.set, {"bias": 1.0})
    assert slave.messages[-1] == "fmi2SetReal: not allowed after an error."
    slave.terminate()


def test_call_order(open_slave):
    slave = open_slave("Swing")

    def says(text, call, *arguments, **named):
        refused(call, *arguments, **named)
        assert slave.messages.pop() == text

    says("fmi2DoStep: not allowed before initialization mode.", slave.doStep, 0.0, 0.1)
    says("fmi2GetReal: not allowed before initialization mode.", slave.get, "phase")
    says("fmi2ExitInitializationMode: not allowed before initialization mode.", slave.exitInitializationMode)
    says("fmi2SetupExperiment: start time = nan is not finite.", slave.setupExperiment, startTime=math.nan)
    says(
        "fmi2SetupExperiment: stop time 1 s is not after start time 2 s.",
        lambda: slave.setupExperiment(startTime=2.0, stopTime=1.0),
    )
    slave.begin()
    says("fmi2DoStep: not allowed in initialization mode.", slave.doStep, 0.0, 0.1)
    says("fmi2SetupExperiment: not allowed in initialization mode.", slave.setupExperiment)
    says("fmi2EnterInitializationMode: not allowed in initialization mode.", slave.enterInitializationMode)
    slave.exitInitializationMode()
    says("fmi2EnterInitializationMode: not allowed after initialization.", slave.enterInitializationMode)
    says("fmi2ExitInitializationMode: not allowed after initialization.", slave.exitInitializationMode)
    says("fmi2CancelStep: fmi2DoStep returns when the step is done, there is nothing to cancel.", slave.cancelStep)
    assert slave.getBooleanStatus(3) is False  # fmi2Terminated
    for call in (
        slave.getStatus,
        slave.getIntegerStatus,
        slave.getStringStatus,
        slave.getRealStatus,
        slave.getBooleanStatus,
    ):
        with pytest.raises(FMICallException) as caught:
            call(0)
        assert caught.value.status == 2
    slave.setDebugLogging(True, ["logAll"])
    slave.terminate()
    says("fmi2DoStep: not allowed after fmi2Terminate.", slave.doStep, 0.0, 0.1)
    slave.get("energy")


def test_derivatives_are_refused_by_name(open_slave):
    slave = open_slave("Swing")

    def says(text, call, *arguments):
        refused(call, *arguments)
        assert slave.messages.pop() == text

    function = "fmi2GetDirectionalDerivative"
    slave.begin()
    says(
        f"{function}: energy is not a known in initialization mode.",
        slave.getDirectionalDerivative,
        [],
        slave.vr("energy"),
        [1.0],
    )
    says(
        f"{function}: phase is not an unknown in initialization mode.",
        slave.getDirectionalDerivative,
        slave.vr("phase"),
        [],
        [],
    )
    slave.exitInitializationMode()
    says(
        f"{function}: drive is not a known after initialization.",
        slave.getDirectionalDerivative,
        [],
        slave.vr("drive"),
        [1.0],
    )
    says(
        f"{function}: soft is not an unknown after initialization.",
        slave.getDirectionalDerivative,
        slave.vr("soft"),
        [],
        [],
    )
    says(f"{function}: (none) is not a known after initialization.", slave.getDirectionalDerivative, [], [999], [1.0])
    function = "fmi2SetRealInputDerivatives"
    text = "inputs, order 1 to 3 only."
    says(f"{function}: variable phase, order 1: {text}", slave.setRealInputDerivatives, slave.vr("phase"), [1], [0.0])
    says(
        f"{function}: variable torque[2], order 4: {text}",
        slave.setRealInputDerivatives,
        slave.vr("torque[2]"),
        [4],
        [0.0],
    )
    text = f"{function}: variable torque[2] = nan is not finite."
    says(text, slave.setRealInputDerivatives, slave.vr("torque[2]"), [1], [math.nan])
    function = "fmi2GetRealOutputDerivatives"
    says(
        f"{function}: variable phase, order 1: outputs, order 1 only.",
        slave.getRealOutputDerivatives,
        slave.vr("phase"),
        [1],
    )
    says(
        f"{function}: variable energy, order 2: outputs, order 1 only.",
        slave.getRealOutputDerivatives,
        slave.vr("energy"),
        [2],
    )
    slave = open_slave("Sum").start()
    text = f"{function}: variable shown, order 1: sampled outputs have no derivatives."
    says(text, slave.getRealOutputDerivatives, slave.vr("shown"), [1])


def test_foreign_states_are_refused(open_slave):
    swing, wheel = open_slave("Swing").start(), open_slave("Wheel").start()
    data = swing.serializeFMUstate(swing.getFMUstate())
    for bad in (b"", b"x", data[:-1], data + b"\0", b"X" + data[1:], data[:8] + b"\7" + data[9:]):
        refused(swing.deSerializeFMUstate, bad)
        assert swing.messages.pop().startswith("fmi2DeSerializeFMUstate: ")
    refused(wheel.deSerializeFMUstate, data)
    assert wheel.messages.pop().startswith(
        "fmi2DeSerializeFMUstate: the state was saved by another FMU than Wheel, GUID {"
    )
    refused(swing.fmi2SerializeFMUstate, swing.component, swing.getFMUstate(), ctypes.create_string_buffer(3), 3)
    assert swing.messages.pop().startswith("fmi2SerializeFMUstate: 3 bytes, needed are ")
    for call, function in ((swing.setFMUstate, "SetFMUstate"), (swing.serializeFMUstate, "SerializedFMUstateSize")):
        refused(call, None)
        assert swing.messages.pop() == f"fmi2{function}: there is no state."


def test_instantiation_is_refused(fmus):
    folder = fmus("Gain").with_suffix("")
    with pytest.raises(Exception, match="Failed to instantiate"):
        Slave(folder, guid="{other}")
    with pytest.raises(Exception, match="Failed to instantiate"):
        Slave(folder, name="")
