"""A run goes on as what it was: of another flight each difference is told, with both values and the way out."""

import json
import re
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np

from cosim import flights
from cosim.errors import NotSupported, ResultBusy, SignalError, UnknownName
from cosim.results.checkpoint import Checkpoint
from cosim.results.claim import claimed
from cosim.results.names import CHECKPOINT, INFO
from cosim.resuming import resume as go_on
from cosim.system import Signal, System

from .. import both
from ..fakes import Clock
from .left import counter, interrupted, refused


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

        from ..oscillator import Damper

        system = System(name="damper", components={"d": Damper}, hold_unconnected=True)
        folder = interrupted(system, both.experiment(), Path("out"), locate=Library("native"))
        saved = Checkpoint.read(folder)
        state = saved.point.states["d"]
        broken = replace(saved, point=replace(saved.point, states={"d": state[:-1] + bytes([state[-1] ^ 1])}))
        broken.write(folder, None)
        text = refused(folder)
        assert text.startswith("out/checkpoint.bin: an FMU does not take back its state: d: fmi2DeSerializeFMUstate ")


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
