"""The command line, `adcs`: each command here or in a module of its own. What it does is in what it calls.

A command imports what it needs: what flies and draws takes longer to import than a rebuild of nothing takes.
"""

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cosim.cli import building, comparing, completion, console, ending, exporting, plotting, resuming, verifying
from cosim.cli import events as happening
from cosim.cli import faults as failing
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
    Version,
    reported,
    times,
)
from cosim.results.names import FORMATS
from cosim.time import parse_seconds

if TYPE_CHECKING:
    from cosim.cli.ending import Progress
    from cosim.results.result import Result

HELP = """Spacecraft attitude-control co-simulation with FMI 2.0 FMUs.

First steps: adcs list, then adcs run zhang2018-ppatc --plot.

FMUs that are built, and the compiled kernel, are kept in $ADCS_BUILD, else in the user's cache folder (on Linux
~/.cache/adcs-cosim)."""

app = typer.Typer(
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
    help=HELP,
)


@app.callback()
def adcs(version: Version = False) -> None:
    """Everything before a command's name."""


@app.command("list")
def list_() -> None:
    """List components, systems and papers, a line each."""
    from cosim.studies import papers
    from fmus.export.build import component_docs

    with reported():
        console.write_listing("components (adcs build NAME)", component_docs())
        console.write_listing("systems (adcs run NAME)", papers.describe())
        console.write_listing(
            "papers (adcs reproduce NAME)", {key: paper.title for key, paper in papers.PAPERS.items()}
        )


app.command("build")(building.build_)


@app.command("show")
def show_(
    name: Annotated[
        str,
        typer.Argument(
            metavar="NAME",
            autocompletion=completion.everything,
            help="SYSTEM, a component (NAME or FILE.py:Class), FILE.py[:function], FILE.ssp, FILE.fmu, or a result "
            "folder.",
        ),
    ],
    stop: Stop = None,
    step: Step = None,
    backend: Backend = "native",
    master: Master = None,
    inputs: Inputs = None,
    extrapolation: Extrapolation = None,
    fault: failing.FaultFiles = None,
) -> None:
    """Show a system's wiring, a component's equations and variables, an FMU's interface, or what a run has left.

    A folder that has the name of a system is meant by ./NAME.
    """
    from cosim.cli import component_page, flown, instances, overrides, scenario, show
    from cosim.cli.library import Library
    from cosim.studies import papers
    from cosim.system.reference import is_fmu
    from fmus.export.build import is_component

    with reported():
        locate = Library(backend, console.note)
        if is_fmu(name):
            show.write_fmu(locate(name), foreign=True)
        elif is_component(name):
            component_page.write_component(name)
        elif flown.is_result(Path(name)) and name not in papers.describe():
            flown.write_result(Path(name))
        else:
            try:
                with instances.components_too():
                    system, experiment = scenario.load(name, *times(stop, step))
            except scenario.NoScenario:  # a file with a component alone
                component_page.write_component(name)
                return
            experiment = overrides.with_experiment(
                experiment, step, stop, master=master, inputs=inputs, extrapolation=extrapolation
            )
            show.write_system(system, failing.with_faults(experiment, fault or []), locate)


@app.command()
def run(
    context: typer.Context,
    name: resuming.Named = None,
    changes: happening.Changes = None,
    use: Use = None,
    set_: Set = None,
    params: Params = None,
    input_: feeding.Input = None,
    interpolation: feeding.Interpolated = "linear",
    hold: feeding.Hold = None,
    at: happening.AtTime = None,
    fault: failing.FaultFiles = None,
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
    checkpoint: resuming.Checkpoints = None,
    resume: resuming.Resume = None,
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

    if resume is not None:
        with reported():
            resuming.fly_on(context, resume, stop, plot=plot)
        return
    if name is None:
        raise typer.BadParameter("say what is to fly, or go on with a run: --resume DIR", param_hint="NAME")
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
        experiment = happening.with_events(experiment, at or [], changes or [])
        experiment = failing.with_faults(experiment, fault or [])
        system, experiment = with_isolation(system, experiment, isolate, isolation_timeout)
        folder = out if out is not None else Path("results") / system.name

        def fly(progress: "Progress") -> "Result":
            return simulate(
                system,
                experiment,
                out=folder,
                locate=locate,
                progress=progress,
                format=format,
                overwrite=force,
                swaps=swaps,
                metrics=lambda run: metrics.measure(run, threshold),
                checkpoint=None if checkpoint is None else parse_seconds(checkpoint, "--checkpoint"),
            )

        changed = (
            fed or None,
            at,
            fault,
            set_,
            params,
            step,
            every,
            master,
            inputs,
            extrapolation,
            tolerance,
            master_tolerance,
        )
        as_published = not any(option not in (None, []) for option in changed)
        if checkpoint is not None:
            system = replace(system, source=resuming.noted(system, name, threshold, as_published))
        ending.fly(name, system, fly, locate if plot else None, as_published)


app.command("plot")(plotting.plot_)
app.command("metrics")(plotting.metrics_)
app.command("verify")(verifying.verify_)
app.command("export")(exporting.export_)


@app.command("reproduce")
def reproduce_(
    names: Annotated[
        list[str] | None,
        typer.Argument(metavar="[PAPER]...", autocompletion=completion.paper_keys, help="Papers; all if none."),
    ] = None,
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


app.command("compare")(comparing.compare_)
