"""What a native FMU refuses its Python twin refuses in the same words."""

import math

import pytest

from fmus.export.python.runtime import Runtime
from fmus.export.python.vector import RuntimeFailure

from .parts import every
from .slaves import refused

PARTS = every()

REFUSALS = {  # method of fmpy's slave, of its twin, arguments
    "no such variable to get": ("getReal", "get", ([999],)),
    "no such variable to set": ("setReal", "set", ([999], [1.0])),
    "set what cannot be set": ("setReal", "set", ([0], [1.0])),
    "set what is not finite": ("setReal", "set", (["torque[2]"], [math.inf])),
    "derivative of a state": ("setRealInputDerivatives", "set_input_derivatives", (["phase"], [1], [1.0])),
    "derivative of order 3": ("setRealInputDerivatives", "set_input_derivatives", (["torque[1]"], [3], [1.0])),
    "derivative of nothing": ("setRealInputDerivatives", "set_input_derivatives", ([999], [1], [1.0])),
    "derivative not finite": ("setRealInputDerivatives", "set_input_derivatives", (["torque[1]"], [2], [math.nan])),
    "no step": ("doStep", "do_step", (0.0, 0.0)),
    "no finite step": ("doStep", "do_step", (0.0, math.inf)),
    "another time": ("doStep", "do_step", (0.5, 0.1)),
    "no time": ("doStep", "do_step", (math.nan, 0.1)),
    "past the stop time": ("doStep", "do_step", (0.0, 1.1)),
}


@pytest.mark.parametrize(("native", "python", "arguments"), REFUSALS.values(), ids=REFUSALS)
def test_the_twins_refuse_in_the_same_words(open_slave, native, python, arguments):
    slave, twin = open_slave("Swing").start(stop=1.0), Runtime(PARTS["Swing"])
    twin.setup(0.0, 1.0)
    twin.exit_initialization()
    given = [[slave.reference.get(e, e) for e in a] if isinstance(a, list) else a for a in arguments]
    refused(getattr(slave, native), *given)
    with pytest.raises(RuntimeFailure) as caught:
        getattr(twin, python)(*given)
    assert [str(caught.value)] == slave.messages


@pytest.mark.parametrize(("start", "stop"), [(math.nan, None), (math.inf, None), (0.0, -1.0), (0.0, math.nan)])
def test_the_twins_refuse_an_experiment_in_the_same_words(open_slave, start, stop):
    slave, twin = open_slave("Swing"), Runtime(PARTS["Swing"])
    refused(slave.setupExperiment, startTime=start, stopTime=stop)
    with pytest.raises(RuntimeFailure) as caught:
        twin.setup(start, stop)
    assert [str(caught.value)] == slave.messages
