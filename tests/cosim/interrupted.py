"""Runs that are interrupted at each of their checkpoints, as a folder shows them that is copied while they go on."""

import shutil
from pathlib import Path

from cosim import flights, resuming
from cosim.results.names import CHECKPOINT

from . import both


class Camera:
    """A progress that copies the folder of a run each time that it has a new checkpoint: what a kill -9 leaves."""

    def __init__(self, folder: Path):
        self.folder, self.shots = folder, []
        self._seen = None

    def __call__(self, t: float, stop: float) -> None:
        path = self.folder / CHECKPOINT
        seen = path.stat().st_ino, path.stat().st_mtime_ns
        if seen != self._seen:
            self._seen = seen
            shot = self.folder.with_name(f"{self.folder.name}-{len(self.shots)}")
            shutil.copytree(self.folder, shot, ignore=shutil.ignore_patterns(".run.lock"))
            self.shots.append(shot)


def taken(system, setup, folder: Path, every, locate=None, **more):
    """A straight flight, one with checkpoints, and the folders that were seen at these."""
    straight = flights.simulate(system, setup, locate=locate, out=folder / "straight", **more)
    camera = Camera(folder / "run")
    saved = flights.simulate(system, setup, locate=locate, out=camera.folder, progress=camera, checkpoint=every, **more)
    both.assert_same(straight, saved)
    return straight, camera.shots


def go_on(rows_of: Path, checkpoint_of: Path, folder: Path, **more):
    """Go on in a copy of a folder from the checkpoint that another one has."""
    shutil.copytree(rows_of, folder)
    shutil.copy(checkpoint_of / CHECKPOINT, folder)
    return resuming.resume(folder, **more)


def assert_goes_on(system, setup, folder: Path, every, locate=None, **more):
    """From each checkpoint, of killed runs with more rows than it has and of the finished one, to the same bits."""
    straight, shots = taken(system, setup, folder, every, locate, **more)
    assert len(shots) >= 4
    places = [folder / "run" if i == len(shots) - 2 else shots[i + 1] for i in range(len(shots) - 1)]
    for i, rows_of in [*enumerate(places)][1 :: max(1, len(places) - 2)]:  # one that was killed, and the finished one
        again = go_on(rows_of, shots[i], folder / f"again-{i}", locate=locate)
        both.assert_same(straight, again)
        for what in ("loop", "status", "messages", "fmi2Warning", "reached_time", "rows"):
            assert again.info[what] == straight.info[what], what
    return straight
