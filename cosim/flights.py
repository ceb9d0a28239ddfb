"""From a system and an experiment to a result: prepare once, fly many times; or all in one call."""

import time
from collections.abc import Callable, Generator, Mapping, Sequence
from contextlib import contextmanager, nullcontext, suppress
from dataclasses import replace
from pathlib import Path
from typing import Any, cast

from cosim import remedy
from cosim.checkpoints import Checkpoints, Keeping
from cosim.errors import (
    FmuError,
    NotSupported,
    ResultUnreadable,
    ResultUnwritable,
    SimulationError,
    StepFailed,
    WiringErrors,
)
from cosim.flight import Flight, Progress, warn
from cosim.masters import events
from cosim.masters.events import Events
from cosim.masters.explicit import Explicit
from cosim.masters.initialization.initialize import Initialization
from cosim.masters.kernel import crash
from cosim.masters.master import Master
from cosim.plan import Plan, on
from cosim.results import formats, process, runinfo, story
from cosim.results.checkpoint import Checkpoint
from cosim.results.claim import claimed
from cosim.results.effective import Effective
from cosim.results.folder import place
from cosim.results.result import Judge, Result
from cosim.slaves import crew as crews
from cosim.slaves.crew import Crew, Crews
from cosim.slaves.opening import open_fmu, open_isolated
from cosim.slaves.pending import Patience
from cosim.slaves.slave import Slave
from cosim.ssp.package import path_of
from cosim.system import feeds, onsets
from cosim.system.events import resolve
from cosim.system.expand import rewire, wire
from cosim.system.onsets import Onsets
from cosim.system.overrides import with_inputs, with_parameters
from cosim.system.reference import Reference, is_fmu, name_of, reference_of
from cosim.system.signal import Signal
from cosim.system.swap import SwapReport
from cosim.system.system import Experiment, System, isolated
from cosim.system.wiring import Wiring
from cosim.time import Schedule, Seconds, exact_seconds

Locate = Callable[[Any], Path]
"""FMU reference, as `System` has it, -> path."""


def simulate(
    system: System,
    experiment: Experiment,
    *,
    locate: Locate | None = None,
    slaves: Mapping[str, Slave] | None = None,
    swaps: Sequence[SwapReport] = (),
    out: Path | str | None = None,
    overwrite: bool = False,
    progress: Progress | None = None,
    format: str = "parquet",
    metrics: Judge | None = None,
    advise: bool = True,
    checkpoint: Seconds | None = None,
) -> Result:
    """Run an experiment and return what it recorded; see `prepare` and `Prepared.fly`, which it calls."""
    formats.check_format(format)
    folder = place(out)
    if folder is not None and not overwrite:
        story.refuse_existing(folder)
    with prepare(system, locate, slaves=slaves, swaps=swaps, metrics=metrics) as prepared:
        return prepared.fly(
            experiment,
            out=folder,
            overwrite=overwrite,
            progress=progress,
            format=format,
            advise=advise,
            checkpoint=checkpoint,
        )


def prepare(
    system: System,
    locate: Locate | None = None,
    *,
    slaves: Mapping[str, Slave] | None = None,
    swaps: Sequence[SwapReport] = (),
    metrics: Judge | None = None,
) -> "Prepared":
    """Read, check, wire and load a system once, to be flown many times.

    `locate`: FMU reference -> path; None: references are paths of .fmu files. `slaves`: instances to use instead of
    FMUs, by instance name. `swaps` go into run.json, and the value of `metrics(result)`, which is `result.metrics`.
    Raises `FmuError`, `WiringErrors`.
    """
    given, alone, opened = dict(slaves or {}), isolated(system), (open_fmu, open_isolated)
    paths = {name: find(r, locate) for name, r in system.components.items() if name not in given}
    made = False

    def make() -> Crew:
        nonlocal made
        if made and given:
            names = ", ".join(given)
            raise NotSupported(
                f"instances that are given ({names}) fly one flight at a time", "Prepare one more system."
            )
        made = True
        return {n: given[n] if n in given else opened[n in alone](n, paths[n]) for n in system.components}

    return Prepared(system, paths, make, swaps, metrics)


def find(given: Reference | Path, locate: Locate | None = None) -> Path:
    """Return the file of an FMU reference, by `locate` if given; raises `FmuError` for what is no file then."""
    reference = reference_of(given)
    if locate is not None:
        return locate(reference)
    if is_fmu(reference):
        return path_of(reference)
    problem = "it is no path of a .fmu file. Say where such FMUs are: locate=cosim.Library()"
    raise FmuError(Path(name_of(reference)), problem)


class Prepared:
    """A system that is ready to fly, again and again, from several threads at once; a context manager.

    Instances are reused (fmi2Reset, else new ones), one set for each flight that goes on at the same time. `close`
    frees them.
    """

    @crash.told()
    def __init__(
        self,
        system: System,
        paths: Mapping[str, Path],
        make: Callable[[], Crew],
        swaps: Sequence[SwapReport] = (),
        metrics: Judge | None = None,
    ) -> None:
        self.system = system
        self._metrics = metrics
        self._paths, self._swaps = paths, tuple(swaps)
        self._crews = Crews(make)
        first = self._crews.take()
        self._crews.give_back(first, flown=False)
        self._descriptions = {name: slave.description for name, slave in first.items()}
        self._wiring = wire(system, self._descriptions)
        self._plans: dict[Any, Plan] = {}

    @property
    def wiring(self) -> Wiring:
        """The system as it is wired, with the descriptions of its FMUs."""
        return self._wiring

    def __enter__(self) -> "Prepared":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @crash.told()
    def close(self) -> None:
        """Free all instances that do not fly."""
        self._crews.close()

    @crash.told()
    def fly(
        self,
        experiment: Experiment,
        *,
        parameters: Mapping[str, Any] | None = None,
        inputs: Mapping[str, Signal] | None = None,
        record: Sequence[str] | None = None,
        out: Path | str | None = None,
        overwrite: bool = False,
        progress: Progress | None = None,
        format: str = "parquet",
        advise: bool = True,
        checkpoint: Seconds | None = None,
        resumed: Checkpoint | None = None,
    ) -> Result:
        """Run an experiment and return what it recorded.

        `parameters`, `inputs`, `record`: instead of the system's and the experiment's; a signal takes the place of the
        connection to its input too. `out`: the result folder (None: nothing
        is left on disk). `progress(t, stop_time)`, both in s, is called some times a second. `advise`: where a flight
        diverges, try shorter steps for some seconds, and let the error say which one passes. `checkpoint`: so many
        seconds of the flight lie between two checkpoints, from which `cosim.resume(out)` goes on; `resumed`: the one in
        the folder from which this flight goes on.

        Ctrl-C ends the run within the step that is running, with status "interrupted"; a second one ends it at once.
        SIGTERM does as the first, and then ends the process (`SystemExit`), or is answered by the program's handler. A
        run that its `stop_when` ends is finished, and its info has the `event`. Raises `ResultExists`, `TimeError`,
        `WiringErrors`, `CyclicOrder`, `UnknownName`, `AlgebraicLoop`, `InitializationFailed` before anything is
        written, and `StepFailed`, `ValueRefused`, or `ResultUnwritable` where the disk is full, once the rows up to
        the failure are: the exception's `result` has them. Whatever else ends the run is raised too, and run.json says
        what it was.
        """
        began = time.perf_counter()
        formats.check_format(format)
        folder = place(out)
        if folder is not None and not overwrite and resumed is None:
            story.refuse_existing(folder)
        experiment = experiment if record is None else replace(experiment, record=record)
        patience = Patience(experiment.pending_timeout, experiment.isolation_timeout)
        plan = self._plan(experiment, parameters, tuple(experiment.record), inputs)
        keeping = Keeping()
        if checkpoint is not None:
            system = with_inputs(with_parameters(self.system, parameters or {}), inputs or {})
            flown = system, experiment, self._paths, self._descriptions, format
            keeping = Checkpoints.of(checkpoint, folder, flown, resumed)
        for line in plan.info["warnings"]:
            warn(line)
        if folder is not None:
            schedule = plan.course.schedule
            formats.check_room(
                format, plan.course.layout.columns, schedule.steps // schedule.every + len(schedule.events) + 2
            )
        with self._crew() as crew:
            schedule = plan.course.schedule
            stop = schedule.time(schedule.steps) if experiment.announce_stop_time else None
            slaves: Crew = {**crew, **plan.tabulated()}
            for slave in slaves.values():
                slave.patience = patience
            point = plan.initialization.start(slaves, schedule.time(0), experiment.tolerance, stop)
            point = keeping.point(point, slaves, plan.course)
            with claimed(folder):
                keeping.claim(folder, overwrite=overwrite)
                info = {**plan.info, **keeping.told(), **process.describe()}
                if folder is not None:  # a third of the cost of a short flight that is not kept
                    info["values"] = plan.effective.read(crew, plan.wiring.settings)
                with story.told(folder, info) as tale:
                    flight = Flight(
                        plan.course,
                        slaves,
                        point,
                        Events(plan.events, slaves),
                        folder,
                        progress,
                        info,
                        patience,
                        keeping,
                    )
                    flight.fly(tale.problem)
                    refused = crews.end(crew, getattr(flight.failure, "component", None))
                    result, failure = self._result(plan, flight, folder, format)
                    result.info |= runinfo.calls(crew, refused)
                    result.info["wall_time"] = {"total": time.perf_counter() - began, "loop": flight.wall_time}
                    problem = tale.end(result.info)
                    if advise and isinstance(failure, StepFailed):
                        self._advise(failure, experiment, parameters, inputs)
                        if failure.remedy:
                            result.info |= runinfo.broken(failure)
                            problem = tale.end(result.info)
                    if problem is not None and failure is None:
                        failure = problem
                        result.info |= runinfo.broken(problem)
        flight.asked.answer()
        if failure is not None:
            if isinstance(failure, SimulationError):
                failure.result = result
            raise failure
        return result

    def _advise(
        self,
        failure: StepFailed,
        experiment: Experiment,
        parameters: Mapping[str, Any] | None,
        inputs: Mapping[str, Signal] | None,
    ) -> None:
        if self._paths.keys() == self.system.components.keys():  # instances that are given fly one flight only

            def fly(trial: Experiment, look: Progress) -> Result:
                stop = exact_seconds(trial.stop_time, "stop_time")
                trial = replace(trial, events=[e for e in trial.events if exact_seconds(e.time, "event") < stop])
                trial = replace(trial, faults=[f.within(stop) for f in trial.faults if f.begins < stop])
                return self.fly(trial, parameters=parameters, inputs=inputs, progress=look, advise=False)

            remedy.advise(failure, experiment, experiment.master or Explicit(), fly)

    def plan(self, experiment: Experiment) -> Plan:
        """Return what `fly` works out for an experiment before it flies."""
        return self._plan(experiment, None, tuple(experiment.record))

    @contextmanager
    def _crew(self) -> Generator[Crew]:
        crew = self._crews.take()
        try:
            yield crew
        finally:
            self._crews.give_back(crew)

    def _plan(
        self,
        experiment: Experiment,
        parameters: Mapping[str, Any] | None,
        record: tuple[str, ...],
        inputs: Mapping[str, Signal] | None = None,
    ) -> Plan:
        """Return what the flight needs beside instances; it is kept, but for what is of this flight alone."""
        schedule = Schedule.of(
            experiment.start_time,
            experiment.stop_time,
            experiment.communication_step_size,
            experiment.every,
            [*(event.time for event in experiment.events), *onsets.times(experiment, self.system.name)],
        )
        master = cast(Master, experiment.master if experiment.master is not None else Explicit())
        system = with_parameters(self.system, parameters) if parameters else self.system
        if inputs:
            system = with_inputs(system, inputs)
            wiring = wire(system, self._descriptions)
            return self._planned(system, wiring, schedule, master, experiment, record)
        if experiment.events or experiment.faults:
            wiring = rewire(self._wiring, system)
            return self._planned(system, wiring, schedule, master, experiment, record)
        key = (master, schedule, record, replace(experiment, master=None, record=()))
        if key not in self._plans:
            self._plans[key] = self._planned(system, self._wiring, schedule, master, experiment, record)
        plan = self._plans[key]
        if not parameters:
            return plan
        wiring = rewire(self._wiring, system)
        if wiring.held != self._wiring.held:  # held values are in the layout
            return self._planned(system, wiring, schedule, master, experiment, record)
        timed = replace(plan.wiring, settings=wiring.settings)
        info = {**plan.info, "parameters": runinfo.values(timed, timed.settings)}
        if info["warnings"]:  # these parameters may settle what the system leaves open
            info["warnings"] = runinfo.warnings(timed)
        return replace(plan, wiring=timed, initialization=plan.initialization.with_settings(timed), info=info)

    def _planned(
        self,
        system: System,
        wiring: Wiring,
        schedule: Schedule,
        master: Master,
        experiment: Experiment,
        record: tuple[str, ...],
    ) -> Plan:
        if uncovered := [mistake for feed in wiring.feeds.values() for mistake in feeds.uncovered(feed, schedule)]:
            raise WiringErrors(system.name, uncovered)
        changes, mistakes = resolve(wiring, system, schedule, experiment.events)
        found = Onsets(wiring, system, schedule, experiment.faults, changes)
        if mistakes := [*mistakes, *found.mistakes]:
            raise WiringErrors(system.name, mistakes)
        timed = master.timed(found.wiring)
        course = master.course(timed, schedule, record, experiment.stop_when)
        info = runinfo.setup(system, experiment, schedule, timed, course, master, self._paths, self._swaps)
        signals = {name: feeds.pieces(feed, schedule) for name, feed in wiring.feeds.items()}
        info["events"] = [change.told(timed) for change in changes]
        info["faults"] = [fault.told() for fault in experiment.faults]
        happening = events.Plan.of(timed, course.layout, on(course.schedule, found.changes))
        return Plan(timed, course, Initialization.of(timed, course.layout), Effective(timed), info, signals, happening)

    def _result(self, plan: Plan, flight: Flight, folder: Path | None, format: str) -> tuple[Result, Exception | None]:
        """Return the result of a flight that has ended, and what ended it early."""
        failure = flight.failure
        table = flight.recorder.table()
        if folder is not None:
            try:
                table = formats.convert(folder, format)
            except (ResultUnwritable, ResultUnreadable) as error:  # the stream stays, and is as good
                failure = failure or error
                with suppress(ResultUnreadable):  # where no row was written
                    table = Result.read(folder).table
        result = Result(table, flight.info, folder, self._metrics)
        reached = float(result.time[-1]) if len(result) else None
        event = None if flight.interrupted else runinfo.event(self._descriptions, plan.info["stop_when"], reached)
        if flight.ended_by:
            event = {"time": reached, "variable": flight.ended_by, "meaning": "the FMU ended the run (fmi2Terminated)"}
        result.info |= runinfo.ending(plan.course.schedule, reached, failure, event)
        told = {"internal_steps": runinfo.internal_steps(flight.crew, plan.wiring)}
        result.info |= told | {"messages": runinfo.messages(flight.crew)}
        loop = {"name": flight.flown.name, "reason": flight.flown.reason, "evaluations": flight.evaluations}
        result.info |= {"rows": len(result), "loop": {**loop, **flight.control.told()}}
        if self._metrics is not None and folder is not None:
            # of a run that failed too; what ended it must not be hidden by what is made of its rows
            with suppress(Exception) if failure is not None else nullcontext():
                _ = result.metrics
        return result, failure
