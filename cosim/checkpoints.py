"""The checkpoints of a flight: when they are due, what they have, and the one that the flight goes on from."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from fractions import Fraction
from pathlib import Path
from typing import Any

from cosim.errors import CallFailed, NotSupported, ResultUnreadable, TimeError
from cosim.masters.master import Course
from cosim.masters.point import Part, Point
from cosim.masters.watch import Watch
from cosim.results import again, continued, story
from cosim.results.checkpoint import Checkpoint, CheckpointRefused
from cosim.results.names import CHECKPOINT, STREAM
from cosim.results.recorder import Recorder
from cosim.results.schema import schema
from cosim.slaves.slave import Slave
from cosim.system import Experiment, System
from cosim.time import Seconds, exact_seconds, written
from fmus.description.description import ModelDescription

ANEW = "Fly anew, into another folder or with --force (overwrite=True)."


class Keeping:
    """What a flight without checkpoints keeps: nothing."""

    kept: int | None = None
    """How many rows of an earlier flight stay, None: this is a new one."""

    def told(self) -> Mapping[str, Any]:
        """Return what run.json says of it."""
        return {}

    def point(self, point: Point, slaves: Mapping[str, Slave], course: Course) -> Point:
        """Return the point at which the flight begins: the first one, at which the instances stand."""
        return point

    def claim(self, folder: Path | None, *, overwrite: bool) -> None:
        """Make the folder ready, which is this flight's alone; raises `ResultExists`, `ResultUnwritable`."""
        if folder is not None:
            if not overwrite:
                story.refuse_existing(folder)  # of a run that ended while this one began
            story.replace(folder)

    def begin(self, recorder: Recorder, watch: Watch, slaves: Mapping[str, Slave], parts: Mapping[str, Part]) -> None:
        """Take part in the flight."""

    def look(self, point: Point) -> None:
        """Look at the point that is reached, at which the instances stand."""

    def end(self, point: Point) -> None:
        """Look at the last point, at which the instances stand."""


@dataclass
class Checkpoints(Keeping):
    """Checkpoints in a folder, every so many seconds, of a `flight` (again.py); `before`: where it goes on from.

    One is due at the start, at the first communication point at or after each multiple of `every`, and at the end,
    be that the stop time, an event or Ctrl-C.
    """

    folder: Path
    every: Fraction
    flight: Mapping[str, Any]
    before: Checkpoint | None = None
    kept: int | None = None
    _last: Checkpoint | None = field(default=None, init=False)

    @classmethod
    def of(
        cls,
        every: Seconds,
        folder: Path | None,
        flight: tuple[System, Experiment, Mapping[str, Path], Mapping[str, ModelDescription], str],
        before: Checkpoint | None = None,
    ) -> "Checkpoints":
        """Return those of a flight, as `again.record` takes it.

        Raises `TimeError`, and `NotSupported` without a folder, and for FMUs whose states cannot be saved.
        """
        exact = exact_seconds(every, "checkpoint")
        if exact <= 0:
            raise TimeError("checkpoint", f"{float(exact):g} s", "the time between two checkpoints must be positive")
        if folder is None:
            raise NotSupported("checkpoints of a result that is not written", "Give it a folder: out=..., --out DIR.")
        _refuse(flight[3])
        return cls(folder, exact, again.record(*flight), before)

    def told(self) -> Mapping[str, Any]:
        """Return how often, what it takes to go on, and where it went on from."""
        info: dict[str, Any] = {"checkpoint": f"every {written(self.every)}", "flight": self.flight}
        return info if self.before is None else {**info, "resumed_at": self.before.time}

    def point(self, point: Point, slaves: Mapping[str, Slave], course: Course) -> Point:
        """Return the point of the checkpoint, and put the instances into their states at it; see `Keeping`."""
        if self.before is None:
            return point
        saved, path = self.before.point, self.folder / CHECKPOINT
        if saved.values.shape != point.values.shape or set(saved.states) != set(slaves):
            raise CheckpointRefused(path, "it has values of other variables than this flight", ANEW)
        try:
            saved.restore(slaves)
        except CallFailed as error:
            raise CheckpointRefused(path, f"an FMU does not take back its state: {error}", ANEW) from error
        # its own row is written anew: it may be there for the flight ended there, or something may happen there now
        self.kept = self.before.rows - int(self.before.last_row == saved.index)
        self._schema = schema(course.layout.columns)
        return saved

    def claim(self, folder: Path | None, *, overwrite: bool) -> None:
        """Cut the rows in the folder to those of the checkpoint; see `Keeping`. Raises `CheckpointRefused`."""
        if self.before is None or self.kept is None:
            super().claim(folder, overwrite=overwrite)
            return
        if Checkpoint.read(self.folder).written != self.before.written:
            raise CheckpointRefused(
                self.folder / CHECKPOINT, "another process has gone on from it meanwhile", "Begin again."
            )
        try:
            continued.as_stream(self.folder, self._schema)
            continued.reopened(self.folder / STREAM, self._schema, self.kept).close()
        except ResultUnreadable as error:
            raise CheckpointRefused(error.path, error.problem, ANEW) from error

    def begin(self, recorder: Recorder, watch: Watch, slaves: Mapping[str, Slave], parts: Mapping[str, Part]) -> None:
        """Let the parts of the run remember what those of the checkpoint did; see `Keeping`."""
        self._recorder, self._watch, self._slaves, self._parts = recorder, watch, slaves, parts
        watch.pause = 0
        if self.before is not None:
            saved = self.before.point
            saved.recall(parts)
            watch.last_row = -1
            self._last = self.before
            watch.pause = self._next(saved.index)

    def look(self, point: Point) -> None:
        """Save the point where that is due; raises `CheckpointUnwritable`, `ResultUnwritable`, `NotSupported`."""
        if point.index >= self._watch.pause:
            self._save(point)
            self._watch.pause = self._next(point.index)

    def end(self, point: Point) -> None:
        """Save the last point, if it is not yet; see `look`."""
        if self._last is None or self._last.point.index != point.index:
            self._save(point)

    def _next(self, index: int) -> int:
        """Return the communication point at which the one after point `index` is due."""
        schedule = self._watch.schedule
        start = Fraction(schedule.start, schedule.denominator)
        since = Fraction(schedule.count(index), schedule.denominator) - start
        return schedule.reached(start + (since // self.every + 1) * self.every)

    def _save(self, point: Point) -> None:
        try:
            saved = point.with_states(self._slaves).with_parts(self._parts)
        except CallFailed as error:
            problem = f"{error.component} says that its state can be saved (canSerializeFMUstate), but {error}"
            raise NotSupported(problem, "Fly without checkpoints, or with another FMU in its place.") from error
        self._recorder.settle()
        made = Checkpoint(
            time=self._watch.schedule.time(point.index),
            rows=self._recorder.rows,
            last_row=self._watch.last_row,
            every=str(self.every),
            flight=again.short(self.flight),
            written=f"{datetime.now(UTC):%Y-%m-%dT%H:%M:%S.%fZ}",
            point=saved,
        )
        made.write(self.folder, self._last.time if self._last is not None else None)
        self._last = replace(made, point=replace(saved, states={}))


def _refuse(descriptions: Mapping[str, ModelDescription]) -> None:
    """Raise `NotSupported` for FMUs whose states cannot be saved, all of them."""
    missing = {
        name: [
            *(() if description.can_get_and_set_state else ("canGetAndSetFMUstate=false",)),
            *(() if description.can_serialize_state else ("canSerializeFMUstate=false",)),
        ]
        for name, description in descriptions.items()
    }
    named = [f"{name} ({', '.join(lacks)})" for name, lacks in missing.items() if lacks]
    if named:
        raise NotSupported(
            f"a checkpoint has the states of all FMUs, and of these they cannot be saved: {', '.join(named)}",
            "Fly without checkpoints, or with other FMUs in their place, as adcs builds them: --use INSTANCE=FMU.",
        )
