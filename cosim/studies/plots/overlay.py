"""One figure over another of the same kind: the curves of a second run, pale and wide, behind those of the first."""

import re

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from cosim.studies.plots import style

PALE = 0.6
"""Part of white in the colour of a curve behind."""

WIDER = 2.2
ROUNDING = 1e-14  # of a power of ten that two figures do not share
_EXPONENT = re.compile(r"10\$\^\{(-?\d+)\}\$")


def overlay(figure: Figure, behind: Figure, word: str) -> None:
    """Draw the curves of `behind` into the panels of `figure` at the same places, called "LABEL, word".

    Curves that are equal in both are left as they are, and so are reference lines: limits are those of `figure`. A
    panel that one of both has not is left alone, and the power of ten of an axis is the figure's own.
    """
    there = {_place(ax): ax for ax in behind.axes if ax.get_visible()}
    with mpl.rc_context(style.STYLE):
        for ax in figure.axes:
            other = there.get(_place(ax))
            if other is not None and ax.get_visible():
                _put_behind(ax, other, word)
        style.legends_again(figure)


def note(figure: Figure, text: str) -> None:
    """Add a line to a figure's title."""
    with mpl.rc_context(style.STYLE):
        figure.suptitle(f"{figure.get_suptitle()}\n{text}")


def exponent_of(label: str) -> int:
    """Return the power of ten that stands in a label of `style.label`, 0 where none does."""
    found = _EXPONENT.search(label)
    return int(found[1]) if found else 0


def _put_behind(ax: Axes, other: Axes, word: str) -> None:
    factor = 10.0 ** (exponent_of(other.get_ylabel()) - exponent_of(ax.get_ylabel()))
    own = [line for line in ax.lines if _is_curve(line, ax)]
    for line in other.lines:
        if not _is_curve(line, other):
            continue
        x, y = np.asarray(line.get_xdata(), float), factor * np.asarray(line.get_ydata(), float)
        if any(_equal(x, y, twin) for twin in own):
            continue
        label = str(line.get_label())
        colour = tuple(PALE + (1 - PALE) * c for c in to_rgb(line.get_color()))
        ax.plot(
            x,
            y,
            color=colour,
            linewidth=WIDER * line.get_linewidth(),
            zorder=1.5,
            label=label if label.startswith("_") else f"{label}, {word}",
        )


def _is_curve(line: Line2D, ax: Axes) -> bool:
    """Whether a line is a curve over time, and no mark across the panel."""
    return line.get_transform() == ax.transData and len(np.atleast_1d(np.asarray(line.get_xdata()))) > 2


def _equal(x: np.ndarray, y: np.ndarray, line: Line2D) -> bool:
    mine = np.asarray(line.get_xdata(), float), np.asarray(line.get_ydata(), float)
    return all(
        a.shape == b.shape and np.allclose(a, b, rtol=ROUNDING, atol=0.0, equal_nan=True)
        for a, b in zip((x, y), mine, strict=True)
    )


def _place(ax: Axes) -> tuple[int, int] | None:
    spec = ax.get_subplotspec()
    return None if spec is None else (spec.rowspan.start, spec.colspan.start)
