"""Runs that failed: on a full disk, in a step; the checkpoint before that is whole, and the run goes on from it."""

import os
import threading
from pathlib import Path

import pytest

from cosim import flights, resume
from cosim.errors import StepFailed
from cosim.results import checkpoint
from cosim.results.checkpoint import Checkpoint, CheckpointUnwritable
from cosim.results.names import CHECKPOINT
from cosim.results.result import Result
from cosim.resuming import resume as go_on

from .. import both
from .left import counter


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
