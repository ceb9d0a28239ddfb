"""Figures of any variables: a panel each, its components in colours, runs in line styles."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from cosim.arrays import FloatArray
from cosim.studies.plots import style

HEIGHT = 1.9  # inch of a panel
A_PAGE = 6
"""Panels of a figure."""

COLOURS = (*style.COLOURS, "#999999", "#8c510a", "#762a83")
COLOUR = {"x": 0, "y": 1, "z": 2, "w": 3, "": 0}
"""Component -> its colour; those that are counted have colours in their order."""


@dataclass(frozen=True)
class Trace:
    """A variable of one run as it is drawn: rows of shape (n, number of components), in the panel's unit.

    `bound`: what they are expected to stay within, to either side, of the same shape.
    """

    run: str
    time: FloatArray
    rows: FloatArray
    bound: FloatArray | None = None


@dataclass(frozen=True)
class Panel:
    """A variable of all runs that have it: its name, unit and the names of its components."""

    name: str
    unit: str
    components: Sequence[str]
    traces: Sequence[Trace]


def draw_panels(panels: Sequence[Panel], file: str, title: str) -> dict[str, Figure]:
    """Return the figures of panels by file name, `A_PAGE` panels each: `file`, `file_2`, ... ."""
    pages = [panels[i : i + A_PAGE] for i in range(0, len(panels), A_PAGE)]
    runs = list(dict.fromkeys(trace.run for panel in panels for trace in panel.traces))
    counted = f"{title} (%d of {len(pages)})" if len(pages) > 1 else title
    with mpl.rc_context(style.STYLE):
        return {
            file if k == 0 else f"{file}_{k + 1}": _page(page, runs, counted % (k + 1) if len(pages) > 1 else counted)
            for k, page in enumerate(pages)
        }


def _page(page: Sequence[Panel], runs: Sequence[str], title: str) -> Figure:
    figure, grid = style.panels(len(page), 1, title, height=HEIGHT)
    axes = [line[0] for line in grid]
    for ax, panel in zip(axes, page, strict=True):
        exponent = style.scale(trace.rows for trace in panel.traces)
        for trace in panel.traces:
            _draw(ax, panel, trace, runs, exponent)
        ax.set_ylabel(style.label(panel.name, panel.unit, exponent))
        ax.margins(x=0.01)
    names = list(dict.fromkeys(c for panel in page for c in panel.components if c))
    _explain(axes[0], names, runs)
    figure.align_ylabels(axes)
    style.legend(figure, columns=8)
    style.fit_labels(axes, 0.9 * HEIGHT * figure.dpi)
    return figure


def _draw(ax: Axes, panel: Panel, trace: Trace, runs: Sequence[str], exponent: int) -> None:
    for i, component in enumerate(panel.components[: trace.rows.shape[1]]):
        values = np.asarray(trace.rows[:, i], dtype=float) / 10.0**exponent
        ax.plot(trace.time, values, color=_colour(component), linestyle=_line(trace.run, runs), linewidth=1.2)
        if trace.bound is None:
            continue
        for side in (-1, 1):
            edge = side * np.asarray(trace.bound[:, i], dtype=float) / 10.0**exponent
            ax.plot(trace.time, edge, color=_colour(component), linestyle=style.LINES[3], linewidth=0.8, alpha=0.7)


def _explain(ax: Axes, components: Iterable[str], runs: Sequence[str]) -> None:
    """Give the legend a line for each colour, and for each run where there are several or no components."""
    named: dict[str, list[str]] = {}
    for component in components:
        named.setdefault(_colour(component), []).append(component)
    for colour, of_one in named.items():
        ax.plot([], [], color=colour, label=" or ".join(of_one))
    if len(runs) > 1 or not named:
        colour = style.GREY if named else _colour("")
        for run in runs:
            ax.plot([], [], color=colour, linestyle=_line(run, runs), label=run)


def _colour(component: str) -> str:
    place = COLOUR.get(component)
    if place is None:
        place = int(component.partition(",")[2] or component) - 1
    return COLOURS[place % len(COLOURS)]


def _line(run: str, runs: Sequence[str]) -> object:
    return style.LINES[list(runs).index(run) % len(style.LINES)]
