"""A step that returns fmi2Pending is waited for, with a timeout: the same in both loops."""

import os
import signal
import threading
from dataclasses import replace

import pytest
from numpy.testing import assert_allclose

from cosim import flights
from cosim.errors import StepFailed, TimeError
from cosim.masters.iterated import Iterated
from cosim.system import Experiment

from .. import both, c_fmu
from ..c_fmu import integer, real

STATUS = "fmi2Status fmi2GetStatus(fmi2Component c, const fmi2StatusKind k, fmi2Status *s) { return fmi2Discard; }"
CANCEL = "fmi2Status fmi2CancelStep(fmi2Component c) { return fmi2OK; }"


@pytest.fixture(scope="module")
def asynchronous(tmp_path_factory):
    """y = t, from the third step on `polls` questions late; then `ends` is the status of the step, 5: it stays so."""
    asked = (
        "fmi2Status fmi2GetStatus(fmi2Component c, const fmi2StatusKind k, fmi2Status *s) { MEMORY; (void)i;"
        " if (k != fmi2DoStepStatus) return fmi2Error;"
        " *s = ++m->whole[1] > m->number[0] ? m->number[1] : fmi2Pending;"
        " if (*s != fmi2Pending) m->real[0] = m->state[0];"
        " return m->number[2] ? fmi2Discard : fmi2OK; }"
    )
    cancelled = (
        'fmi2Status fmi2CancelStep(fmi2Component c) { FILE *f = fopen("cancelled", "a"); fputs("x", f); fclose(f);'
        " return fmi2OK; }"
    )
    return c_fmu.build(
        tmp_path_factory.mktemp("asynchronous"),
        "Asynchronous",
        [integer("polls", "parameter"), integer("ends", "parameter"), integer("mute", "parameter"), real("y")],
        step="m->state[0] = t + h; m->whole[1] = 0; if (++m->whole[0] >= 3) return fmi2Pending; y = t + h;",
        template=c_fmu.C.replace(STATUS, asked).replace(CANCEL, cancelled),
        canRunAsynchronuously=True,
    )


@pytest.fixture(autouse=True)
def _here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def system(path, polls, ends, mute=0):
    return both.of({"a": path}, [], parameters={"a.polls": polls, "a.ends": ends, "a.mute": mute})


def cancelled(folder):
    file = folder / "cancelled"
    return file.read_text() if file.exists() else ""


@pytest.mark.parametrize("ends", [0, 1])
def test_a_step_that_ends_well(asynchronous, tmp_path, ends):
    result = both.fly(system(asynchronous, 3, ends))
    assert_allclose(result["a.y"], result.time)
    warned = {"a": {"fmi2DoStep": {"count": 8, "first": 0.2}}} if ends else {}
    assert result.info["fmi2Warning"] == warned
    assert cancelled(tmp_path) == ""


@pytest.mark.parametrize(("ends", "name"), [(2, "fmi2Discard"), (3, "fmi2Error"), (-1, "the illegal status -1")])
def test_a_step_that_ends_badly(asynchronous, ends, name):
    error = both.failure(StepFailed, system(asynchronous, 3, ends))
    assert str(error).startswith(f"a returned {name} at communication point 0.2 s, step 0.1 s")
    assert error.result.time.tolist() == [0.0, 0.1, 0.2]


def test_a_step_that_stays_pending(asynchronous, tmp_path):
    error = both.failure(StepFailed, system(asynchronous, 0, 5), both.experiment(pending_timeout=0.05))
    assert str(error) == (
        "a was still in its step (fmi2DoStep returned fmi2Pending) after 0.05 s of waiting, at communication point 0.2 "
        "s, step 0.1 s; it was told to cancel it (fmi2CancelStep). Give it more time: pending_timeout=..., "
        "--pending-timeout SECONDS"
    )
    assert error.waited == 0.05
    assert error.result.time.tolist() == [0.0, 0.1, 0.2]
    assert cancelled(tmp_path) == "xx"  # once in each loop


def test_an_fmu_that_does_not_tell_its_status(asynchronous):
    error = both.failure(StepFailed, system(asynchronous, 0, 5, mute=1))
    assert str(error) == "a returned fmi2Pending at communication point 0.2 s, step 0.1 s"


@pytest.mark.parametrize("loop", both.LOOPS)
def test_ctrl_c_while_it_waits(asynchronous, tmp_path, loop):
    timer = threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGINT))
    timer.start()
    result = flights.simulate(system(asynchronous, 0, 5), both.experiment(loop=loop))
    timer.join()
    assert result.info["status"] == "interrupted"
    assert result.time.tolist() == [0.0, 0.1, 0.2]
    assert cancelled(tmp_path) == "x"


def test_the_instance_flies_again_after_a_step_that_was_cancelled(asynchronous):
    with flights.prepare(system(asynchronous, 0, 5)) as prepared:
        with pytest.raises(StepFailed):
            prepared.fly(both.experiment(pending_timeout=0.01))
        assert len(prepared.fly(both.experiment(), parameters={"a.polls": 2, "a.ends": 0})) == 11


@pytest.mark.parametrize("timeout", [0.0, -1.0, float("nan"), float("inf")])
def test_bad_timeouts(asynchronous, timeout):
    words = rf"pending_timeout is {timeout}: it must be above 0 and finite"
    with pytest.raises(TimeError, match=words):
        flights.simulate(system(asynchronous, 0, 0), replace(both.experiment(), pending_timeout=timeout))


def test_on_the_command_line(asynchronous, adcs):
    outcome = adcs(
        "run", asynchronous, "--set", "Asynchronous.ends=5", "--stop", "1", "--step", "0.1", "--pending-timeout", "0.02"
    )
    assert outcome.status == 1
    assert "after 0.02 s of waiting" in " ".join(outcome.err.split())
    assert adcs("run", asynchronous, "--stop", "1", "--pending-timeout", "0").status == 2


@pytest.mark.parametrize("mute", [0, 1])
def test_the_iterated_master_waits_once_and_repeats_nothing(asynchronous, tmp_path, mute):
    setup = Experiment(stop_time=1.0, communication_step_size=0.1, master=Iterated(), pending_timeout=0.05)
    with pytest.raises(StepFailed) as caught:
        flights.simulate(system(asynchronous, 0, 5, mute), setup)
    assert caught.value.result.time.tolist() == [0.0, 0.1, 0.2]
    assert cancelled(tmp_path) == "x"
