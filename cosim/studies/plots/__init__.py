"""Figures: how they look (style.py), and those that any attitude run has (standard.py)."""

from cosim.studies.plots.standard import draw, limits
from cosim.studies.plots.style import (
    COLOURS,
    DPI,
    GREY,
    LINES,
    STYLE,
    asked_and_given,
    beyond_linear,
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

__all__ = [
    "COLOURS",
    "DPI",
    "GREY",
    "LINES",
    "STYLE",
    "asked_and_given",
    "beyond_linear",
    "draw",
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
