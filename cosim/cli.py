"""The command line, `adcs`: list, build, show, run, plot, reproduce. All of it is a Python API first.

A command imports what it needs: what flies and draws takes longer to import than a rebuild of nothing takes.
"""

from collections.abc import Callable
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from cosim import console
from cosim.errors import SimulationError, StepFailed, UnknownName
from cosim.library import Library
from cosim.time import parse_seconds
from fmus import build as building
from fmus.errors import BuildError
from fmus.toolchain import SUFFIXES as PLATFORMS

if TYPE_CHECKING:
    from cosim.masters.explicit import Explicit
    from cosim.result import Result
    from cosim.system import Experiment

app = typer.Typer(no_args_is_help=True, add_completion=False, pretty_exceptions_enable=False, help=__doc__)

Backend = Annotated[Literal["native", "python"], typer.Option(help="Back end of the FMUs that are built.")]
Out = Annotated[Path | None, typer.Option("--out", "-o", help="Folder for the results.")]
Force = Annotated[bool, typer.Option("--force", help="Replace a result that is already there.")]


@contextmanager
def _reported() -> Any:
    """Turn what a user can cause into one message and exit status 2."""
    try:
        yield
    except (SimulationError, BuildError) as error:
        console.error(error)
        raise typer.Exit(2) from error


@app.command("list")
def list_() -> None:
    """Components, systems and papers."""
    from cosim import papers

    with _reported():
        console.listing("components (adcs build NAME)", building.component_docs())
        console.listing("systems (adcs run NAME)", papers.descriptions())
        console.listing("papers (adcs reproduce NAME)", papers.titles())


@app.command()
def build(
    names: Annotated[
        list[str] | None, typer.Argument(help="NAME, FILE.py:Class[:modes=6] or a SYSTEM; all if none.")
    ] = None,
    out: Annotated[Path | None, typer.Option("--out", "-o", help="Folder for the FMUs.")] = None,
    backend: Annotated[Literal["native", "python", "all"], typer.Option(help="Back end.")] = "native",
    platform: Annotated[str, typer.Option(help=f"host, {', '.join(PLATFORMS)} or all; several with commas.")] = "host",
) -> None:
    """Build FMUs: a SYSTEM gives one FMU per instance, with the system's parameters as start values."""
    with _reported():
        backends = building.BACKENDS if backend == "all" else (backend,)
        platforms = tuple(PLATFORMS) if platform == "all" else tuple(platform.split(","))
        for name in names or building.CATALOG:
            if building.is_component(name):
                paths = [building.build_reference(name, b, platforms, out, announce=console.note) for b in backends]
            else:
                from cosim import show

                paths = show.built(name, backends, platforms, out, console.note)
            for path in paths:
                typer.echo(path)


@app.command("show")
def show_(
    name: Annotated[str, typer.Argument(help="SYSTEM, FILE.py[:function] or FILE.fmu.")],
    backend: Backend = "native",
    master: Annotated[str, typer.Option(help="explicit, jacobi or gauss_seidel.")] = "explicit",
) -> None:
    """Connection table, evaluation order, feedthrough and loops of a system; the interface of an FMU."""
    from cosim import scenario, show

    with _reported():
        if name.endswith(".fmu"):
            console.write(show.interface(Path(name)))
        else:
            system, experiment = scenario.load(name)
            console.write(
                show.system(system, replace(experiment, master=_master(master, 0)), Library(backend, console.note))
            )


@app.command()
def run(
    name: Annotated[str, typer.Argument(help="SYSTEM or FILE.py[:function].")],
    backend: Backend = "native",
    master: Annotated[str | None, typer.Option(help="explicit, jacobi or gauss_seidel.")] = None,
    step: Annotated[str | None, typer.Option(help="Communication step, as in 1ms or 0.001.")] = None,
    stop: Annotated[str | None, typer.Option(help="Stop time, as in 200 or 90s.")] = None,
    extrapolation: Annotated[
        int | None, typer.Option(help="Order to which held inputs are extrapolated, 0, 1 or 2.")
    ] = None,
    set_: Annotated[list[str] | None, typer.Option("--set", help="INSTANCE.NAME=VALUE, a unit may follow.")] = None,
    params: Annotated[list[Path] | None, typer.Option(help="TOML file with a table per instance.")] = None,
    use: Annotated[list[str] | None, typer.Option(help="INSTANCE=NAME|FILE.py:Class|FILE.fmu.")] = None,
    out: Out = None,
    every: Annotated[int | None, typer.Option(help="Record every n-th communication point.")] = None,
    format: Annotated[Literal["parquet", "csv", "mat"], typer.Option(help="Format of the result.")] = "parquet",
    plot: Annotated[bool, typer.Option("--plot", help="Draw figures into the result folder.")] = False,
    force: Force = False,
) -> None:
    """Fly a system: build what is missing, simulate, print metrics and (for a paper's system) claims."""
    from cosim import metrics, overrides, scenario
    from cosim.simulate import simulate

    with _reported():
        system, experiment = scenario.load(name)
        locate = Library(backend, console.note)
        system, swaps = overrides.with_units(system, use or [], locate)
        for swap in swaps:
            console.swap(swap)
        for file in params or []:
            system = overrides.with_parameters(system, overrides.parameter_file(file))
        system = overrides.with_parameters(system, overrides.assignments(set_ or []))
        experiment = _changed(experiment, master, step, stop, extrapolation, every)
        folder = out if out is not None else Path("results") / system.name
        with console.progress(system.name) as progress:
            result, failure = _fly(
                lambda: simulate(
                    system,
                    experiment,
                    out=folder,
                    locate=locate,
                    progress=progress,
                    format=format,
                    overwrite=force,
                    swaps=swaps,
                    metrics=metrics.attitude,
                )
            )
        _tell(name, result, plot, as_published=not (set_ or params))
        if failure is not None:
            console.error(failure)
        if result.info["status"] != "finished":
            raise typer.Exit(1)


@app.command("plot")
def plot_(
    folders: Annotated[list[Path], typer.Argument(help="Result folders; several are overlaid.")],
    out: Annotated[
        Path | None, typer.Option("--out", "-o", help="Folder for the figures (default: the first result's).")
    ] = None,
) -> None:
    """Draw one run, or several overlaid."""
    from cosim import plots
    from cosim.result import Result

    with _reported():
        results = {folder.name: Result.read(folder) for folder in folders}
        for path in plots.save(plots.figures(results), out or folders[0]):
            typer.echo(path)


@app.command("reproduce")
def reproduce_(
    names: Annotated[list[str] | None, typer.Argument(help="Papers; all if none.")] = None,
    out: Annotated[Path, typer.Option("--out", "-o", help="Folder for runs, table and figures.")] = Path(
        "results/reproduce"
    ),
    backend: Backend = "native",
    force: Force = False,
) -> None:
    """Fly every experiment of the papers, judge their claims, draw their figures."""
    from cosim import papers, reproduce

    with _reported():
        locate = Library(backend, console.note)
        for paper in names or list(papers.PAPERS):
            with console.progress(paper) as progress:
                report = reproduce.paper(paper, out / paper, locate, progress, overwrite=force)
            console.claims(report.verdicts)
            console.files(report.files)


def _master(name: str, extrapolation: int) -> "Explicit":
    from cosim.masters.explicit import Explicit

    presets: dict[str, Any] = {"explicit": "declared", "jacobi": "jacobi", "gauss_seidel": "gauss_seidel"}
    if name not in presets:
        raise UnknownName("master", name, "--master", list(presets))
    order: Any = extrapolation
    return Explicit(presets[name], order)


def _changed(
    experiment: "Experiment",
    master: str | None,
    step: str | None,
    stop: str | None,
    extrapolation: int | None,
    every: int | None,
) -> "Experiment":
    """Return the experiment with what the command line says instead."""
    changes: dict[str, Any] = {}
    if step is not None:
        changes["communication_step_size"] = parse_seconds(step, "--step")
    if stop is not None:
        changes["stop_time"] = parse_seconds(stop, "--stop")
    if every is not None:
        changes["every"] = every
    if master is not None or extrapolation is not None:
        changes["master"] = _master(master or "explicit", extrapolation or 0)
    return replace(experiment, **changes)


def _fly(call: "Callable[[], Result]") -> "tuple[Result, StepFailed | None]":
    """Return the result, complete or up to the failure."""
    try:
        return call(), None
    except StepFailed as failure:
        return failure.result, failure


def _tell(name: str, result: "Result", plot: bool, as_published: bool) -> None:
    """Print metrics, the claims that this run decides (of the paper's own parameters only), and the files written."""
    from cosim import papers, plots

    console.summary(result)
    finished = result.info["status"] == "finished"
    if finished and as_published:
        console.claims(papers.verdicts(name, result))
    files = sorted(result.folder.glob("*")) if result.folder is not None else []
    if plot and len(result) > 1 and result.folder is not None:
        drawn = papers.figures(name, result) if finished else plots.figures({name: result})
        files += plots.save(drawn, result.folder)
    console.files(files)
