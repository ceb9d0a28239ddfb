"""A run that goes on from its checkpoint: what it is stands in its folder, and nothing but its stop may change."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any

from cosim.checkpoints import ANEW
from cosim.errors import NotSupported, SignalError, UnknownName
from cosim.flight import Progress
from cosim.flights import Locate, Prepared, find, prepare
from cosim.results import again, other_stop, story
from cosim.results.checkpoint import Checkpoint, CheckpointRefused
from cosim.results.folder import place
from cosim.results.names import CHECKPOINT, INFO
from cosim.results.result import Judge, Result
from cosim.slaves.slave import Slave
from cosim.system import Experiment, System
from cosim.system.reference import Reference
from cosim.system.swap import SwapReport
from cosim.time import Schedule, Seconds, exact_seconds, written


class Left:
    """What a run has left in a folder to go on from: its `checkpoint`, and `flight`, `system`, `experiment`.

    Raises `CheckpointRefused` where there is none, or one that is damaged, or run.json does not say what flew.
    """

    def __init__(self, folder: Path | str) -> None:
        self.folder = place(folder) or Path()
        if not self.folder.is_dir():
            raise CheckpointRefused(self.folder, "there is no such folder", "Give that of a result.")
        self.checkpoint = Checkpoint.read(self.folder)
        self.info = story.read_info(self.folder)
        if "flight" not in self.info:
            raise CheckpointRefused(self.folder / INFO, "it does not say what flew with this checkpoint", ANEW)
        self.flight: Mapping[str, Any] = self.info["flight"]
        try:
            self.system: System = again.system_of(self.flight)
            self.experiment: Experiment = again.experiment_of(self.flight)
            self.format = str(self.flight["format"])
            fmus: Mapping[str, Any] = self.flight["fmus"]
            self._paths = {name: entry["path"] for name, entry in fmus.items()}
        except (KeyError, TypeError, ValueError, AttributeError, SignalError) as error:
            if isinstance(error, SignalError):
                raise
            raise CheckpointRefused(self.folder / INFO, f"what flew cannot be read: {error!r}", ANEW) from error

    def located(self, locate: Locate | None) -> Locate:
        """Return where FMUs are: where they were, else where `locate` finds or builds them."""
        there = {reference: self._paths.get(name) for name, reference in self.system.components.items()}

        def call(reference: Reference) -> Path:
            path = there.get(reference)
            return Path(path) if path and Path(path).is_file() else find(reference, locate)

        return call

    def refuse_other(self, paths: Mapping[str, Path], prepared: Prepared) -> None:
        """Raise `CheckpointRefused` where what would fly on is not what the checkpoint is of."""
        now = again.record(self.system, self.experiment, paths, prepared.wiring.fmus, self.format)
        found = again.difference(self.checkpoint.flight, again.short(now))
        if found is None:
            return
        where, was, is_now = found
        ways = {
            "made_by": "Go on with what wrote it.",
            "fmus": "Put the FMU back that it began with.",
        }
        way = ways.get(where.partition(".")[0], f"Let {INFO} say what it said.")
        problem = f"it is of another flight: {where} was {was}, and is {is_now} now"
        raise CheckpointRefused(self.folder / CHECKPOINT, problem, f"{way} Or: {ANEW}")

    def until(self, stop: Seconds | None, prepared: Prepared) -> Experiment:
        """Return the experiment with another stop time, s.

        Raises `CheckpointRefused` where the checkpoint is at the stop, or would not be what it is with that one.
        """
        reached, old = self.checkpoint.time, exact_seconds(self.experiment.stop_time, "stop_time")
        new = old if stop is None else exact_seconds(stop, "stop_time")
        path, point = self.folder / CHECKPOINT, self.checkpoint.point
        if new <= reached:
            why = "" if stop is None else f", which is not before the stop time {written(new)}"
            advice = "Fly further: --stop TIME (stop_time=...)."
            raise CheckpointRefused(path, f"the run has come to {reached:.12g} s{why}", advice)
        if new == old:
            return self.experiment
        longer = replace(self.experiment, stop_time=new)
        if longer.announce_stop_time:
            why = f"the FMUs were told that it stops at {written(old)} (announce_stop_time)"
        else:
            plans = [prepared.plan(e) for e in (self.experiment, longer)]
            own = [schedule_of(e) for e in (self.experiment, longer)]
            courses = plans[0].course, plans[1].course
            why = other_stop.why_not(*courses, plans[1].wiring, (own[0], own[1]), point.index)
        if why:
            problem = f"a flight to {written(new)} would not have come to it: {why}"
            raise CheckpointRefused(path, problem, f"Go on to {written(old)}, or fly anew with that stop time.")
        return longer


def schedule_of(experiment: Experiment) -> Schedule:
    """Return the communication points that an experiment says."""
    return Schedule.of(
        experiment.start_time,
        experiment.stop_time,
        experiment.communication_step_size,
        experiment.every,
        [event.time for event in experiment.events],
    )


def resume(
    folder: Path | str,
    *,
    stop_time: Seconds | None = None,
    locate: Callable[[Any], Path] | None = None,
    slaves: Mapping[str, Slave] | None = None,
    progress: Progress | None = None,
    metrics: Judge | None = None,
) -> Result:
    """Go on with the run in a folder from its checkpoint; it ends with the bits of one that was never interrupted.

    All else is in the folder: system, experiment, where the FMUs are, the master, how often a checkpoint is saved.
    `stop_time`: another one, s, where no step so far would have been another with it. `locate`: where FMUs are that are
    no more where they were. `slaves`: instances that were given to the run. Raises `CheckpointRefused`, and what
    `Prepared.fly` raises.
    """
    left = Left(folder)
    given = dict(slaves or {})
    for name in given.keys() - left.system.components.keys():
        raise UnknownName("component", name, "slaves", list(left.system.components))
    if missing := [n for n, path in left.flight["fmus"].items() if path["path"] is None and n not in given]:
        what = f"the run was given instances that are no FMU files: {', '.join(missing)}"
        raise NotSupported(what, "Give such again: cosim.resume(folder, slaves={...}).")
    found = left.located(locate)
    swaps = [SwapReport(**report) for report in left.info.get("swaps", [])]
    with prepare(left.system, found, slaves=slaves, swaps=swaps, metrics=metrics) as prepared:
        paths = {name: found(r) for name, r in left.system.components.items() if name not in given}
        left.refuse_other(paths, prepared)
        return prepared.fly(
            left.until(stop_time, prepared),
            out=left.folder,
            progress=progress,
            format=left.format,
            checkpoint=Fraction(left.checkpoint.every),
            resumed=left.checkpoint,
        )
