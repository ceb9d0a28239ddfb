"""One call from a system and an experiment to a result."""

import importlib
import json
import math
import tempfile
import time
from collections.abc import Callable, Generator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, nullcontext, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cosim.errors import CallFailed, ResultExists, ResultUnwritable, SimulationError
from cosim.masters.initialization import initialize
from cosim.masters.interrupt import interruptible
from cosim.masters.master import Master
from cosim.masters.plan import Plan
from cosim.results import formats, runinfo
from cosim.results.recorder import Recorder
from cosim.results.result import FILES, INFO, Result
from cosim.slaves.fmi2 import FmuSlave, Slave
from cosim.system.expand import wire
from cosim.system.swap import SwapReport
from cosim.system.system import Experiment, System
from cosim.time import Schedule, to_seconds

Locate = Callable[[str], Path]
Progress = Callable[[float, float], None]


def simulate(
    system: System,
    experiment: Experiment,
    *,
    out: Path | str | None = None,
    slaves: Mapping[str, Slave] | None = None,
    locate: Locate | None = None,
    progress: Progress | None = None,
    format: str = "parquet",
    overwrite: bool = False,
    swaps: Sequence[SwapReport] = (),
    metrics: Callable[[Result], Mapping[str, Any]] | None = None,
) -> Result:
    """Run an experiment and return what it recorded.

    `out`: the result folder (None: nothing is left on disk). `slaves`: instances to use instead of FMUs, by instance
    name. `locate`: FMU reference -> path. `progress(t, stop_time)`, both in s, is called some times a second. `swaps`
    and the value of `metrics(result)` go into run.json.

    Ctrl-C ends the run between two steps; its result has status "interrupted". A run that its `stop_when` ends is
    finished, and its info has the `event`. Raises `ResultExists`, `TimeError`,
    `FmuError`, `WiringErrors`, `CyclicOrder`, `AlgebraicLoop`, `InitializationFailed` before anything is written, and
    `StepFailed`, or `ResultUnwritable` where the disk is full, once the rows up to the failure are: the exception's
    `result` has them. Whatever else ends the run is raised too, and run.json says what it was.
    """
    began = time.perf_counter()
    formats.check_format(format)
    schedule = Schedule.of(
        experiment.start_time, experiment.stop_time, experiment.communication_step_size, experiment.every
    )
    if out is not None and not overwrite:
        refuse_existing(Path(out))
    with ExitStack() as stack:
        given = dict(slaves or {})
        paths = {n: find(r, locate) for n, r in system.components.items() if n not in given}
        used = {n: given[n] if n in given else FmuSlave(n, paths[n]) for n in system.components}
        wiring = wire(system, {name: slave.description for name, slave in used.items()})
        plan = experiment.master.plan(wiring, schedule, experiment.record, experiment.stop_when)
        info = runinfo.setup(system, experiment, wiring, plan, paths, swaps)
        for slave in used.values():
            stack.callback(slave.free)
        values = initialize(plan, wiring, used)
        folder = Path(out) if out is not None else Path(stack.enter_context(tempfile.TemporaryDirectory()))
        clear(folder)
        with _story(folder, info):
            flight = _fly(experiment.master, plan, used, values, folder, progress)
            failure = flight.failure
            for name, slave in used.items():
                if name != getattr(failure, "component", None):
                    with suppress(CallFailed):
                        slave.terminate()
            if out is not None:
                try:
                    formats.convert(folder, format)
                except ResultUnwritable as error:  # the stream stays, and is as good
                    failure = failure or error
            result = Result.read(folder)
            result.folder = folder if out is not None else None
            reached = float(result.time[-1]) if len(result) else None
            event = None if flight.interrupted else runinfo.event(wiring, experiment.stop_when, reached)
            result.info = info | runinfo.ending(schedule, reached, failure, event) | {"rows": len(result)}
            if metrics is not None:
                # of a run that failed too; what ended it must not be hidden by what is made of its rows
                with suppress(Exception) if failure is not None else nullcontext():
                    result.info["metrics"] = {key: _finite(value) for key, value in metrics(result).items()}
            result.info["wall_time"] = {"total": time.perf_counter() - began, "loop": flight.wall_time}
            _write_info(folder, result.info)
    if failure is not None:
        if isinstance(failure, SimulationError):
            failure.result = result
        raise failure
    return result


@contextmanager
def _story(folder: Path, info: Mapping[str, Any]) -> Generator[None]:
    """Have run.json say "running" within, and why it ended if an exception leaves."""
    _write_info(folder, {**info, "status": "running"})
    try:
        yield
    except BaseException as error:
        with suppress(ResultUnwritable):
            _write_info(folder, {**info, **runinfo.broken(error)})
        raise


@dataclass(frozen=True)
class _Flight:
    wall_time: float
    failure: Exception | None
    interrupted: bool


def _fly(
    master: Master,
    plan: Plan,
    slaves: Mapping[str, Slave],
    values: NDArray[np.float64],
    folder: Path,
    progress: Progress | None,
) -> _Flight:
    """Run the loop with the recorder and the progress as its guests; rows are kept whatever ends it."""
    failure: Exception | None = None
    interrupted = False
    began = time.perf_counter()
    try:
        with Recorder(folder, plan.columns) as recorder, interruptible() as stop:
            run = master.steps(plan, slaves, values, recorder.block, stop)
            try:
                for done in run:
                    recorder.look()
                    if progress is not None:
                        progress(to_seconds(plan.schedule.point(done)), to_seconds(plan.schedule.stop))
            except KeyboardInterrupt:
                interrupted = True  # the last row tells how far it came
            finally:
                run.close()
                interrupted = interrupted or stop()
    except Exception as error:
        failure = error
    return _Flight(time.perf_counter() - began, failure, interrupted)


def find(reference: str, locate: Locate | None = None) -> Path:
    """Return the file of an FMU reference: by `locate` if given, a path to a .fmu file, else from the library."""
    if locate is not None:
        return locate(reference)
    if reference.endswith(".fmu"):
        return Path(reference)
    library: Any = importlib.import_module("cosim.cli.library")
    return library.locate(reference)


def refuse_existing(folder: Path) -> None:
    """Raise `ResultExists` if a folder holds a result."""
    if any((folder / name).exists() for name in FILES):
        raise ResultExists(folder)


def make_folder(folder: Path) -> None:
    """Make a folder for results; raises `ResultUnwritable`."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        problem = "it is a file" if folder.is_file() else error.strerror or str(error)
        raise ResultUnwritable(folder, problem) from error


def clear(folder: Path) -> None:
    """Make the folder; remove an older result in it, and nothing else. Raises `ResultUnwritable`."""
    make_folder(folder)
    try:
        for name in FILES:
            (folder / name).unlink(missing_ok=True)
    except OSError as error:
        raise ResultUnwritable(folder, error.strerror or str(error)) from error


def _finite(value: Any) -> Any:
    """Return a metric with None for what is no finite number, which JSON has none for: a run may end far out."""
    if isinstance(value, list):
        return [_finite(v) for v in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _write_info(folder: Path, info: Mapping[str, Any]) -> None:
    """Write run.json whole or not at all. Raises `ResultUnwritable`."""
    part = folder / f".{INFO}"
    try:
        part.write_text(_json(info), encoding="utf-8")
        part.replace(folder / INFO)
    except OSError as error:
        raise ResultUnwritable(folder / INFO, error.strerror or str(error)) from error


def _json(info: Mapping[str, Any]) -> str:
    return json.dumps(info, indent=2, allow_nan=False, default=str) + "\n"
