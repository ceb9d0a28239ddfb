"""From what no run goes on: what cannot be saved, what is damaged; each is told by name, with the way out."""

import json
import re
import shutil
from dataclasses import dataclass, replace
from pathlib import Path

import pytest

from cosim import flights
from cosim.errors import NotSupported, TimeError
from cosim.masters.explicit import Explicit
from cosim.results.names import CHECKPOINT, INFO

from .. import both
from ..c_fmu import C
from .left import counter, interrupted, refused


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
        assert text.startswith(
            "out/result.arrows: it has 4 rows, 5 were there before the checkpoint. Fly anew, into another "
        )

    def test_rows_of_other_variables(self, fmu, left, tmp_path):
        other = interrupted(both.of({"b": fmu}, []), both.experiment(), tmp_path / "b")
        shutil.copy(next(other.glob("result.*")), left)
        assert "its columns are not those of the checkpoint" in refused(left)
