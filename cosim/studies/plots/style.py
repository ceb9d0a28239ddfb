"""How figures look: panels, colours, labels, legends; drawn without a display.

Every axis names its quantity and unit; angles are in degrees. Runs differ in colour (Okabe-Ito, safe for the colour
blind) and in line style. Small numbers are shown times a power of ten that stands in the label.
"""

import textwrap
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, cast

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from cosim.arrays import FloatArray
from cosim.errors import UnknownName
from cosim.results.folder import make_folder, writing
from cosim.results.result import Result

COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
LINES: tuple[Any, ...] = ("-", (0, (5, 1.5)), (0, (6, 1.5, 1.2, 1.5)), (0, (1.2, 1.2)))
GREY = "#606060"
DPI = 150
SMALLEST = 5.0  # points of a label
TIME = "time (s)"
MARGIN = 0.01  # of a figure's width, left free by its legend
UNDATED: Mapping[str, dict[str, Any]] = {"png": {}, "pdf": {"CreationDate": None}, "svg": {"Date": None}}
KINDS = tuple(UNDATED)
"""Formats of figures; what a file would have of the clock is left out, so that equal figures are equal files."""
STYLE: dict[Any, Any] = {
    "font.size": 10,
    "axes.labelsize": 10,
    "axes.titlesize": 10,
    "figure.titlesize": 12,
    "legend.fontsize": 10,
    "legend.frameon": False,
    "axes.grid": True,
    "grid.color": "#d9d9d9",
    "grid.linewidth": 0.6,
    "axes.axisbelow": True,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.formatter.useoffset": False,
    "lines.linewidth": 1.4,
    "figure.constrained_layout.use": True,
    "svg.hashsalt": "adcs-cosim",  # of the names within, else random
}
UNITS = {
    "N.m": "N m",
    "N.m.s": "N m s",
    "kg^(1/2).m": r"kg$^{1/2}$ m",
    "kg^(1/2).m/s": r"kg$^{1/2}$ m/s",
    "rad/s2": r"rad/s$^2$",
}


def check_kinds(kinds: Sequence[str]) -> None:
    """Raise `UnknownName` for a format that figures are not written in."""
    for kind in kinds:
        if kind not in KINDS:
            raise UnknownName("format", kind, "figures", KINDS)


def save(
    figures: Mapping[str, Figure],
    folder: Path | str,
    kinds: Sequence[str] = ("png",),
    size: tuple[float, float] | None = None,
    dpi: int = DPI,
) -> list[Path]:
    """Write the figures to folder/<name>.<kind> and return the files; `size` in inch, None: as they were drawn.

    Raises `UnknownName` for a kind that there is not, `ResultUnwritable`.
    """
    check_kinds(kinds)
    folder = Path(folder)
    make_folder(folder)
    files: list[Path] = []
    with mpl.rc_context(STYLE):
        for name, figure in figures.items():
            if size is not None:
                resize(figure, *size)
            for kind in kinds:
                file = folder / f"{name}.{kind}"
                with writing(file):
                    figure.savefig(file, dpi=dpi, metadata=UNDATED[kind])
                files.append(file)
    return files


def resize(figure: Figure, width: float, height: float) -> None:
    """Give a figure another size in inch: title and legend go onto as many lines, labels get as small, as it takes."""
    figure.set_size_inches(width, height)
    title = figure.get_suptitle()
    if title:
        letters = width * 72 / (0.55 * float(figure._suptitle.get_fontsize()))  # pyright: ignore[reportAttributeAccessIssue]
        figure.suptitle("\n".join(textwrap.wrap(title, max(10, int(letters)), break_long_words=False)))
    if figure.legends:
        legend(figure, columns=len(figure.legends[0].texts))
    figure.draw_without_rendering()
    axes = [ax for ax in figure.axes if ax.get_visible()]
    fit_labels(axes, min((ax.get_window_extent().height for ax in axes), default=0.0))


def fit_labels(axes: Sequence[Axes], height: float) -> None:
    """Make the labels of panels no longer than the panels are high, in dots, by smaller letters, the same for all."""
    labels = [ax.yaxis.label for ax in axes if ax.get_ylabel()]
    part = min((height / max(label.get_window_extent().height, 1.0) for label in labels), default=1.0)
    for label in labels if part < 1 else ():
        label.set_fontsize(max(SMALLEST, part * float(label.get_fontsize())))


def panels(rows: int, columns: int = 1, title: str = "", height: float = 1.75) -> tuple[Figure, list[list[Axes]]]:
    """Return an empty figure and its axes [row][column]; the axes of a column share their time axis."""
    figure = Figure(figsize=(8.0, 1.3 + height * rows))
    FigureCanvasAgg(figure)
    axes = cast("list[list[Axes]]", figure.subplots(rows, columns, sharex="col", squeeze=False).tolist())
    if title:
        figure.suptitle(title)
    for ax in axes[-1]:
        ax.set_xlabel(TIME)
    return figure, axes


def look(index: int) -> dict[str, Any]:
    """Return colour and line style of the index-th run."""
    return {"color": COLOURS[index % len(COLOURS)], "linestyle": LINES[index % len(LINES)]}


def thin(look: Mapping[str, Any], width: float, **changes: Any) -> dict[str, Any]:
    """Return a look with another line width, in points, and what else is to change."""
    return {**look, "linewidth": width, **changes}


def asked_and_given(
    ax: Axes,
    time: FloatArray,
    asked: FloatArray,
    given: FloatArray,
    limits: Sequence[float] = (),
    index: int = 0,
    given_label: str = "",
) -> None:
    """Draw a raw command thinly, over it what was given, and the limits; given_label: "given" unless it is said."""
    ax.plot(time, asked, label="asked", color="#000000", linewidth=0.8, alpha=0.6, zorder=2)
    ax.plot(time, given, label=given_label or "given", linewidth=1.2, **look(index))
    for value in limits:
        ax.axhline(value, color=GREY, linewidth=1, linestyle=LINES[3], label="limit")
    ax.margins(x=0.01)


def beyond_linear(ax: Axes, threshold: float, largest: float) -> None:
    """Make an axis linear within +-2 thresholds and logarithmic beyond, to the power of ten above the largest value."""
    top = max(2, int(np.ceil(np.log10(max(largest, 10 * threshold) / threshold))))
    edge = 10.0 ** np.ceil(np.log10(threshold * 10.0**top))
    marks = [threshold, *(edge / 100**k for k in range(top) if edge / 100**k > 5 * threshold)]
    ax.set_yscale("symlog", linthresh=2 * threshold, linscale=1.5)
    ax.set_ylim(-edge, edge)
    ax.set_yticks([side * v for side in (-1, 1) for v in marks], [f"{side * v:g}" for side in (-1, 1) for v in marks])
    ax.minorticks_off()


def legend(figure: Figure, columns: int = 4) -> None:
    """Put one legend under the panels, each label once, in as many columns, `columns` at most, as the page is wide."""
    entries = _entries(figure.axes)
    for older in list(figure.legends):
        older.remove()
    renderer = FigureCanvasAgg(figure).get_renderer()
    for count in range(min(columns, len(entries)), 0, -1):
        made = figure.legend(entries.values(), entries.keys(), loc="outside lower center", ncols=count)
        if made.get_window_extent(renderer).width <= (1 - MARGIN) * figure.bbox.width or count == 1:
            return
        made.remove()


def legends_again(figure: Figure) -> None:
    """Make the legends anew that a figure and its panels have, with what has been drawn since."""
    if figure.legends:
        legend(figure, columns=max(4, len(figure.legends[0].texts)))
    for ax in figure.axes:
        if (own := ax.get_legend()) is not None:
            entries = _entries([ax])
            ax.legend(entries.values(), entries.keys(), loc="lower left", fontsize=own.get_texts()[0].get_fontsize())


def _entries(axes: Iterable[Axes]) -> dict[str, Any]:
    """Return what a legend has, label -> handle, each label once."""
    entries: dict[str, Any] = {}
    for ax in axes:
        handles, labels = ax.get_legend_handles_labels()
        entries |= {label: handle for handle, label in zip(handles, labels, strict=True) if label not in entries}
    return entries


def label(name: str, unit: str | None, exponent: int = 0) -> str:
    """Return "name (10^-4 unit)", set for matplotlib; the unit 1 is written where no power of ten is."""
    text = "" if unit is None or (unit == "1" and exponent) else UNITS.get(unit, unit)
    power = rf"10$^{{{exponent}}}$" if exponent else ""
    inside = " ".join(part for part in (power, text) if part)
    return f"{name} ({inside})" if inside else name


def scale(values: Iterable[FloatArray]) -> int:
    """Return the exponent of ten to divide by so that an axis has handy numbers; 0 for all but small and large ones."""
    largest = max((peak(v) for v in values), default=0.0)
    if largest == 0.0 or 1e-2 <= largest < 1e4:
        return 0
    return int(np.floor(np.log10(largest)))


def stack(
    traces: Mapping[str, tuple[FloatArray, FloatArray]],
    names: Sequence[str],
    unit: str,
    title: str,
    columns: int = 1,
    width: float = 1.4,
) -> tuple[Figure, list[Axes]]:
    """Return a figure with one panel per component and one line per trace, label -> (time, rows)."""
    figure, grid = panels(-(-len(names) // columns), columns, title)
    axes = [grid[i % len(grid)][i // len(grid)] for i in range(len(names))]
    for unused in (ax for line in grid for ax in line if ax not in axes):
        unused.set_visible(False)
    fill(axes, traces, names, unit, width)
    for i, ax in enumerate(axes):
        if (i + 1) % len(grid) == 0 or i + 1 == len(axes):
            ax.set_xlabel(TIME)
            ax.tick_params(labelbottom=True)
    figure.align_ylabels(axes)
    return figure, axes


def fill(
    axes: Sequence[Axes],
    traces: Mapping[str, tuple[FloatArray, FloatArray]],
    names: Sequence[str],
    unit: str,
    width: float = 1.4,
) -> list[int]:
    """Draw column i of every trace into panel i, much wider swings behind; return the panels' exponents of ten."""
    largest = max(peak(rows) for _, rows in traces.values())
    exponents: list[int] = []
    for i, (ax, name) in enumerate(zip(axes, names, strict=True)):
        shown = [(k, n, t, rows[:, i]) for k, (n, (t, rows)) in enumerate(traces.items()) if rows.shape[1] > i]
        exponent = scale(values for *_, values in shown)
        if max(peak(values) for *_, values in shown) < 1e-9 * largest:  # rounding is not shown as if it were a motion
            exponent = scale([np.array([largest])])
            ax.set_ylim(-1, 1)
        for index, label_, time, values in shown:
            depth = sum(2 * peak(other) < peak(values) for *_, other in shown)
            ax.plot(time, values / 10.0**exponent, label=label_, linewidth=width, zorder=3 - depth / 100, **look(index))
        ax.set_ylabel(label(name, unit, exponent))
        ax.margins(x=0.01)
        exponents.append(exponent)
    return exponents


def peak(rows: FloatArray) -> float:
    """Return the largest absolute value that is finite, 0 if there is none."""
    finite = np.abs(rows[np.isfinite(rows)])
    return float(finite.max()) if finite.size else 0.0


def traces_of(
    results: Mapping[str, Result], rows: Callable[[Result], FloatArray | None]
) -> dict[str, tuple[FloatArray, FloatArray]]:
    """Return label -> (time, rows) for the runs that have the quantity."""
    found: dict[str, tuple[FloatArray, FloatArray]] = {}
    for name, result in results.items():
        values = rows(result)
        if values is not None and values.size:
            found[name] = (result.time, values)
    return found
