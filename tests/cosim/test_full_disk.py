"""Disks that are full, folders that are gone or in the way, names that no file can have: what is kept and told."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from cosim import errors
from cosim.errors import ResultUnreadable, ResultUnwritable
from cosim.results import formats, recorder, story
from cosim.results.names import INFO, STREAM
from cosim.results.result import Result

from .c_fmu import build, real
from .fakes import Clock
from .flights import run

ROOT = Path(__file__).parents[2]

PROGRAM = """
from cosim import Experiment, System

def counter():
    return System(name="counter", components={{"a": {fmu!r}}}), Experiment(
        stop_time=200.0, communication_step_size=1e-3
    )
"""
LIMITED = """
import resource, sys
resource.setrlimit(resource.RLIMIT_FSIZE, ({size}, {size}))
sys.argv[0] = "adcs"
from adcs_cosim import main
main()
"""


@pytest.fixture(scope="module")
def counter(tmp_path_factory):
    """y counts steps."""
    code = "y = (double)m->whole[0];"
    return build(tmp_path_factory.mktemp("counter"), "Counter", [real("y")], outputs=code, step="m->whole[0]++;")


@pytest.fixture
def fly(counter, tmp_path):
    """`adcs run` of 200001 rows, 3.2 MB, where no file may grow above `size` bytes; or in a folder `at` a full disk."""
    (tmp_path / "counter.py").write_text(PROGRAM.format(fmu=str(counter)))

    def call(size=None, *more, out="out", cwd=tmp_path, **environment):
        start = ["-c", LIMITED.format(size=size)] if size else ["-m", "cosim"]
        command = [sys.executable, *start, "run", str(tmp_path / "counter.py"), *(["--out", out] if out else []), *more]
        done = subprocess.run(
            command, cwd=cwd, env=os.environ | {"PYTHONPATH": str(ROOT)} | environment,
            capture_output=True, text=True, timeout=120, check=False,
        )  # fmt: skip
        assert "Traceback" not in done.stderr, done.stderr
        return done

    return call


def kept(folder: Path, done) -> int:
    """What is left is readable, true and named; return the number of rows."""
    info = json.loads((folder / INFO).read_text())
    assert (info["status"], info["error"]) == ("failed", "ResultUnwritable"), info
    assert f"ResultUnwritable: {info['why']}" in done.stderr
    assert not [p.name for p in folder.iterdir() if p.name.startswith(".")]
    try:
        result = Result.read(folder)
    except ResultUnreadable:
        return 0
    assert np.array_equal(result["a.y"], np.arange(len(result)) * (1 if len(result) < 2 else result["a.y"][1]))
    assert info["rows"] == len(result)
    assert f"{len(result)} rows recorded" in done.stdout and f"wrote {folder.name}/result." in done.stdout
    return len(result)


@pytest.mark.skipif(os.name != "posix", reason="there are no limits of files")
@pytest.mark.parametrize("kilobytes", [32, 48, 64, 256, 1024, 2048])
def test_a_file_that_may_not_grow(fly, tmp_path, kilobytes):
    done = fly(1024 * kilobytes)
    assert done.returncode == 1, done.stderr
    assert "out/result.arrows cannot be written: File too large. Choose another folder" in done.stderr
    rows = kept(tmp_path / "out", done)
    assert rows > 0
    assert rows > 60_000 or kilobytes < 2048


@pytest.mark.parametrize("kilobytes", [4, 8, 12, 16, 20, 24, 32, 64, 128, 256, 512, 1024, 2048])
def test_a_disk_of_every_size(fly, disk, kilobytes):
    place = disk(kilobytes)
    done = fly(cwd=place)
    assert done.returncode == 1, done.stderr
    assert "ResultUnwritable: out/" in done.stderr and "No space left on device. Choose another folder" in done.stderr
    if not (place / "out" / INFO).exists():
        assert kilobytes <= 8 and "out/run.json cannot be written" in done.stderr
        assert done.stdout.startswith("failed: nothing simulated, ")
        return
    rows = kept(place / "out", done)
    assert rows > 0 or kilobytes <= 64
    assert rows > 60_000 or kilobytes < 2048


def test_a_cache_on_a_full_disk(fly, disk):
    place = disk(16)
    (place / "ballast").write_bytes(bytes(16 * 1024))
    done = fly(ADCS_BUILD=str(place), TMPDIR=str(place))
    assert done.returncode in (1, 2)
    assert "No space left on device" in done.stderr


def test_a_temporary_folder_on_a_full_disk(fly, disk):
    """A flight of FMUs that are built needs none."""
    place = disk(16)
    (place / "ballast").write_bytes(bytes(16 * 1024))
    assert fly(None, "--stop", "0.1", TMPDIR=str(place)).returncode == 0


class Remover(Clock):
    """In its third step somebody removes the folder of the result."""

    def __init__(self, folder):
        super().__init__("c")
        self.folder = folder

    def advance(self, t, h, v, slopes):
        super().advance(t, h, v, slopes)
        if 0.25 < t < 0.35:
            shutil.rmtree(self.folder)


class TestFolder:
    @pytest.fixture(autouse=True)
    def here(self, tmp_path, monkeypatch):
        monkeypatch.chdir(tmp_path)
        return tmp_path

    @pytest.mark.skipif(os.name != "posix", reason="an open file cannot be removed")
    def test_that_is_removed_while_a_run_goes_on_is_put_back_and_told(self, monkeypatch):
        monkeypatch.setattr(recorder, "FLUSH", 0.0)
        with pytest.raises(
            ResultUnwritable, match=r"out/result.arrows cannot be written: it was removed while"
        ) as found:
            run([Remover("out")], [], out="out")
        result = Result.read("out")
        assert (result.info["status"], result.info["error"]) == ("failed", "ResultUnwritable")
        assert result.time.tolist() == found.value.result.time.tolist()
        assert len(result) >= 4

    def test_that_was_removed_at_the_end_keeps_all_rows(self, monkeypatch):
        monkeypatch.setattr(recorder, "FLUSH", 1e9)
        with pytest.raises(ResultUnwritable, match="it was removed while the run went on"):
            run([Remover("out")], [], out="out")
        assert len(Result.read("out")) == 11

    @pytest.mark.parametrize("name", [INFO, STREAM, "result.parquet", "result.csv", ".run.json", ".result.parquet"])
    def test_a_folder_in_place_of_a_file(self, name):
        (Path("out") / name).mkdir(parents=True)
        with pytest.raises(ResultUnwritable) as caught:
            run([Clock("c")], [], out="out", overwrite=True)
        assert str(caught.value).startswith(f"out/{name} cannot be written: it is a folder. Choose another folder")
        assert [p.name for p in Path("out").iterdir()] == [name]

    def test_a_folder_in_place_of_the_lock(self):
        Path("out/.run.lock").mkdir(parents=True)
        with pytest.raises(ResultUnwritable, match=r"out/.run.lock cannot be written: Is a directory"):
            run([Clock("c")], [], out="out")

    @pytest.mark.parametrize(
        ("name", "problem"),
        [
            ("ü" * 150, "a name of 300 bytes is in it, 255 are allowed"),
            ("/".join(["x" * 200] * 30), "File name too long"),
            ("a\0b", "there is a NUL in its name"),
            ("\ud800", "surrogates not allowed"),
        ],
        ids=["a long name", "a long path", "NUL", "no Unicode"],
    )
    def test_a_name_that_no_folder_can_have(self, name, problem):
        with pytest.raises(ResultUnwritable, match=problem):
            run([Clock("c")], [], out=name)
        assert not os.path.exists(name) and os.listdir() == []

    def test_reading_such_a_name(self, adcs):
        for name in ("ü" * 150, "x" * 300):
            with pytest.raises(ResultUnreadable):
                Result.read(name)
            assert adcs("plot", name).status == 2
            assert adcs("show", name).status == 2

    @pytest.mark.skipif(os.name != "posix", reason="the working folder cannot be removed")
    def test_a_working_folder_that_was_removed(self, tmp_path):
        gone = tmp_path / "gone"
        gone.mkdir()
        os.chdir(gone)
        gone.rmdir()
        with pytest.raises(ResultUnwritable, match="out cannot be written: the working folder has been deleted"):
            run([Clock("c")], [], out="out")
        assert len(run([Clock("c")], [], out=tmp_path / "elsewhere")) == 11
        assert errors.near(tmp_path) == tmp_path


@pytest.mark.skipif(os.name != "posix", reason="the working folder cannot be removed")
def test_the_command_line_in_a_folder_that_is_gone(fly, tmp_path):
    gone = tmp_path / "gone"
    there = f"mkdir {gone} && cd {gone} && rmdir {gone}"
    command = f"{there} && exec {sys.executable} -m cosim run {tmp_path}/counter.py --stop 0.1"
    for out, status, text in (("out", 2, "the working folder has been deleted"), (f"{tmp_path}/out", 0, "")):
        done = subprocess.run(
            ["sh", "-c", f"{command} --out {out}"],
            env=os.environ | {"PYTHONPATH": str(ROOT)}, capture_output=True, text=True, check=False,
        )  # fmt: skip
        assert (done.returncode, text in done.stderr, "Traceback" in done.stderr) == (status, True, False), done.stderr


class TestEnd:
    """The end of run.json where there is no room for it."""

    INFO = {"system": "s", "rows": 0}

    @pytest.fixture
    def full(self, monkeypatch, tmp_path):
        def refuse(path, text):
            raise ResultUnwritable(path, "No space left on device")

        tale = story.Story(tmp_path, self.INFO)
        monkeypatch.setattr("cosim.results.folder.write_text", refuse)
        return tale

    def test_stands_in_its_blanks(self, full, tmp_path):
        size = (tmp_path / INFO).stat().st_size
        info = self.INFO | {
            "status": "failed",
            "error": "StepFailed",
            "why": '宇"\n' * 500,
            "rows": 7,
            "reached_time": 2.5,
        }
        assert isinstance(full.end(info | {"metrics": {"m": [1.0] * 10_000}}), ResultUnwritable)
        told = json.loads((tmp_path / INFO).read_text(encoding="utf-8"))
        assert told == info | {"why": ('宇"\n' * 500)[: story.LONGEST_WHY]}
        assert (tmp_path / INFO).stat().st_size == size

    def test_of_a_run_that_finished_says_what_was_not_written(self, full, tmp_path):
        full.end(self.INFO | {"status": "finished", "rows": 9})
        told = json.loads((tmp_path / INFO).read_text())
        assert (told["status"], told["error"], told["rows"]) == ("failed", "ResultUnwritable", 9)
        assert "No space left on device" in told["why"]

    def test_the_longest_cause_fits(self, full, tmp_path):
        for sign in ("\x01", "\U0001f6f0", '"'):
            full.end(
                self.INFO | {"status": "failed", "error": "E" * 40, "why": sign * 9999, "reached_time": -1e-300 / 3}
            )
            assert json.loads((tmp_path / INFO).read_text(encoding="utf-8"))["why"] == sign * story.LONGEST_WHY


def test_the_first_cause_is_told(adcs, folder, monkeypatch):
    """A failure of the flight is not hidden by a disk that is full after it."""
    from . import own_files

    (folder / "runaway.py").write_text(own_files.RUNAWAY)
    (folder / "alone.py").write_text(own_files.ALONE.format(unit="runaway.py:Runaway", stop=2, kernel="auto"))

    def refuse(*_, **__):
        raise OSError(28, os.strerror(28))

    monkeypatch.setattr(formats.pq, "ParquetWriter", refuse)
    monkeypatch.setattr("matplotlib.figure.Figure.savefig", refuse)
    done = adcs("run", "alone.py", "--out", "out", "--plot")
    assert done.status == 1
    assert "StepFailed: unit returned fmi2Error" in done.err and "ResultUnwritable" not in done.err
    assert Result.read("out").info["error"] == "StepFailed"


def test_a_figure_that_cannot_be_written_is_told_after_the_run(adcs, folder, monkeypatch):
    def half(self, file, **_):
        Path(file).write_text("half")
        raise OSError(28, os.strerror(28))

    monkeypatch.setattr("matplotlib.figure.Figure.savefig", half)
    done = adcs("run", "zhang2018-ppatc", "--stop", "0.05", "--out", "out", "--plot")
    assert done.status == 1
    assert done.out.startswith("finished: 0.05 s simulated")
    assert "ResultUnwritable: out/" in done.err and ".png cannot be written: No space left on device." in done.err
    assert sorted(p.name for p in Path("out").iterdir()) == ["result.parquet", INFO]
    drawn = adcs("plot", "out")
    assert (drawn.status, ".png cannot be written: No space left" in drawn.err) == (2, True)
