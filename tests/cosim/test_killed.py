"""Runs that are killed at any moment: rows are readable, run.json is true, the next run leaves nothing behind."""

import json
import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from cosim.errors import ResultExists, ResultUnreadable
from cosim.results import process, story
from cosim.results.claim import LOCK
from cosim.results.names import FILES, INFO
from cosim.results.result import Result

from . import both
from .c_fmu import build, real
from .fakes import Clock
from .flights import run

ROOT = Path(__file__).parents[2]
pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="processes are told apart by /proc")

PROGRAM = """
from cosim import Experiment, System
from cosim.masters.explicit import Explicit

def counter():
    return System(name="counter", components={{"a": {fmu!r}}}), Experiment(
        stop_time=1e9, communication_step_size=1e-3, master=Explicit(kernel={loop!r})
    )
"""


@pytest.fixture(scope="module")
def counter(tmp_path_factory):
    """y counts steps."""
    code = "y = (double)m->whole[0];"
    return build(tmp_path_factory.mktemp("counter"), "Counter", [real("y")], outputs=code, step="m->whole[0]++;")


class Machine:
    """A folder with a temporary folder and a cache of its own, in which `adcs run counter.py` flies for ever."""

    def __init__(self, folder: Path, fmu: Path):
        self.folder, self.temporary, self.cache = folder, folder / "tmp", folder / "cache"
        self.temporary.mkdir()
        for loop in both.LOOPS:
            (folder / f"{loop}.py").write_text(PROGRAM.format(fmu=str(fmu), loop=loop))
        self.environment = os.environ | {
            "PYTHONPATH": str(ROOT), "TMPDIR": str(self.temporary), "ADCS_BUILD": str(self.cache),
        }  # fmt: skip
        self.fly("first", stop=0.1)

    def command(self, loop: str, out: str, *more: str) -> list[str]:
        return [sys.executable, "-m", "cosim", "run", f"{loop}.py", "--out", out, *more]

    def fly(self, out: str, stop: float) -> str:
        done = subprocess.run(
            self.command("always", out, "--stop", str(stop), "--force"),
            cwd=self.folder, env=self.environment, capture_output=True, text=True, timeout=60, check=False,
        )  # fmt: skip
        assert done.returncode == 0, done.stderr
        return done.stderr

    def kill(self, number: int, loop: str, out: str, after: float) -> int:
        """Send a signal `after` s; return the exit status."""
        process = subprocess.Popen(
            self.command(loop, out), cwd=self.folder, env=self.environment,
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip
        time.sleep(after)
        process.send_signal(number)
        return process.wait(timeout=60)


def check(folder: Path, status: int) -> str:
    """What is left of a run is readable and true; return how run.json says that it ended, "" without."""
    if not (folder / INFO).exists():
        return ""
    info = story.settle(folder)
    assert json.loads((folder / INFO).read_text())["status"] == info["status"]
    assert info["status"] == ("interrupted" if status in (143, 1) else "died"), status
    assert not (folder / LOCK).exists()
    try:
        result = Result.read(folder)
    except ResultUnreadable as error:
        # killed between run.json and the first row
        assert any(said in str(error) for said in ("no result in it", "it was cut before its first row"))
        return info["status"]
    assert np.array_equal(result["a.y"], np.arange(len(result)))
    np.testing.assert_allclose(result.time, 1e-3 * np.arange(len(result)), atol=1e-9)
    return info["status"]


def beset(machine: Machine, kills: int, terms: int, seed: int) -> list[str]:
    chance = random.Random(seed)
    ends = []
    for place in range(kills + terms):
        number = signal.SIGKILL if place < kills else signal.SIGTERM
        out = f"out{place}"
        status = machine.kill(number, chance.choice(both.LOOPS), out, chance.uniform(0.0, 4.0))
        assert status in ((-9,) if number == signal.SIGKILL else (143, -15, 1)), status
        ends.append(check(machine.folder / out, status))
    last = f"out{kills + terms - 1}"
    machine.fly(last, stop=0.1)
    assert list(machine.temporary.iterdir()) == []
    assert list((machine.cache / "extracted").glob("*-*")) == []
    assert sorted(p.name for p in (machine.folder / last).iterdir()) == ["result.parquet", INFO]
    return ends


def test_a_few_moments(tmp_path, counter):
    ends = beset(Machine(tmp_path, counter), kills=2, terms=1, seed=3)
    assert len(ends) == 3


@pytest.mark.slow
def test_many_moments(tmp_path, counter):
    ends = beset(Machine(tmp_path, counter), kills=20, terms=10, seed=20)
    assert ends.count("died") >= 5 and ends.count("interrupted") >= 3


class TestTold:
    """A run of this process whose run.json is given to another one."""

    @pytest.fixture
    def left(self, tmp_path):
        """A folder as a killed process leaves it, after `write(**changes)`."""
        folder = tmp_path / "out"
        run([Clock("c")], [], out=folder)
        info = json.loads((folder / INFO).read_text())

        def write(**changes):
            (folder / INFO).write_text(json.dumps(info | {"status": "running"} | changes))
            return folder

        return write

    def test_a_living_process_is_running(self, left):
        assert Result.read(left()).info["status"] == "running"

    @pytest.mark.parametrize("change", [{"process": 2**22 + 1}, {"process_start": "another boot 1"}])
    def test_a_dead_one_is_not(self, left, change):
        folder = left(**change)
        info = Result.read(folder).info
        assert info["status"] == "died"
        assert info["why"].startswith("its process ended without a word (process ")
        assert json.loads((folder / INFO).read_text())["status"] == "running"  # whoever reads writes nothing

    def test_a_dead_child_that_nobody_has_asked_after(self, left):
        child = os.fork()
        if child == 0:
            os._exit(0)
        try:
            deadline = time.monotonic() + 10
            while process._start(child) is not None and time.monotonic() < deadline:
                time.sleep(0.01)
            assert Result.read(left(process=child)).info["status"] == "died"
        finally:
            os.waitpid(child, 0)

    @pytest.mark.parametrize("change", [{"host": "elsewhere"}, {"process_start": None}, {"process": "?"}])
    def test_nobody_knows_of_another_machine(self, left, change):
        assert Result.read(left(**({"process": 2**22 + 1} | change))).info["status"] == "running"

    def test_the_next_run_says_so_and_replaces_it_where_it_is_told_to(self, left, tmp_path, monkeypatch, caplog):
        monkeypatch.chdir(tmp_path)
        folder = left(process=2**22 + 1)
        (folder / ".result.parquet").write_text("half")
        (folder / ".run.json").write_text("half")
        with pytest.raises(ResultExists) as caught:
            run([Clock("c")], [], out=folder)
        assert str(caught.value).startswith(
            "out already holds what is left of a run that died: its process ended without a word (process 4194305 on "
        )
        assert str(caught.value).endswith(
            "a kill -9, memory that was out, a power cut. Write elsewhere (out=..., --out DIR), or replace it "
            "(overwrite=True, --force)."
        )
        assert json.loads((folder / INFO).read_text())["status"] == "died"
        run([Clock("c")], [], out=folder, overwrite=True)
        assert "out is replaced: it held what is left of a run that died: its process" in caplog.text
        assert sorted(p.name for p in folder.iterdir()) == ["result.parquet", INFO]

    def test_a_result_that_is_damaged_is_refused_as_one(self, left):
        folder = left()
        for text, problem in (("{", "it is no JSON: "), ("[1]", "it is no JSON of a run: list, needed is an object")):
            (folder / INFO).write_text(text)
            with pytest.raises(ResultUnreadable, match=problem):
                Result.read(folder)
            with pytest.raises(ResultExists, match="already holds a result"):
                run([Clock("c")], [], out=folder)


class TestShow:
    """`adcs show` of a result folder."""

    @pytest.fixture
    def folder(self, tmp_path, monkeypatch):
        monkeypatch.chdir(tmp_path)
        return tmp_path

    def test_a_finished_run(self, adcs, folder):
        result = run([Clock("c")], [], out="out")
        text = adcs("show", "out").out
        assert text.startswith(
            f"{result.info['system']}: finished\n"
            "asked for: 0 to 1 s in steps of 0.1 s, master Explicit, loop python\n"
            f"11 rows, the last at 1 s, in out/result.parquet\nflown by process {os.getpid()} on "
        )
        assert "c         " in text and "{fake}" in text

    def test_one_that_died(self, adcs, folder):
        run([Clock("c")], [], out="out")
        info = json.loads(Path("out", INFO).read_text()) | {"status": "running", "process": 2**22 + 1, "rows": 13}
        Path("out", INFO).write_text(json.dumps(info))
        text = adcs("show", "out").out
        assert ": died\nits process ended without a word (process 4194305 on " in text
        assert "11 rows, the last at 1 s, in out/result.parquet; 2 more were recorded\n" in text
        assert json.loads(Path("out", INFO).read_text())["status"] == "died"

    def test_messages_and_events(self, adcs, folder):
        run([Clock("c")], [], out="out")
        info = json.loads(Path("out", INFO).read_text())
        happened = {"time": 1.0, "variable": "c.y", "meaning": "it is full"}
        Path("out", INFO).write_text(json.dumps(info | {"messages": {"c": {"half full": 3}}, "event": happened}))
        text = adcs("show", "out").out
        assert "\nended by c.y at 1 s: it is full\n" in text and text.endswith("c says: half full (3 times)\n")

    def test_what_there_is_of_a_result(self, adcs, folder):
        run([Clock("c")], [], out="out")
        Path("out", INFO).unlink()
        assert adcs("show", "out").out == (
            "there is no run.json: how the run ended is not known\n11 rows, the last at 1 s, in out/result.parquet\n"
        )
        Path("out", "result.parquet").write_text("cut")
        assert "no rows: out/result.parquet: it cannot be read: " in adcs("show", "out").out

    def test_a_folder_named_as_a_system(self, adcs, folder):
        run([Clock("c")], [], out="li2014-nominal")
        assert "direct feedthrough" not in adcs("show", "./li2014-nominal").out


def test_all_files_of_a_result_have_a_part():
    from cosim.results.names import PARTS

    assert [part.removeprefix(".") for part in PARTS] == list(FILES)
