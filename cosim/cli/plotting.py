"""adcs plot and adcs metrics: figures of result folders, and their metrics in one table."""

import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cosim.cli import console
from cosim.cli.options import reported
from cosim.errors import ResultUnreadable, SimulationError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from cosim.results.result import Result
    from cosim.studies.metrics import MetricTable

SMALLEST, LARGEST = 1.0, 100.0
"""Inch, of a side of a figure."""

Settled = Annotated[
    str | None,
    typer.Option(metavar="ANGLE", help="Threshold of the settling times, as in '0.005 deg'. Default: each run's own."),
]


class PlotError(SimulationError):
    """What `adcs plot` cannot do with what it was given; the text says what would do."""


def plot_(
    folders: Annotated[list[Path], typer.Argument(help="Result folders; several are overlaid.")],
    variables: Annotated[
        list[str] | None,
        typer.Option("--vars", metavar="PATTERN", help="Draw these variables only, as in 'plant.omega_*'; repeatable."),
    ] = None,
    difference: Annotated[
        bool, typer.Option("--difference", help="Draw the second run less the first, at the times of both.")
    ] = False,
    published: Annotated[
        bool,
        typer.Option("--published", help="Fly the paper's experiment unchanged too, and draw it behind its figures."),
    ] = False,
    format: Annotated[str, typer.Option(help="png, pdf or svg; several with commas.")] = "png",
    size: Annotated[
        str | None, typer.Option(metavar="WxH", help="Inch, as in 6x4. Default: each figure's own.")
    ] = None,
    dpi: Annotated[int, typer.Option(help="Dots an inch, of png.", min=20, max=1200)] = 150,
    out: Annotated[
        Path | None, typer.Option("--out", "-o", help="Folder for the figures. Default: the first result's.")
    ] = None,
) -> None:
    """Draw one run, or several overlaid; of several the metrics too, in one table.

    Drawn are attitude, rates, torque, modes, clusters, and sensors and estimators less the truth, as far as a run has
    them, and the figures of a run's paper.
    """
    from cosim.studies import metrics, plots

    with reported():
        kinds = [kind.strip() for kind in format.split(",")]
        plots.check_kinds(kinds)
        inches = None if size is None else parse_size(size)
        if difference and len(folders) != 2:
            raise PlotError(f"--difference is of two results, the second less the first; {len(folders)} are named.")
        results = read_runs(folders)
        notes: Sequence[str] = ()
        if difference:
            figures, words = plots.draw_difference(results, variables or ())
            notes = [words]
        elif variables:
            figures = plots.draw_variables(results, variables)
        else:
            figures, notes = _all(results, published)
        drawn = plots.save(figures, out or folders[0], kinds, inches, dpi)
        if len(results) > 1:
            _write_table(metrics.tabulate(results))
        for path in drawn:
            typer.echo(path)
        for note in notes:
            console.note(note)
        if not drawn:
            console.note_nothing_drawn()


def draw_runs(
    results: "Mapping[str, Result]", locate: Callable[[Any], Path], published: "Mapping[str, Result] | None" = None
) -> "tuple[dict[str, Figure], Sequence[str]]":
    """Return the figures that any attitude run has and those of the runs' papers, and what is to be said of them."""
    from cosim.studies import plots
    from cosim.studies.papers.overlaid import draw_papers

    of_papers = draw_papers(results, locate, published)
    return plots.draw(results) | of_papers.figures, of_papers.notes


def _all(results: "Mapping[str, Result]", published: bool) -> "tuple[dict[str, Figure], Sequence[str]]":
    from cosim.cli.library import Library
    from cosim.studies.papers.overlaid import fly_published

    locate = Library(note=console.note)
    if not published:
        return draw_runs(results, locate)
    with console.progress("published") as progress:
        flown = fly_published(list(results.values()), locate, progress, console.note)
    if not flown:
        systems = ", ".join(dict.fromkeys(run.info.get("system", "unknown") for run in results.values()))
        raise PlotError(
            f"--published: no result is of a paper's experiment with the FMUs of the paper, here is {systems}. "
            "Those experiments are listed by adcs list."
        )
    return draw_runs(results, locate, flown)


def metrics_(
    folders: Annotated[list[Path], typer.Argument(help="Result folders, of any systems.")],
    format: Annotated[str, typer.Option(help="text, csv, markdown or json.")] = "text",
    settled: Settled = None,
) -> None:
    """Print the metrics of runs in one table, a column a run; blank where a run has none of that name.

    They are taken from the rows of the results.
    """
    from cosim.cli import overrides
    from cosim.studies import metrics
    from cosim.studies.metrics import table as tables

    with reported():
        if format != "text":
            tables.check_format(format)
        threshold = None if settled is None else overrides.parse_degrees(settled, "--settled")
        results = read_runs(folders)
        table = metrics.tabulate(results, threshold)
        if format == "text":
            _write_table(table)
        else:
            typer.echo(table.write(format), nl=False)
        for name, run in results.items():
            if missing := metrics.not_measured(run):
                console.note(f"{name}: not measured: {missing}")


def read_runs(folders: Sequence[Path]) -> "Mapping[str, Result]":
    """Return the results in folders by their names, those of one name by their paths; raises `ResultUnreadable`."""
    from cosim.results.result import Result

    folders = list(dict.fromkeys(folders))
    names = [folder.resolve().name for folder in folders]
    labels = [n if names.count(n) == 1 else str(folder) for n, folder in zip(names, folders, strict=True)]
    results = {label: Result.read(folder) for label, folder in zip(labels, folders, strict=True)}
    for label, folder in zip(labels, folders, strict=True):
        if len(results[label]) < 2:
            rows = "one row" if len(results[label]) else "no row"
            raise ResultUnreadable(folder, f"its run has recorded {rows}, nothing can be drawn or measured of it")
    return results


def parse_size(text: str) -> tuple[float, float]:
    """Return width and height of "6x4", inch; raises `PlotError`."""
    found = re.fullmatch(r"\s*(\d+\.?\d*|\.\d+)\s*[xX]\s*(\d+\.?\d*|\.\d+)\s*", text)
    if found is None:
        raise PlotError(f"--size {text!r} is no size. Write width x height in inch, as in 6x4 or 3.5x2.5.")
    width, height = map(float, found.groups())
    for name, side in (("width", width), ("height", height)):
        if not SMALLEST <= side <= LARGEST:
            raise PlotError(
                f"--size {text!r}: a {name} of {side:g} inch; it must be {SMALLEST:g} to {LARGEST:g} inch. "
                "Write it in inch, as in 6x4."
            )
    return width, height


def _write_table(table: "MetricTable") -> None:
    console.write_table(table.head, list(table.lines()), whole=(0,))
