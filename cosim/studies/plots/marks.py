"""When something happens to a run, in figures over time: thin lines, dotted for faults, dashed for events."""

from collections.abc import Iterator, Mapping

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from cosim.results.result import Result
from cosim.studies.plots.style import GREY, STYLE, TIME, legends_again

LINES = {"event": "--", "fault": ":"}
"""What happens, and how its line is drawn."""


def mark(figures: dict[str, Figure], results: Mapping[str, Result]) -> dict[str, Figure]:
    """Draw a line where a parameter of a run changes, and where a fault begins or ends; return the figures."""
    marks = sorted({mark for result in results.values() for mark in _marks(result)})
    with mpl.rc_context(STYLE):
        for figure in figures.values() if marks else ():
            for ax in filter(_is_over_time, figure.axes):
                begin, end = ax.get_xlim()
                for time, what in (mark for mark in marks if begin <= mark[0] <= end):
                    ax.axvline(time, color=GREY, linewidth=1, linestyle=LINES[what], zorder=1, label=what)
            legends_again(figure)
    return figures


def _marks(result: Result) -> Iterator[tuple[float, str]]:
    """Yield what has happened by the last row: when, s, and what."""
    times = [(event["time"], "event") for event in result.info.get("events", ())]
    for fault in result.info.get("faults", ()):
        times += [(time, "fault") for time in (fault["from"], fault["until"]) if time is not None]
    yield from (mark for mark in times if mark[0] <= result.time[-1])


def _is_over_time(ax: Axes) -> bool:
    """Whether a panel is seen and over time, which the last one of its column says."""
    return ax.get_visible() and any(a.get_xlabel() == TIME for a in ax.get_shared_x_axes().get_siblings(ax))
