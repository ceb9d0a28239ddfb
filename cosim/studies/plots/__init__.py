"""Figures of runs.

style.py      how they look, how they are written
standard.py   those that any attitude run has: attitude, rates, torque, modes, with
clusters.py   wheels and gyros
estimates.py  sensors and estimators, less the truth
variables.py  variables by name, the difference of two runs
overlay.py    one figure over another
marks.py      lines where events are, where faults begin and end
pages.py, shown.py   panels of any variables; their units and the names of their components
"""

from cosim.studies.plots.standard import draw, limits
from cosim.studies.plots.style import (
    COLOURS,
    DPI,
    GREY,
    KINDS,
    LINES,
    STYLE,
    asked_and_given,
    beyond_linear,
    check_kinds,
    fill,
    label,
    legend,
    look,
    panels,
    save,
    scale,
    stack,
    thin,
    traces_of,
)
from cosim.studies.plots.variables import NothingInCommon, draw_difference, draw_variables

__all__ = [
    "COLOURS",
    "DPI",
    "GREY",
    "KINDS",
    "LINES",
    "STYLE",
    "NothingInCommon",
    "asked_and_given",
    "beyond_linear",
    "check_kinds",
    "draw",
    "draw_difference",
    "draw_variables",
    "fill",
    "label",
    "legend",
    "limits",
    "look",
    "panels",
    "save",
    "scale",
    "stack",
    "thin",
    "traces_of",
]
