"""Processes with checkpoints that are killed, interrupted, or out of room, and go on to the same bits; their memory."""

import json
import os
import random
import resource
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from cosim import flights
from cosim.results.checkpoint import Checkpoint
from cosim.results.names import CHECKPOINT, INFO
from cosim.results.result import Result

from .. import both
from ..c_fmu import build, real
from ..typed_fmu import NAMES, typed

ROOT = Path(__file__).parents[3]
pytestmark = pytest.mark.skipif(os.name != "posix", reason="signals are sent to a process")

PROGRAM = """
import sys
from cosim import flights, resuming
from tests.cosim.resuming.test_processes import system, setup

if sys.argv[1] == "begin":
    flights.simulate(system({fmu!r}), setup({loop!r}, {stop}), out="out", checkpoint={every})
else:
    resuming.resume("out", stop_time=float(sys.argv[1]))
"""
STEP = 1e-4
LONG = 1e6
"""Seconds of flight that take for ever: such a run is ended from outside, and goes on with an earlier stop time."""


def system(fmu):
    """A loop of every type at two rates, whose texts stay few."""
    links = [(f"a.{out}", f"b.{out}_in", "after_step") for out in NAMES if out != "s"]
    back = [(f"b.{state}", f"a.{direct}_in", "at_point") for direct, state in NAMES.items() if direct != "s"]
    held = {"a.s_in": "x", "b.s_in": "y"}
    return both.of(dict.fromkeys("ab", fmu), links + back, held=held, steps={"b": 2})


def setup(loop, stop):
    return both.experiment(stop=stop, step=STEP, loop=loop, every=7, record=["a.r", "b.x", "b.count", "b.odd"])


@pytest.fixture(scope="module")
def fmu(tmp_path_factory):
    return typed(tmp_path_factory.mktemp("typed"))


class Runs:
    """A run in a folder, by processes of their own: begun, or gone on with to another stop time."""

    def __init__(self, folder: Path, fmu: Path, loop: str, stop: float = LONG, steps: int = 1000):
        self.folder, self.out, self.fmu, self.loop = folder, folder / "out", fmu, loop
        self._program = PROGRAM.format(fmu=str(fmu), loop=loop, stop=stop, every=steps * STEP)

    def start(self, what: str | float) -> subprocess.Popen:
        return subprocess.Popen(
            [sys.executable, "-c", self._program, str(what)],
            cwd=self.folder, env=os.environ | {"PYTHONPATH": str(ROOT)}, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
            text=True,
        )  # fmt: skip

    def time(self) -> float:
        """Of the checkpoint that there is, s; before the first -1."""
        return Checkpoint.read(self.out).time if (self.out / CHECKPOINT).exists() else -1.0

    def later(self, process: subprocess.Popen, than: float) -> None:
        """Wait until the run has a later checkpoint."""
        deadline = time.monotonic() + 90
        while self.time() <= than and time.monotonic() < deadline:
            assert process.poll() is None, process.communicate()
            time.sleep(0.002)
        assert self.time() > than, "no checkpoint"

    def finish(self) -> None:
        """Go on to a stop time beyond the checkpoint; the rows are those of a flight to it that nobody interrupts."""
        stop = round(self.time() + 1500 * STEP, 3)
        process = self.start(stop)
        _, said = process.communicate(timeout=120)
        assert process.returncode == 0, said
        result = Result.read(self.out)
        both.assert_same(flights.simulate(system(self.fmu), setup(self.loop, stop)), result)
        assert result.info["status"] == "finished"
        assert sorted(p.name for p in self.out.iterdir()) == [CHECKPOINT, "result.parquet", INFO]


@pytest.mark.parametrize("loop", ["always", pytest.param("never", marks=pytest.mark.slow)])
def test_killed_in_the_middle(tmp_path, fmu, loop):
    """Once while it flies, once while it goes on."""
    runs = Runs(tmp_path, fmu, loop)
    for what in ("begin", LONG):
        process = runs.start(what)
        runs.later(process, max(0.0, runs.time()))
        process.kill()
        process.communicate()
    assert json.loads((runs.out / INFO).read_text())["status"] == "running"  # nobody was left to say more
    runs.finish()


@pytest.mark.slow
@pytest.mark.parametrize("loop", both.LOOPS)
def test_killed_at_many_moments(tmp_path, fmu, loop):
    """Also while files are written: a checkpoint every few steps, killed after any time."""
    chance = random.Random(13)
    runs = Runs(tmp_path, fmu, loop, steps=7)
    process = runs.start("begin")
    runs.later(process, 0.0)
    for _ in range(20):
        time.sleep(chance.uniform(0.0, 1.0))
        process.kill()
        _, said = process.communicate()
        assert process.returncode == -9, said
        process = runs.start(LONG)
        time.sleep(chance.uniform(0.0, 2.0))
    process.kill()
    process.communicate()
    runs.finish()


@pytest.mark.parametrize(("loop", "number"), [("always", signal.SIGINT), ("never", signal.SIGTERM)])
def test_ctrl_c_leaves_a_checkpoint_at_the_last_point(tmp_path, fmu, loop, number):
    """That point is where the run came to, as a rule between two rows; its row is one of the interrupted run alone."""
    runs = Runs(tmp_path, fmu, loop)
    process = runs.start("begin")
    runs.later(process, 0.0)
    process.send_signal(number)
    _, said = process.communicate(timeout=60)
    assert process.returncode == (0 if number == signal.SIGINT else 128 + number), said
    left = Result.read(runs.out)
    assert left.info["status"] == "interrupted"
    assert left.time[-1] == runs.time()
    runs.finish()


def test_a_disk_that_is_full_at_a_checkpoint(disk, fmu):
    """Rows or the checkpoint do not fit: either way the older one is whole, and with room again the run goes on."""
    place = disk(512)
    runs = Runs(place, fmu, "always")
    process = runs.start("begin")
    _, said = process.communicate(timeout=120)
    assert process.returncode == 1 and "No space left on device" in said, said
    assert runs.time() > 0
    assert not (runs.out / f".{CHECKPOINT}").exists()
    subprocess.run(["mount", "-o", "remount,size=20m", str(place)], check=True)
    runs.finish()


def test_memory_is_flat(tmp_path):
    """What a checkpoint takes is given back: states of FMUs, more than 12 kB of them in each, points, files.

    1000 more of them, and 10000 more steps, leave less than a tenth of what their states alone take.
    """
    path = build(tmp_path, "Counter", [real("y")], outputs="y = (double)m->whole[0];", step="m->whole[0]++;")
    two = both.of({"a": path, "b": path}, [])

    def grown(steps):
        begun, folder = _resident(), tmp_path / f"{steps}"
        flight = both.experiment(stop=steps * STEP, step=STEP, every=100)
        flights.simulate(two, flight, out=folder, checkpoint=10 * STEP)
        assert sum(map(len, Checkpoint.read(folder).point.states.values())) > 12_000
        return _resident() - begun

    grown(100)
    assert grown(10_000) < 1000 * 12_000 / 10


def _resident() -> int:
    """Bytes of memory that the process has."""
    if sys.platform == "linux":
        return int(Path("/proc/self/statm").read_text().split()[1]) * resource.getpagesize()
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss  # of others only that it does not grow
