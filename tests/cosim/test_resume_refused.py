"""What no run goes on from, or not so: each is told by name, with both values and the way out."""

import json
import os
import re
import shutil
import threading
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest

from cosim import flights, resume
from cosim.errors import NotSupported, ResultBusy, SignalError, StepFailed, TimeError, UnknownName
from cosim.masters.error_controlled import ErrorControlled
from cosim.masters.explicit import Explicit
from cosim.results import checkpoint
from cosim.results.checkpoint import Checkpoint, CheckpointRefused, CheckpointUnwritable
from cosim.results.claim import claimed
from cosim.results.names import CHECKPOINT, INFO
from cosim.results.result import Result
from cosim.resuming import resume as go_on
from cosim.system import Experiment, Signal, System

from . import both, slope_fmus
from .c_fmu import C, build, real
from .fakes import Clock

COUNT = {"outputs": "y = (double)m->whole[0];", "step": "m->whole[0]++;"}


def counter(folder, name="Counter", **more):
    return build(folder, name, [real("y")], **{**COUNT, **more})


@pytest.fixture(scope="module")
def fmu(tmp_path_factory):
    """y counts steps."""
    return counter(tmp_path_factory.mktemp("counter"))


@pytest.fixture(scope="module")
def slopes(tmp_path_factory):
    return slope_fmus.made(tmp_path_factory.mktemp("slopes"))


class Cut(Exception):
    """Ends a run at a checkpoint."""


def interrupted(system, setup, folder, at=0.5, every=0.25, **more):
    """A run that ended at its first checkpoint from `at` s on."""

    def progress(t, _stop):
        if t >= at - 1e-9:
            raise Cut

    with pytest.raises(Cut):
        flights.simulate(system, setup, out=folder, checkpoint=every, progress=progress, **more)
    return folder


@pytest.fixture
def alone(fmu):
    return both.of({"a": fmu}, [])


@pytest.fixture
def left(alone, tmp_path, monkeypatch):
    """A run of 1 s that was interrupted at 0.5 s, in the folder `out` of where the test is."""
    monkeypatch.chdir(tmp_path)
    interrupted(alone, both.experiment(), Path("out"))
    return Path("out")


def refused(folder, *, kind=CheckpointRefused, **more) -> str:
    with pytest.raises(kind) as caught:
        go_on(folder, **more)
    return str(caught.value)


class TestBeforeTheFlight:
    def test_fmus_whose_states_cannot_be_saved(self, fmu, tmp_path):
        """All of them, before anything is written."""
        sealed = counter(tmp_path, "Sealed", canSerializeFMUstate=False, canGetAndSetFMUstate=False)
        told = counter(tmp_path, "Told", canSerializeFMUstate=False)
        system = both.of({"a": fmu, "b": sealed, "c": told}, [])
        with pytest.raises(NotSupported) as caught:
            flights.simulate(system, both.experiment(), out=tmp_path / "out", checkpoint=0.5)
        assert str(caught.value) == (
            "a checkpoint has the states of all FMUs, and of these they cannot be saved: "
            "b (canGetAndSetFMUstate=false, canSerializeFMUstate=false), c (canSerializeFMUstate=false). "
            "Fly without checkpoints, or with other FMUs in their place, as adcs builds them: --use INSTANCE=FMU."
        )
        assert not (tmp_path / "out").exists()

    @pytest.mark.parametrize("every", [0, -1.0])
    def test_a_time_between_two_that_is_none(self, alone, tmp_path, every):
        with pytest.raises(
            TimeError, match=rf"checkpoint is {every:g} s: the time between two checkpoints must be pos"
        ):
            flights.simulate(alone, both.experiment(), out=tmp_path / "out", checkpoint=every)

    def test_no_folder(self, alone):
        with pytest.raises(NotSupported, match=r"checkpoints of a result that is not written\. Give it a folder: out="):
            flights.simulate(alone, both.experiment(), checkpoint=0.5)

    def test_a_master_of_one_s_own(self, alone, tmp_path):
        @dataclass(frozen=True)
        class Mine(Explicit):
            pass

        setup = replace(both.experiment(), master=Mine())
        with pytest.raises(
            NotSupported, match=r"cannot be written down, to be gone on with: .* called 'Mine'\. Fly it"
        ):
            flights.simulate(alone, setup, out=tmp_path / "out", checkpoint=0.5)

    def test_an_fmu_that_says_more_than_it_can(self, tmp_path, monkeypatch):
        """It is found at the first checkpoint, which is before the first step."""
        monkeypatch.chdir(tmp_path)
        serialize = "fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate s, fmi2Byte b[], size_t n) {"
        assert serialize in C
        template = C.replace(serialize, f"{serialize} if (c) return fmi2Error;")
        step = 'FILE *f = fopen("stepped", "w"); if (f) fclose(f);'
        system = both.of({"a": counter(tmp_path, "Boast", template=template, step=step)}, [])
        with pytest.raises(NotSupported) as caught:
            flights.simulate(system, both.experiment(), out=tmp_path / "out", checkpoint=0.5)
        assert str(caught.value) == (
            "a says that its state can be saved (canSerializeFMUstate), but a: fmi2SerializeFMUstate returned "
            "fmi2Error. Fly without checkpoints, or with another FMU in its place."
        )
        assert not Path("stepped").exists() and len(caught.value.result) == 1


class TestDamaged:
    @pytest.mark.parametrize("part", [0.0, 0.1, 0.5, 0.9, 0.999])
    def test_cut(self, left, part):
        path = left / CHECKPOINT
        data = path.read_bytes()
        path.write_bytes(data[: int(part * len(data))])
        text = refused(left)
        if part > 0.05:
            sums = r"its checksum is \w{12}\.\.\., written was \w{12}\.\.\."
            assert re.match(rf"out/checkpoint\.bin: it is cut or damaged: {sums}", text)
        else:
            assert text.startswith("out/checkpoint.bin: it is no checkpoint of adcs-cosim. ")
        assert text.endswith("No run can go on from it: fly anew.")

    def test_a_bit(self, left):
        path = left / CHECKPOINT
        data = bytearray(path.read_bytes())
        data[-1000] ^= 1
        path.write_bytes(data)
        assert "it is cut or damaged" in refused(left)

    def test_another_format(self, left):
        path = left / CHECKPOINT
        path.write_bytes(path.read_bytes().replace(b"checkpoint 1\n", b"checkpoint 2\n", 1))
        assert refused(left) == (
            "out/checkpoint.bin: its format is 2, known here is 1. Go on with the version of adcs-cosim that wrote it."
        )

    def test_none(self, alone, left):
        (left / CHECKPOINT).unlink()
        assert refused(left) == (
            "out: there is no checkpoint in it. A flight with --checkpoint TIME (checkpoint=...) leaves one."
        )
        assert refused("nowhere") == "nowhere: there is no such folder. Give that of a result."

    def test_run_json_that_does_not_say_what_flew(self, left):
        info = json.loads((left / INFO).read_text())
        flight = info.pop("flight")
        (left / INFO).write_text(json.dumps(info))
        assert refused(left).startswith("out/run.json: it does not say what flew with this checkpoint. Fly anew, ")
        del flight["format"]
        (left / INFO).write_text(json.dumps(info | {"flight": flight}))
        assert refused(left).startswith("out/run.json: what flew cannot be read: KeyError('format'). Fly anew, ")

    def test_rows_that_are_lost(self, left):
        next(left.glob("result.*")).unlink()
        assert refused(left).startswith("out: there are no rows in it (no result.arrows, and no result). Fly anew, ")

    def test_rows_that_are_fewer(self, alone, left, tmp_path):
        shutil.copy(next(interrupted(alone, both.experiment(), tmp_path / "b", at=0.25).glob("result.*")), left)
        text = refused(left)
        assert text.startswith("out/result.arrows: it has 4 rows, 6 belong to the checkpoint. Fly anew, into another ")

    def test_rows_of_other_variables(self, fmu, left, tmp_path):
        other = interrupted(both.of({"b": fmu}, []), both.experiment(), tmp_path / "b")
        shutil.copy(next(other.glob("result.*")), left)
        assert "its columns are not those of the checkpoint" in refused(left)


def edited(folder, change) -> None:
    """Let run.json say something else of what flew."""
    info = json.loads((folder / INFO).read_text())
    change(info["flight"])
    (folder / INFO).write_text(json.dumps(info))


class TestAnotherFlight:
    OF = "out/checkpoint.bin: it is of another flight: "

    def test_another_step(self, left):
        edited(left, lambda flight: flight["experiment"].update(communication_step_size=0.05))
        assert refused(left) == (
            f"{self.OF}experiment.communication_step_size was 0.1, and is 0.05 now. Let run.json say what it said. Or: "
            "Fly anew, into another folder or with --force (overwrite=True)."
        )

    def test_another_master(self, left):
        edited(left, lambda flight: flight["experiment"].update(master={"!Iterated": {"tolerance": 1e-8}}))
        text = refused(left)
        assert (
            f"{self.OF}experiment.master was Explicit(kernel='always'), and is Iterated(tolerance=1e-08) now." in text
        )

    def test_another_system(self, left, alone, tmp_path):
        """Its checkpoint and its rows, beside the run.json of this one."""
        other = interrupted(replace(alone, name="other"), both.experiment(), tmp_path / "b")
        shutil.copy(other / CHECKPOINT, left)
        assert f"{self.OF}system.name was 'other', and is 'test' now." in refused(left)

    def test_another_version(self, left, monkeypatch):
        versions = {"adcs-cosim": "9.9"}
        monkeypatch.setattr("cosim.results.runinfo.versions", lambda: versions)
        text = refused(left)
        assert re.search(r"made_by\.adcs-cosim was '[\d.]+', and is '9\.9' now\. Go on with what wrote it\. Or: ", text)

    def test_an_fmu_with_another_guid(self, alone, left, tmp_path):
        path = counter(tmp_path, "Another")
        edited(left, lambda flight: flight["fmus"]["a"].update(path=str(path)))
        text = refused(left)
        assert f"{self.OF}fmus.a.guid was '{{Counter}}', and is '{{Another}}' now. Put the FMU back that it " in text

    def test_an_fmu_with_another_binary(self, left, tmp_path):
        (tmp_path / "b").mkdir()
        path = counter(tmp_path / "b", step="m->whole[0] += 2;")
        edited(left, lambda flight: flight["fmus"]["a"].update(path=str(path)))
        assert re.search(r"fmus\.a\.contents was '\w{16}', and is '\w{16}' now\. Put the FMU back", refused(left))

    def test_a_signal_whose_file_has_changed(self, slopes, tmp_path, monkeypatch):
        monkeypatch.chdir(tmp_path)
        Path("gust.csv").write_text("time,u\n0,0\n2,3\n")
        system = both.of({"a": slopes["Line"]}, [], inputs={"a.u": Signal("gust.csv")})
        folder = interrupted(system, both.experiment(), Path("out"))
        Path("gust.csv").write_text("time,u\n0,0\n2,4\n")
        text = refused(folder, kind=SignalError)
        assert re.search(
            r"gust.csv has changed: its SHA-256 is \w{64}, when the run began it was \w{64}\. Put the", text
        )

    def test_an_fmu_that_is_gone(self, left):
        edited(left, lambda flight: flight["system"]["components"].update(a="gone.fmu"))
        edited(left, lambda flight: flight["fmus"]["a"].update(path="/nowhere/gone.fmu"))
        assert "gone.fmu" in refused(left, kind=Exception)

    def test_one_that_another_process_has_gone_on_from(self, left, monkeypatch):
        reads = [Checkpoint.read(left), replace(Checkpoint.read(left), written="later")]
        monkeypatch.setattr(Checkpoint, "read", lambda _folder: reads.pop(0))
        text = refused(left)
        assert text == "out/checkpoint.bin: another process has gone on from it meanwhile. Begin again."

    def test_a_run_that_still_goes_on(self, left):
        with claimed(left):
            assert "is being written by process" in refused(left, kind=ResultBusy)

    def test_an_fmu_that_does_not_take_its_state_back(self, tmp_path, monkeypatch):
        monkeypatch.chdir(tmp_path)
        from cosim import Library

        from .oscillator import Damper

        system = System(name="damper", components={"d": Damper}, hold_unconnected=True)
        folder = interrupted(system, both.experiment(), Path("out"), locate=Library("native"))
        saved = Checkpoint.read(folder)
        state = saved.point.states["d"]
        broken = replace(saved, point=replace(saved.point, states={"d": state[:-1] + bytes([state[-1] ^ 1])}))
        broken.write(folder, None)
        text = refused(folder)
        assert text.startswith("out/checkpoint.bin: an FMU does not take back its state: d: fmi2DeSerializeFMUstate ")


class TestStop:
    """Another stop time is one with which every step so far would have been the same."""

    def later(self, system, setup, folder, stop, **more):
        """A run that is begun with one stop time and ended with another one equals one that had it from the start."""
        flights.simulate(system, setup, out=folder, checkpoint=0.25, **more)
        longer = go_on(folder, stop_time=stop)
        both.assert_same(flights.simulate(system, replace(setup, stop_time=stop)), longer)
        assert longer.info["stop_time"] == stop and longer.info["resumed_at"] == setup.stop_time
        return longer

    @pytest.mark.parametrize("loop", both.LOOPS)
    @pytest.mark.parametrize("every", [1, 3])
    def test_further_from_the_end(self, alone, tmp_path, loop, every):
        """The last row of the shorter flight goes where it is none of the longer one."""
        again = self.later(alone, both.experiment(loop=loop, every=every), tmp_path / "out", 1.65)
        assert again["a.y"][-1] == 17

    def test_twice(self, alone, tmp_path):
        self.later(alone, both.experiment(), tmp_path / "out", 2.0)
        longest = go_on(tmp_path / "out", stop_time=3.0)
        both.assert_same(flights.simulate(alone, both.experiment(stop=3.0)), longest)

    def test_shorter(self, alone, left):
        both.assert_same(flights.simulate(alone, both.experiment(stop=0.8)), go_on(left, stop_time=0.8))

    def test_of_error_controlled_steps(self, slopes, tmp_path):
        system = both.of({"s": slopes["Sine2"], "y": slopes["Cubic"]}, [("s.y", "y.u", "smooth")])
        setup = Experiment(stop_time=1.0, communication_step_size=0.1, master=ErrorControlled(relative=1e-6), every=5)
        self.later(system, setup, tmp_path / "out", 2.0)

    def test_not_after_the_point_reached(self, left):
        at = "out/checkpoint.bin: the run has come to 0.5 s"
        further = "Fly further: --stop TIME (stop_time=...)."
        assert refused(left, stop_time=0.5) == f"{at}, which is not before the stop time 0.5 s. {further}"
        go_on(left)
        assert refused(left) == f"out/checkpoint.bin: the run has come to 1 s. {further}"

    def test_a_step_that_was_shortened(self, alone, tmp_path, monkeypatch):
        monkeypatch.chdir(tmp_path)
        flights.simulate(alone, both.experiment(stop=0.95), out="out", checkpoint=0.5)
        assert refused("out", stop_time=2.0) == (
            "out/checkpoint.bin: a flight to 2 s would not have come to it: the step before 0.95 s was shortened to "
            "end there. Go on to 0.95 s, or fly anew with that stop time."
        )

    def test_steps_of_a_slow_component_that_was_shortened(self, fmu, tmp_path, monkeypatch):
        monkeypatch.chdir(tmp_path)
        system = both.of({"a": fmu}, [], steps={"a": 4})
        interrupted(system, both.experiment(), Path("out"), at=0.9, every=0.9)
        assert "a takes 4 steps at once, and is within its last, which the stop" in refused("out", stop_time=2.0)
        interrupted(system, both.experiment(), Path("earlier"), at=0.7, every=0.7)
        both.assert_same(flights.simulate(system, both.experiment(stop=2.0)), go_on("earlier", stop_time=2.0))

    def test_error_controlled_steps_near_the_old_stop(self, slopes, tmp_path, monkeypatch):
        monkeypatch.chdir(tmp_path)
        system = both.of({"s": slopes["Sine2"], "y": slopes["Cubic"]}, [("s.y", "y.u", "smooth")])
        setup = Experiment(stop_time=1.3, communication_step_size=0.1, master=ErrorControlled(), every=5)
        interrupted(system, setup, Path("out"), at=1.1, every=0.05)
        assert "the steps from 1 s on were chosen to end at the stop time" in refused("out", stop_time=2.0)

    def test_a_sample_of_a_signal_near_the_old_stop(self, slopes, tmp_path, monkeypatch):
        """A knot a hair from a communication point is taken there, one beyond the end is not."""
        monkeypatch.chdir(tmp_path)
        signal = Signal(([0.0, 0.2, 1.5 + 1e-10, 3.0], [0.0, 1.0, -1.0, 0.0]))
        system = both.of({"y": slopes["Line"]}, [], inputs={"y.u": signal})
        interrupted(system, both.experiment(), Path("out"))
        assert "a sample of a signal of y lies at another communication point" in refused("out", stop_time=2.0)

    def test_a_stop_time_that_the_fmus_were_told(self, alone, tmp_path, monkeypatch):
        monkeypatch.chdir(tmp_path)
        setup = both.experiment(announce_stop_time=True)
        interrupted(alone, setup, Path("out"))
        assert "the FMUs were told that it stops at 1 s (announce_stop_time)" in refused("out", stop_time=2.0)
        both.assert_same(flights.simulate(alone, setup), go_on("out"))


class TestGiven:
    """Instances that were given to a run are given again."""

    def test_they_must_be(self, tmp_path, monkeypatch):
        monkeypatch.chdir(tmp_path)
        system = System(name="given", components={"c": "Clock"})
        setup = both.experiment(loop="auto")
        flights.simulate(system, setup, slaves={"c": Saved("c")}, out="out", checkpoint=0.5)
        assert refused("out", kind=NotSupported) == (
            "the run was given instances that are no FMU files: c. Give such again: cosim.resume(folder, slaves={...})."
        )
        assert 'unknown component "d" in slaves' in refused("out", kind=UnknownName, slaves={"d": Saved("d")})
        again = go_on("out", slaves={"c": Saved("c")}, stop_time=2.0)
        np.testing.assert_allclose(again["c.y"], np.arange(21) / 10)


class Saved(Clock):
    """A clock whose state can be saved."""

    def __init__(self, name):
        super().__init__(name, can_get_and_set_state=True, can_serialize_state=True)

    def serialize_state(self, state):
        return json.dumps(state).encode()

    def deserialize_state(self, data):
        return json.loads(data)


class TestFullDisk:
    def test_the_older_one_stays_and_the_run_goes_on_from_it_later(self, alone, tmp_path, monkeypatch):
        monkeypatch.chdir(tmp_path)
        setup = both.experiment(loop="always")
        real_fsync, left = os.fsync, [7]

        def full(handle):
            left[0] -= 1
            if left[0] < 0:
                raise OSError(28, os.strerror(28))
            real_fsync(handle)

        monkeypatch.setattr(checkpoint.os, "fsync", full)
        with pytest.raises(CheckpointUnwritable) as caught:
            flights.simulate(alone, setup, out="out", checkpoint=0.25)
        monkeypatch.undo()
        monkeypatch.chdir(tmp_path)
        text = str(caught.value)
        assert text == (
            "checkpoint out/checkpoint.bin cannot be written: No space left on device. The one of 0.3 s is whole: make "
            "room, then go on from it with adcs run --resume out."
        )
        assert caught.value.result.info["status"] == "failed"
        assert not (tmp_path / "out" / f".{CHECKPOINT}").exists()
        both.assert_same(flights.simulate(alone, setup), go_on("out"))

    def test_no_room_for_the_first(self, alone, tmp_path, monkeypatch):
        monkeypatch.chdir(tmp_path)
        monkeypatch.setattr(Path, "replace", _refuse(Path.replace))
        with pytest.raises(CheckpointUnwritable, match=r"There is none before it\. Choose another folder \(out=\.\.\."):
            flights.simulate(alone, both.experiment(), out="out", checkpoint=0.25)


def _refuse(replace):
    def call(path, target):
        if path.name == f".{CHECKPOINT}":
            raise OSError(28, os.strerror(28))
        return replace(path, target)

    return call


def test_a_step_that_fails_leaves_the_checkpoint_before_it(tmp_path, monkeypatch):
    """What made it fail is put right elsewhere, and the run goes on."""
    monkeypatch.chdir(tmp_path)
    step = 'FILE *f = fopen("broken", "r"); if (f) { fclose(f); if (t > 0.65) return fmi2Error; } m->whole[0]++;'
    system = both.of({"a": counter(tmp_path, step=step)}, [])
    Path("broken").touch()
    with pytest.raises(StepFailed):
        flights.simulate(system, both.experiment(), out="out", checkpoint=0.25)
    assert Checkpoint.read(Path("out")).time == 0.5
    Path("broken").unlink()
    again = go_on("out")
    assert again["a.y"].tolist() == list(range(11)) and again.info["resumed_at"] == 0.5


def test_a_thread_may_go_on(left, alone):
    """Outside the main thread, where no signal is heard."""
    found = []
    thread = threading.Thread(target=lambda: found.append(resume(left)))
    thread.start()
    thread.join()
    both.assert_same(flights.simulate(alone, both.experiment()), found[0])
    assert isinstance(found[0], Result)
