"""The command line, `adcs`: each command here or in a module of its own. What it does is in what it calls.

A command imports what it needs: what flies and draws takes longer to import than a rebuild of nothing takes.
"""

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from cosim.cli import console, exporting, plotting, verifying
from cosim.cli import inputs as feeding
from cosim.cli.isolating import Isolate, IsolationTimeout, with_isolation
from cosim.cli.options import (
    Backend,
    Extrapolation,
    Force,
    Inputs,
    Master,
    MasterTolerance,
    Params,
    Set,
    Step,
    Stop,
    Use,
    reported,
    times,
)
from cosim.errors import ResultUnwritable, SimulationError
from cosim.results.names import FORMATS
from fmus.toolchain import SUFFIXES as PLATFORMS

if TYPE_CHECKING:
    from cosim.cli.library import Library
    from cosim.results.result import Result

HELP = """Spacecraft attitude-control co-simulation with FMI 2.0 FMUs.

First steps: adcs list, then adcs run zhang2018-ppatc --plot.

FMUs that are built, and the compiled kernel, are kept in $ADCS_BUILD, else in the user's cache folder (on Linux
~/.cache/adcs-cosim)."""

app = typer.Typer(no_args_is_help=True, add_completion=False, pretty_exceptions_enable=False, help=HELP)


@app.command("list")
def list_() -> None:
    """List components, systems and papers, a line each."""
    from cosim.studies import papers
    from fmus.export import build as building

    with reported():
        console.write_listing("components (adcs build NAME)", building.component_docs())
        console.write_listing("systems (adcs run NAME)", papers.describe())
        console.write_listing(
            "papers (adcs reproduce NAME)", {key: paper.title for key, paper in papers.PAPERS.items()}
        )


@app.command()
def build(
    names: Annotated[
        list[str] | None,
        typer.Argument(metavar="[NAME]...", help="NAME, FILE.py:Class, NAME:modes=6 or a SYSTEM; all NAMEs if none."),
    ] = None,
    out: Annotated[
        Path | None, typer.Option("--out", "-o", help="Folder for the FMUs. Default: for a SYSTEM one of its name.")
    ] = None,
    backend: Annotated[
        Literal["native", "python", "all"], typer.Option(help="C, Python that can be edited, or both.")
    ] = "native",
    platform: Annotated[
        str, typer.Option(help=f"Of native FMUs: host, {', '.join(PLATFORMS)} or all; several with commas.")
    ] = "host",
) -> None:
    """Build FMUs that are missing or out of date, and print their paths.

    A SYSTEM gives one FMU per instance, with the system's parameters as start values.
    """
    from fmus.export import build as building

    with reported():
        backends = building.BACKENDS if backend == "all" else (backend,)
        platforms = tuple(PLATFORMS) if platform == "all" else tuple(platform.split(","))
        for name in names or building.CATALOG:
            if building.is_component(name):
                places = [out / b if out is not None and len(backends) > 1 else out for b in backends]
                paths = [
                    building.build_reference(name, b, platforms, place, announce=console.note)
                    for b, place in zip(backends, places, strict=True)
                ]
            else:
                from cosim.cli import instances

                paths = instances.build_system(name, backends, platforms, out, console.note)
            for path in paths:
                typer.echo(path)


@app.command("show")
def show_(
    name: Annotated[
        str,
        typer.Argument(
            metavar="NAME", help="SYSTEM, FILE.py[:function], FILE.ssp, FILE.fmu, a component, or a result folder."
        ),
    ],
    stop: Stop = None,
    step: Step = None,
    backend: Backend = "native",
    master: Master = None,
    inputs: Inputs = None,
    extrapolation: Extrapolation = None,
) -> None:
    """Show how a system is wired and evaluated, the description of one FMU, or what a run has left in a folder.

    A folder that has the name of a system is meant by ./NAME.
    """
    from cosim.cli import flown, overrides, scenario, show
    from cosim.cli.library import Library
    from cosim.studies import papers
    from cosim.system.reference import is_fmu
    from fmus.export import build as building

    with reported():
        locate = Library(backend, console.note)
        if is_fmu(name) or building.is_component(name):
            show.write_fmu(locate(name), foreign=is_fmu(name))
        elif flown.is_result(Path(name)) and name not in papers.describe():
            flown.write_result(Path(name))
        else:
            system, experiment = scenario.load(name, *times(stop, step))
            experiment = overrides.with_experiment(
                experiment, step, stop, master=master, inputs=inputs, extrapolation=extrapolation
            )
            show.write_system(system, experiment, locate)


@app.command()
def run(
    name: Annotated[str, typer.Argument(metavar="NAME", help="SYSTEM, FILE.py[:function], FILE.ssp or FILE.fmu.")],
    use: Use = None,
    set_: Set = None,
    params: Params = None,
    input_: feeding.Input = None,
    interpolation: feeding.Interpolated = "linear",
    hold: feeding.Hold = None,
    stop: Stop = None,
    step: Step = None,
    master: Master = None,
    inputs: Inputs = None,
    extrapolation: Extrapolation = None,
    master_tolerance: MasterTolerance = None,
    hold_unconnected: Annotated[
        bool, typer.Option("--hold-unconnected", help="Hold inputs that nothing is connected to at their start values.")
    ] = False,
    tolerance: Annotated[
        float | None, typer.Option(help="Relative tolerance that FMUs are told. Default: each FMU's own.")
    ] = None,
    announce_stop_time: Annotated[
        bool, typer.Option("--announce-stop-time", help="Tell the FMUs the stop time, for one that needs it.")
    ] = False,
    pending_timeout: Annotated[
        float | None,
        typer.Option(metavar="SECONDS", help="How long a step may go on after fmi2DoStep has returned fmi2Pending."),
    ] = None,
    isolate: Isolate = None,
    isolation_timeout: IsolationTimeout = None,
    backend: Backend = "native",
    out: Annotated[
        Path | None, typer.Option("--out", "-o", help="Folder for the result. Default: results/SYSTEM.")
    ] = None,
    force: Force = False,
    every: Annotated[int | None, typer.Option(help="Record every n-th communication point.")] = None,
    format: Annotated[str, typer.Option(help=f"Format of the result: {', '.join(FORMATS)}.")] = "parquet",
    settled: Annotated[
        str | None,
        typer.Option(metavar="ANGLE", help="Threshold of the settling time, as in '0.005 deg'. Default: the paper's."),
    ] = None,
    plot: Annotated[bool, typer.Option("--plot", help="Draw figures into the result folder.")] = False,
) -> None:
    """Fly a system, and print its metrics and the claims of a paper that it decides.

    Missing FMUs are built first. Exit status: 0 finished, 1 ended early (what was recorded is kept), 2 not begun.
    """
    from cosim.cli import overrides, scenario
    from cosim.cli.library import Library
    from cosim.flights import simulate
    from cosim.studies import metrics, papers

    with reported():
        system, experiment = scenario.load(name, *times(stop, step))
        owner = papers.find_owner(name)
        usual = metrics.THRESHOLD if owner is None else owner.settled
        threshold = usual if settled is None else overrides.parse_degrees(settled, "--settled")
        locate = Library(backend, console.note)
        if hold_unconnected:
            system = replace(system, hold_unconnected=True)
        system, swaps = overrides.with_changes(system, use or [], params or [], set_ or [], locate, console.write_swap)
        system, fed = feeding.with_fed(system, input_ or [], interpolation, hold or [])
        experiment = overrides.with_experiment(
            experiment,
            step,
            stop,
            every,
            master,
            inputs,
            extrapolation,
            tolerance,
            announce_stop_time,
            master_tolerance,
            pending_timeout,
        )
        system, experiment = with_isolation(system, experiment, isolate, isolation_timeout)
        folder = out if out is not None else Path("results") / system.name
        with console.progress(system.name) as progress:
            failure: SimulationError | None = None
            try:
                result = simulate(
                    system,
                    experiment,
                    out=folder,
                    locate=locate,
                    progress=progress,
                    format=format,
                    overwrite=force,
                    swaps=swaps,
                    metrics=lambda run: metrics.measure(run, threshold),
                )
            except SimulationError as error:
                if error.result is None:
                    raise
                failure, result = error, error.result
        changed = (fed or None, set_, params, step, every, master, inputs, extrapolation, tolerance, master_tolerance)
        if system.hold_unconnected:
            console.write_held(result, system.held)
        try:
            as_published = not any(option not in (None, []) for option in changed)
            _tell(name, result, locate if plot else None, as_published)
        except ResultUnwritable as error:  # the run was flown; what ended it is the first to be told
            failure, error.result = failure or error, result
        if failure is not None:
            raise failure
        if result.info["status"] != "finished":
            raise typer.Exit(1)


app.command("plot")(plotting.plot_)
app.command("metrics")(plotting.metrics_)
app.command("verify")(verifying.verify_)
app.command("export")(exporting.export_)


@app.command("reproduce")
def reproduce_(
    names: Annotated[list[str] | None, typer.Argument(metavar="[PAPER]...", help="Papers; all if none.")] = None,
    out: Annotated[Path, typer.Option("--out", "-o", help="Folder for runs, table and figures.")] = Path(
        "results/reproduce"
    ),
    docs: Annotated[
        Path | None,
        typer.Option("--docs", help="The project's folder: write its docs/papers anew."),
    ] = None,
    backend: Backend = "native",
    force: Force = False,
) -> None:
    """Fly every experiment of the papers, judge their claims, draw their figures; one table of claims, one of metrics.

    Exit status 1 after Ctrl-C or a failure: the report has the experiments that were flown.
    """
    from cosim.cli.library import Library
    from cosim.studies import papers, reproduction
    from cosim.studies.papers import pages

    with reported():
        locate = Library(backend, console.note)
        chosen = list(dict.fromkeys(names or papers.PAPERS))
        with console.progress("reproduce") as progress:
            report = reproduction.reproduce(chosen, out, locate, progress, console.note, overwrite=force)
        console.write_claims(report.verdicts)
        rows = list(reproduction.metrics_rows(report.results, reproduction.BRIEF))
        console.write_table(("experiment", *reproduction.BRIEF, "ended"), rows, whole=(0, -1))
        console.write_files(report.files)
        if report.failure is not None:
            raise report.failure
        if not report.complete:
            console.note(f"interrupted: {report.flown} of {report.planned} experiments flown")
            raise typer.Exit(1)
        if docs is not None:
            if set(chosen) != set(papers.PAPERS):
                raise typer.BadParameter("the pages are of all papers: name none", param_hint="--docs")
            console.write_files(pages.refresh(docs, [v.row() for v in report.verdicts], report.titles))


@app.command("compare")
def compare_(
    plants: Annotated[
        str, typer.Option(metavar="PAPER,...", help="Plants, by the papers whose vehicles they are; all if none.")
    ] = "",
    controllers: Annotated[
        str, typer.Option(metavar="SYSTEM,...", help="Controllers, by the experiments that have them; all if none.")
    ] = "",
    out: Annotated[Path, typer.Option("--out", "-o", help="Folder for the table.")] = Path("results/compare"),
    backend: Backend = "native",
    force: Force = False,
) -> None:
    """Fly every attitude controller on every attitude plant: the same slew, the same disturbance, one table.

    A plant has its paper's cluster, or wheels. The vehicle's parameters are carried into the controller, gains are not
    retuned. Exit status 1 after Ctrl-C: the table has the flights that were finished.
    """
    from cosim.cli.library import Library
    from cosim.studies import comparison

    with reported(), console.progress("compare") as progress:
        rows, columns = ([name.strip() for name in text.split(",")] if text else [] for text in (plants, controllers))
        locate = Library(backend, console.note)
        table = comparison.compare(rows, columns, out, locate, progress, console.note, overwrite=force)
    # what a controller is told of a vehicle is the vehicle's own; compare.json has the sets pair by pair
    console.write_parameters({name: values for name, values in table.parameters.items() if " on " not in name})
    for line in comparison.mission.WORDS:
        console.write(line)
    for plant, cluster in table.clusters.items():
        cells = [cell for cell in table.cells if cell.plant == plant]
        if not cells:
            continue
        console.write(f"\n{plant} with {cluster}")
        rows = [comparison.make_row(cell)[1:-1] for cell in cells if cell.figures]
        console.write_table(("controller", *comparison.COLUMNS), rows, whole=(0,))
        for cell in cells:
            if cell.remark:
                console.write(f"{cell.controller} on {plant} {cell.remark}")
    console.write_files(table.files)
    if not table.complete:
        console.note(f"interrupted: {len(table.cells)} of {table.planned} flights flown")
        raise typer.Exit(1)


def _tell(name: str, result: "Result", locate: "Library | None", as_published: bool) -> None:
    """Print metrics, the claims that this run decides (of the paper's own parameters only), and the files written.

    `locate`: figures are drawn too.
    """
    from cosim.results.names import FILES
    from cosim.studies import papers

    console.write_summary(result)
    own = result.info["status"] == "finished" and as_published
    if own:
        console.write_claims(papers.judge_run(name, result))
    remark = papers.explain_open(name, result, as_published)
    if remark:
        console.write(remark)
    if result.folder is None:
        return
    files = [result.folder / file for file in FILES if (result.folder / file).exists()]
    if locate is not None and len(result) > 1:
        from cosim.studies import plots

        drawn, notes = plotting.draw_runs({result.info["system"]: result}, locate)
        files += plots.save(drawn, result.folder)
        for note in notes:
            console.note(note)
        if not drawn:
            console.note_nothing_drawn()
    console.write_files(files)
