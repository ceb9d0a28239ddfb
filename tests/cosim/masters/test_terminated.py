"""fmi2Discard with fmi2Terminated: the FMU ends the run, which is no failure."""

import pytest
from numpy.testing import assert_array_equal

from cosim import flights
from cosim.errors import StepFailed

from .. import both, c_fmu
from ..c_fmu import real

NO = "fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind k, fmi2Boolean *x) { return fmi2Discard; }"
YES = NO.replace("return fmi2Discard;", "*x = k == fmi2Terminated; return fmi2OK;")


def ending(folder, template):
    """y = t; the step from 0.5 s on is discarded."""
    return c_fmu.build(
        folder, "Ends", [real("y")], outputs="y = m->now;", step="if (t > 0.45) return fmi2Discard;", template=template
    )


@pytest.mark.parametrize("loop", both.LOOPS)
def test_the_run_is_finished_and_says_who_ended_it(tmp_path, loop):
    system = both.of({"a": ending(tmp_path, c_fmu.C.replace(NO, YES))}, [])
    result = flights.simulate(system, both.experiment(loop=loop), out=tmp_path / "out")
    assert_array_equal(result.time, [0.0, 0.1, 0.2, 0.3, 0.4, 0.5])
    assert (result.info["status"], result.info["reached_time"]) == ("finished", 0.5)
    assert result.info["event"] == {"time": 0.5, "variable": "a", "meaning": "the FMU ended the run (fmi2Terminated)"}


@pytest.mark.parametrize("loop", both.LOOPS)
@pytest.mark.parametrize("h", [0.1, 0.25])
def test_a_step_that_was_taken_whole_counts(tmp_path, loop, h):
    """The FMU has come to the end of the step, and wants no other: its last successful time is the end."""
    path = c_fmu.build(
        tmp_path, "Ends", [real("y")], outputs="y = m->now;",
        step="m->last = t + h; if (t > 0.45) { m->now = t + h; return fmi2Discard; }",
        template=c_fmu.C.replace(NO, YES),
    )  # fmt: skip
    for _ in range(2):
        result = flights.simulate(both.of({"a": path}, []), both.experiment(loop=loop, step=h))
        assert_array_equal(result["a.y"], result.time)
        assert result.time[-1] == pytest.approx(0.6 if h == 0.1 else 0.75)
        assert (result.info["status"], result.info["event"]["variable"]) == ("finished", "a")


def test_a_step_that_is_only_discarded_is_a_failure(tmp_path):
    error = both.failure(StepFailed, both.of({"a": ending(tmp_path, c_fmu.C)}, []))
    assert "a returned fmi2Discard at communication point 0.5 s" in str(error)
