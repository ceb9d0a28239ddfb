"""The figures of xiao2011: angles, rates, torque and modes, L2-gain (figures 1-4) and PID (5-8) overlaid."""

from collections.abc import Mapping, Sequence

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from cosim import plots
from cosim.metrics import series
from cosim.papers.claims import AXES
from cosim.papers.xiao2011.system import (
    L2,
    L2_LARGE,
    L2_LARGE_K5,
    L2_PRINTED,
    L2_UNCONSTRAINED,
    PID,
    PID_ANTIWINDUP,
    PID_LARGE,
    U_MAX,
)
from cosim.papers.xiao2011.tracking import angles, rates
from cosim.result import Result

Array = NDArray[np.float64]

SYMBOLS = (r"$\varphi$", r"$\theta$", r"$\psi$")
NAMES = [f"{symbol}, {axis}" for symbol, axis in zip(SYMBOLS, AXES, strict=True)]
SMALL = {L2: "L2-gain", PID: "PID"}
LARGE = {
    L2_LARGE: "L2-gain, k = 0.2",
    L2_LARGE_K5: "L2-gain, k = 5",
    PID_LARGE: "PID",
    PID_ANTIWINDUP: "PID, conditional integration",
}
RAW = {L2_UNCONSTRAINED: "L2-gain, no limit (Theorem 1)", L2: "L2-gain (Theorem 2)", PID: "PID"}
SCALES = {L2: "weights of g in 1/J", L2_PRINTED: "weights as printed"}


def figures(results: Mapping[str, Result]) -> dict[str, Figure]:
    """Return the paper's figures as far as `results` has the runs."""
    drawn: dict[str, Figure] = {}
    with mpl.rc_context(plots.STYLE):
        for case, named in (("S", SMALL), ("L", LARGE)):
            runs = _chosen(results, named)
            if not runs:
                continue
            what = f"case {case} (figures %s)"
            drawn[f"fig1-5_angles_{case}"] = _angles(runs, "Attitude in the orbit frame, " + what % "1, 5")
            drawn[f"fig2-6_rates_{case}"] = _rates(runs, "Body rate relative to the orbit frame, " + what % "2, 6")
            drawn[f"fig3-7_torque_{case}"] = _torque(runs, "Torque on the hub and its limit, " + what % "3, 7")
            if all(series(run, "plant.eta") is not None for run in runs.values()):
                drawn[f"fig4-8_modes_{case}"] = _modes(runs, "Modal coordinates, " + what % "4, 8")
        scales = _chosen(results, SCALES)
        if SCALES[L2_PRINTED] in scales:
            drawn["scale_of_the_weights"] = _angles(scales, "L2-gain, case S: scale of the weights")
        free = _chosen(results, RAW)
        if RAW[L2_UNCONSTRAINED] in free:
            drawn["raw_command"] = _raw(free)
    return drawn


def _chosen(results: Mapping[str, Result], names: Mapping[str, str]) -> dict[str, Result]:
    return {names[name]: results[name] for name in names if name in results and len(results[name]) > 1}


def _angles(runs: Mapping[str, Result], title: str) -> Figure:
    traces = {name: (run.time, np.degrees(angles(run))) for name, run in runs.items()}
    figure, _ = plots.stack(traces, NAMES, "deg", title)
    plots.legend(figure)
    return figure


def _rates(runs: Mapping[str, Result], title: str) -> Figure:
    traces = {name: (run.time, np.degrees(rates(run))) for name, run in runs.items()}
    figure, _ = plots.stack(traces, [rf"$\omega_{axis}$" for axis in "xyz"], "deg/s", title, width=1.0)
    plots.legend(figure)
    return figure


def _torque(runs: Mapping[str, Result], title: str) -> Figure:
    """Draw the torque on the hub with its limit, and the raw command, which leaves the axis (see `_raw`)."""
    names = [rf"$u_{i + 1}$, {axis}" for i, axis in enumerate(AXES)]
    figure, grid = _columns({name: (run.time, run["plant.tau_B"]) for name, run in runs.items()}, names, "N.m", title)
    for column, run in enumerate(runs.values()):
        for i, ax in enumerate(row[column] for row in grid):
            raw = run["controller.u"][:, i]
            ax.plot(run.time, raw, label="before the limiter", color=plots.GREY, linewidth=0.6, alpha=0.6, zorder=1)
            for side in (1, -1):
                ax.axhline(side * U_MAX, color=plots.GREY, linewidth=1, linestyle=plots.LINES[3], label="limit")
            ax.set_ylim(-2 * U_MAX, 2 * U_MAX)
    plots.legend(figure)
    return figure


def _modes(runs: Mapping[str, Result], title: str) -> Figure:
    names = [rf"$\eta_{i + 1}$" for i in range(3)]
    return _columns({name: (run.time, run["plant.eta"]) for name, run in runs.items()}, names, "kg(1/2).m", title)[0]


def _columns(
    traces: Mapping[str, tuple[Array, Array]], names: Sequence[str], unit: str, title: str
) -> tuple[Figure, list[list[Axes]]]:
    """Draw a column a run, of equal scales: what oscillates fast hides what is drawn over it."""
    figure, grid = plots.panels(len(names), len(traces), title)
    figure.set_size_inches(max(8.0, 3.2 * len(traces)), figure.get_size_inches()[1])
    for column, (name, (time, _)) in enumerate(traces.items()):
        grid[0][column].set_title(name)
        for row in grid:
            row[column].set_xlim(0, float(time[-1]))
    for i, (row, quantity) in enumerate(zip(grid, names, strict=True)):
        exponent = plots.scale([rows[:, i] for _, rows in traces.values()])
        reach = 1.1 * max(float(np.max(np.abs(rows[:, i]))) for _, rows in traces.values()) / 10.0**exponent
        for column, (ax, (time, rows)) in enumerate(zip(row, traces.values(), strict=True)):
            ax.plot(time, rows[:, i] / 10.0**exponent, color=plots.COLOURS[column], linewidth=0.8)
            if reach > 0:
                ax.set_ylim(-reach, reach)
        row[0].set_ylabel(plots.label(quantity, unit, exponent))
    figure.align_ylabels([row[0] for row in grid])
    return figure, grid


def _raw(runs: Mapping[str, Result]) -> Figure:
    """Draw the command before the limiter, on a logarithmic axis: it is far beyond what wheels give."""
    figure, grid = plots.panels(3, 1, "Command before the limiter, absolute value, case S")
    for i, (ax,) in enumerate(grid):
        for index, (name, run) in enumerate(runs.items()):
            rows = np.abs(run["controller.u"][:, i])
            ax.plot(run.time, np.where(rows > 0, rows, np.nan), label=name, color=plots.COLOURS[index], linewidth=0.8)
        ax.axhline(U_MAX, color=plots.GREY, linewidth=1, linestyle=plots.LINES[3], label="limit")
        ax.set_yscale("log")
        ax.set_ylim(1e-5, 1e4)
        ax.set_xlim(0, 100)
        ax.set_ylabel(plots.label(rf"$|u_{i + 1}|$, {AXES[i]}", "N.m"))
    figure.align_ylabels([row[0] for row in grid])
    plots.legend(figure)
    return figure
