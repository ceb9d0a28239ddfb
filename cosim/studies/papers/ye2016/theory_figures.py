"""Figures beside those of ye2016: V of its theorem, and the terms that its equation (4) neglects."""

from collections.abc import Mapping

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from cosim.results.result import Result
from cosim.studies import plots
from cosim.studies.papers.ye2016.full_model import OUTSIDE, TERMS, neglected
from cosim.studies.papers.ye2016.theory import FLIGHTS, error, storage


def draw_storage(runs: Mapping[str, Result], names: Mapping[str, str]) -> Figure:
    """Draw what V has lost since the start, and the integral of e^T Q e / 2, for the flights that there are."""
    from scipy.integrate import cumulative_simpson

    with mpl.rc_context(plots.STYLE):
        figure, grid = plots.panels(
            len(runs), 1, "V of equation (23): what it has lost, and the integral of its theorem"
        )
        for (ax,), (name, run) in zip(grid, runs.items(), strict=True):
            V, rows = storage(run, FLIGHTS[name]), np.sum(error(run) ** 2, axis=1) / 2
            lost = cumulative_simpson(rows, x=run.time, initial=0)
            ax.plot(run.time, V[0] - V, color=plots.COLOURS[0], label="$V(0) - V(t)$")
            ax.plot(run.time, lost, color=plots.COLOURS[1], linestyle=plots.LINES[1], label=r"$\int e^T Q e / 2$")
            ax.set_title(f"{names[name]}: $V(0)$ = {V[0]:.4g} 1/s")
            ax.set_ylabel("loss (1/s)")
        plots.legend(figure)
    return figure


def draw_terms(run: Result) -> Figure:
    """Draw the size of the neglected terms over the run, each with the torque from outside."""
    with mpl.rc_context(plots.STYLE):
        figure, grid = plots.panels(len(TERMS), 1, "Terms that the paper's equation (4) neglects, on the full model")
        for (ax,), rows, (_, symbol) in zip(grid, neglected(run).values(), TERMS.values(), strict=True):
            ax.semilogy(run.time, np.where(rows > 0, rows, np.nan), label="term", color=plots.COLOURS[0], linewidth=1)
            ax.axhline(OUTSIDE, color=plots.GREY, linestyle=plots.LINES[1], label="torque from outside, 1e-5 N m")
            ax.set_ylim(bottom=1e-9)
            ax.set_ylabel(plots.label(symbol, "N.m"))
        plots.legend(figure)
    return figure
