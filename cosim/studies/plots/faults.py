"""Where faults begin and end, in figures over time: thin dotted lines."""

from collections.abc import Mapping

import matplotlib as mpl
from matplotlib.figure import Figure

from cosim.results.result import Result
from cosim.studies.plots.style import GREY, STYLE, legend


def mark(figures: dict[str, Figure], results: Mapping[str, Result]) -> dict[str, Figure]:
    """Draw a line at each time at which a fault of a run begins or ends, and return the figures."""
    faults = [fault for result in results.values() for fault in result.info.get("faults", ())]
    times = sorted({time for fault in faults for time in (fault["from"], fault["until"]) if time is not None})
    with mpl.rc_context(STYLE):
        for figure in figures.values() if times else ():
            for ax in (ax for ax in figure.axes if ax.get_visible()):
                for time in times:
                    ax.axvline(time, color=GREY, linewidth=1, linestyle=":", zorder=1, label="fault")
            if figure.legends:
                legend(figure)
    return figures
