"""What `adcs export` does: a system is wired, started or flown, and written as a package."""

from collections.abc import Callable, Sequence
from importlib.metadata import version as version_of
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from cosim.cli import happenings, starts
from cosim.cli.instances import as_arrays, read_descriptions
from cosim.cli.library import Library
from cosim.cli.tabling import build_tables
from cosim.errors import SimulationError
from cosim.flights import simulate
from cosim.masters.explicit import Explicit
from cosim.results.result import figures
from cosim.ssp import trace
from cosim.ssp.signals import instance_names
from cosim.ssp.write import PARAMETER_SET, generated, write
from cosim.studies import metrics, papers
from cosim.system import Experiment, System
from cosim.system.expand import wire
from cosim.system.reference import is_fmu
from cosim.system.wiring import Wiring
from cosim.time import exact_seconds, in_words
from fmus import places
from fmus.description.units import IDENTITY
from fmus.export.build import build_reference

if TYPE_CHECKING:
    from cosim.results.result import Result
    from cosim.studies.papers.claims import Verdict


def export(
    path: Path,
    system: System,
    experiment: Experiment,
    library: Library,
    *,
    ssp: str = "1.0",
    traced: str | None = None,
    platforms: Sequence[str] = ("host",),
    note: Callable[[str], None] | None = None,
) -> list[str]:
    """Write a package, and return what is to be told of it, line by line.

    Its FMUs have the system's values as start values, besides the parameter sets: some tools read none, some set
    parameters and inputs only. FMUs of files are taken as they are. `platforms`: of the others. `note` is told what is
    built. `traced`: fly the experiment and write what it shows too; the name of the paper's experiment that it is, ""
    for none. Raises `SspError`, `WiringErrors`, `BuildError`, and what ends such a flight early.
    """
    tool = f"adcs-cosim {version_of('adcs-cosim')}"
    wiring = wire(system, read_descriptions(system, library))
    happenings.refuse(system, experiment, wiring)
    notes: list[str] = []
    if traced is not None and papers.find_owner(traced) is None:
        notes.append("no claims: this is no experiment of a paper as it is published, only its metrics are written")
    extra: dict[str, bytes] = {}
    result: Result | None = None
    try:
        if traced is None:
            result = starts.started(system, experiment, library)
        else:
            result = simulate(system, experiment, locate=library, metrics=_measure(traced))
            extra[trace.FILE] = _traced(system, experiment, traced, result, tool)
    except SimulationError as error:
        if traced is not None:
            raise
        notes.append(starts.unknown(error))
    inputs = {} if result is None else starts.of_inputs(wiring, result)
    with TemporaryDirectory(dir=places.workshop()) as folder:
        given = {**wiring.settings, **inputs, **wiring.held}
        fmus = {
            name: library(reference)
            if is_fmu(reference)
            else build_reference(
                reference,
                library.backend,
                platforms,
                Path(folder),
                as_arrays(wiring, name, given),
                name,
                note,
                starts.default_experiment(experiment, wiring.period(name)),
            )
            for name, reference in system.components.items()
        }
        write(
            path,
            system,
            experiment,
            wiring,
            fmus,
            version=ssp,
            starts=inputs,
            tool=tool,
            extra=extra,
            tables=build_tables(wiring, Path(folder), platforms),
        )
    return [*notes, *_remarks(system, experiment, wiring)]


def _measure(name: str) -> "Callable[[Result], Any]":
    owner = papers.find_owner(name)
    settled = metrics.THRESHOLD if owner is None else owner.settled
    return lambda run: metrics.measure(run, settled)


def _traced(system: System, experiment: Experiment, name: str, result: "Result", tool: str) -> bytes:
    """Return the meta data of a flight, with the claims that it decides."""
    info = result.info
    flight = {
        "status": info["status"],
        "stop time (s)": f"{info['stop_time']!r}",
        "communication step size (s)": f"{info['communication_step_size']!r}",
        "master": repr(experiment.master or Explicit()),
    }
    flight |= {f"GUID of {instance}": told["guid"] for instance, told in info["components"].items()}
    measured = {key: figures(value) for key, value in result.metrics.items()}
    claims = [_claim(verdict) for verdict in papers.judge_run(name, result)]
    return trace.trace(system.name, flight, measured, claims, generated(tool))


def _claim(verdict: "Verdict") -> dict[str, str]:
    told = {
        "paper": verdict.paper,
        "claim": verdict.claim,
        "paper says": verdict.said,
        "measured": verdict.measured,
        "verdict": verdict.word,
        "what fails": verdict.failing,
        "criterion": verdict.criterion,
        "depends on": verdict.depends,
    }
    return {keyword: text for keyword, text in told.items() if text}


def _remarks(system: System, experiment: Experiment, wiring: Wiring) -> Sequence[str]:
    """Return what other tools must be told, for SSP has no place for it."""
    step = in_words(exact_seconds(experiment.communication_step_size, "communication_step_size"))
    lines = [
        f"other tools must be told the communication step, {step}; some ask for the parameter set {PARAMETER_SET}",
        "they pass outputs on at communication points, with larger errors: adcs run --master plain gives their numbers",
    ]
    own = ["events"] * bool(experiment.events) + ["faults"] * bool(experiment.faults)
    own += ["processes of their own"] * bool(system.isolated)
    if own:
        lines.append(f"only adcs-cosim reads the {' and '.join(own)} in it, in its own annotation")
    if wiring.feeds:
        tables = ", ".join(instance_names(wiring).values())
        lines.append(f"signals are FMUs for other tools ({tables}), which hold each value over a communication step")
    files = [name for name, reference in system.components.items() if is_fmu(reference)]
    if files:
        lines.append(f"FMUs of files are in it as they are, values only in their parameter sets: {', '.join(files)}")
    changed = [link for link in wiring.links if link.conversion != IDENTITY and not link.fed]
    if changed:
        first, more = changed[0], f" and {len(changed) - 1} more" if len(changed) > 1 else ""
        lines.append(f"{first.source} -> {first.target}{more} has a factor: check that the other tool applies it")
    return lines
