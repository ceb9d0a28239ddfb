"""The figures of xiao2011: angles, rates, torque and modes, L2-gain (figures 1-4) and PID (5-8) overlaid."""

from collections.abc import Mapping
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from cosim.results.result import Result
from cosim.studies import plots
from cosim.studies.metrics import series, settings
from cosim.studies.papers.claims import AXES
from cosim.studies.papers.xiao2011 import storage
from cosim.studies.papers.xiao2011.system import (
    L2,
    L2_LARGE,
    L2_LARGE_K5,
    L2_PRINTED,
    L2_UNCONSTRAINED,
    NO_FEEDFORWARD,
    OVERLOADED,
    PID,
    PID_ANTIWINDUP,
    PID_LARGE,
    SHAKEN,
    TRACKING,
    U_MAX,
)
from cosim.studies.papers.xiao2011.tracking import angles, deviation, rates

SYMBOLS = (r"$\varphi$", r"$\theta$", r"$\psi$")
NAMES = [f"{symbol}, {axis}" for symbol, axis in zip(SYMBOLS, AXES, strict=True)]
SMALL = {L2: "L2-gain", PID: "PID"}
LARGE = {
    L2_LARGE: "L2-gain, k = 0.2",
    L2_LARGE_K5: "L2-gain, k = 5",
    PID_LARGE: "PID",
    PID_ANTIWINDUP: "PID, conditional integration",
}
MOVING = {TRACKING: "L2-gain", NO_FEEDFORWARD: "without the derivatives of $y_d$"}
PROVED = {
    SHAKEN: "Theorem 1: shaken, no limit",
    OVERLOADED: "Theorem 2: more torque from outside than the limit",
}
UNLIMITED = "L2-gain, no limit (Theorem 1)"
RAW_SMALL = {L2_UNCONSTRAINED: UNLIMITED, **SMALL}
SCALES = {L2: "L2-gain", L2_PRINTED: "L2-gain, weights as printed"}
LOOKS: dict[str, dict[str, Any]] = {  # one look for a law, in every figure
    "L2-gain": {"color": plots.COLOURS[0], "linestyle": plots.LINES[0]},
    "L2-gain, k = 0.2": {"color": plots.COLOURS[0], "linestyle": plots.LINES[0]},
    "L2-gain, k = 5": {"color": plots.COLOURS[5], "linestyle": plots.LINES[1]},
    "L2-gain, weights as printed": {"color": plots.COLOURS[3], "linestyle": plots.LINES[2]},
    UNLIMITED: {"color": plots.COLOURS[6], "linestyle": plots.LINES[3]},
    "without the derivatives of $y_d$": {"color": plots.COLOURS[3], "linestyle": plots.LINES[2]},
    "PID": {"color": plots.COLOURS[1], "linestyle": plots.LINES[1]},
    "PID, conditional integration": {"color": plots.COLOURS[2], "linestyle": plots.LINES[2]},
}
CLAIMED = {"L2-gain": (80.0, 50.0), "PID": (200.0, 300.0)}  # s: attitude settled, vibration gone


def draw(results: Mapping[str, Result]) -> dict[str, Figure]:
    """Return the paper's figures as far as `results` has the runs."""
    drawn: dict[str, Figure] = {}
    with mpl.rc_context(plots.STYLE):
        for case, named, raw in (("S", SMALL, RAW_SMALL), ("L", LARGE, LARGE)):
            runs = _chosen(results, named)
            if not runs:
                continue
            what = f"case {case} (figures %s)"
            drawn[f"fig01_fig05_angles_{case}"] = _angles(runs, "Attitude in the orbit frame, " + what % "1, 5")
            drawn[f"fig02_fig06_rates_{case}"] = _rates(runs, "Body rate relative to the orbit frame, " + what % "2, 6")
            drawn[f"fig03_fig07_torque_{case}"] = _torque(runs, "Torque on the hub: asked, given, " + what % "3, 7")
            if all(series(run, "plant.eta") is not None for run in runs.values()):
                drawn[f"fig04_fig08_modes_{case}"] = _modes(runs, "Modal coordinates, " + what % "4, 8")
            if commands := _chosen(results, raw):
                drawn[f"raw_command_{case}"] = _raw(commands, case)
        scales = _chosen(results, SCALES)
        if SCALES[L2_PRINTED] in scales:
            drawn["scale_of_the_weights"] = _angles(
                scales, "L2-gain, case S: weights of g in units of 1/J, and as printed"
            )
        if moving := _chosen(results, MOVING):
            drawn["moving_angles"] = _moving(moving)
        if proved := _chosen(results, PROVED):
            drawn["storage_function"] = _storage(proved)
    return drawn


def _chosen(results: Mapping[str, Result], names: Mapping[str, str]) -> dict[str, Result]:
    return {names[name]: results[name] for name in names if name in results and len(results[name]) > 1}


def _angles(runs: Mapping[str, Result], title: str) -> Figure:
    """Draw the angles, below them the worst one as a part of its start, with what counts as settled and when."""
    figure, grid = plots.panels(4, 1, title)
    axes = [row[0] for row in grid]
    rows = {name: np.degrees(angles(run)) for name, run in runs.items()}
    for i, (ax, name) in enumerate(zip(axes, NAMES, strict=False)):
        for label, run in runs.items():
            ax.plot(run.time, rows[label][:, i], label=label, **LOOKS[label])
        ax.set_ylabel(plots.label(name, "deg"))
    for label, run in runs.items():
        part = np.max(np.abs(rows[label]) / np.abs(rows[label][0]), axis=1)
        axes[3].semilogy(run.time, np.where(part > 0, part, np.nan), label=label, **LOOKS[label])
    for part, line in ((0.05, "--"), (0.001, plots.LINES[3])):
        axes[3].axhline(part, color=plots.GREY, linewidth=1, linestyle=line, label=f"{100 * part:g} % of the start")
    _claimed(axes[3], runs, 0)
    axes[3].set_ylim(1e-6, 30)
    axes[3].set_ylabel("worst part (1)")
    axes[3].set_xlim(0, _last(runs))
    figure.align_ylabels(axes)
    plots.legend(figure)
    return figure


def _moving(runs: Mapping[str, Result]) -> Figure:
    """Draw angles that move with those wanted, and below the worst error on a logarithmic axis."""
    figure, grid = plots.panels(4, 1, r"Angles that move in the orbit frame: $y_d$ = 5 deg sin(0.02 t)")
    axes = [row[0] for row in grid]
    for name, run in runs.items():
        for ax, rows in zip(axes[:3], np.degrees(angles(run)).T, strict=True):
            ax.plot(run.time, rows, label=name, **LOOKS[name])
        worst = np.degrees(np.max(np.abs(deviation(run)), axis=1))
        axes[3].semilogy(run.time, np.maximum(worst, 1e-12), label=name, **LOOKS[name])
    first = next(iter(runs.values()))
    for ax, rows, name in zip(axes[:3], np.degrees(first["guidance.y_d"]).T, NAMES, strict=True):
        ax.plot(first.time, rows, color="black", linestyle=":", linewidth=1, label="wanted")
        ax.set_ylabel(plots.label(name, "deg"))
    axes[3].set_ylabel("worst error (deg)")
    axes[3].set_ylim(1e-9, 2)
    axes[3].set_xlim(0, _last(runs))
    figure.align_ylabels(axes)
    plots.legend(figure)
    return figure


def _storage(runs: Mapping[str, Result]) -> Figure:
    """Draw V along the flights that a theorem is about, and what the theorem lets it be."""
    figure, grid = plots.panels(1, len(runs), "Storage function V(t) and its bound by the theorems", height=3.0)
    figure.set_size_inches(11.0, figure.get_size_inches()[1])
    for ax, (name, run) in zip(grid[0], runs.items(), strict=True):
        V, bound = storage.storage(run), storage.bound(run)
        ax.plot(run.time, V, label="V", **plots.look(0))
        ax.plot(run.time, bound, label="bound", **plots.look(1))
        ax.set_yscale("symlog", linthresh=max(float(V.max()), 1e-30))
        ax.set_title(name)
        ax.margins(x=0.01)
    grid[0][0].set_ylabel("V (1/s$^2$)")
    plots.legend(figure)
    return figure


def _rates(runs: Mapping[str, Result], title: str) -> Figure:
    """Draw the rates of the Euler angles' frame: the paper's omega has the orbit's rate besides, about y."""
    figure, grid = plots.panels(3, 1, title)
    axes = [row[0] for row in grid]
    for i, (ax, axis) in enumerate(zip(axes, "xyz", strict=True)):
        for label, run in runs.items():
            ax.plot(run.time, np.degrees(rates(run))[:, i], label=label, **plots.thin(LOOKS[label], 1.0))
        ax.set_ylabel(rf"$\omega_{axis}$ (deg/s)")
        ax.set_xlim(0, _last(runs))
    figure.align_ylabels(axes)
    plots.legend(figure)
    return figure


def _torque(runs: Mapping[str, Result], title: str) -> Figure:
    """Draw the torque on the hub with its limit beside the raw command; linear to twice the limit, then logarithmic.

    A column a run: what switches fast hides what is drawn over it.
    """
    figure, grid = plots.panels(3, len(runs), title)
    figure.set_size_inches(max(8.0, 3.4 * len(runs)), figure.get_size_inches()[1])
    largest = max(float(np.max(np.abs(run["controller.u"]))) for run in runs.values())
    for column, (name, run) in enumerate(runs.items()):
        for i, row in enumerate(grid):
            asked, given = run["controller.u"][:, i], run["actuators.tau_B"][:, i]
            limit = min(settings(run, "actuators.torque_limit", U_MAX))
            plots.asked_and_given(row[column], run.time, asked, given, (-limit, limit))
            plots.beyond_linear(row[column], limit, largest)
            row[0].set_ylabel(plots.label(f"$u_{i + 1}$, {AXES[i]}", "N.m"))
        grid[0][column].set_title(name)
        grid[0][column].set_xlim(0, _last(runs))
    figure.align_ylabels([row[0] for row in grid])
    plots.legend(figure)
    return figure


def _modes(runs: Mapping[str, Result], title: str) -> Figure:
    """Draw the modal coordinates, a column a run with equal scales; below, the worst mode as a part of its own peak."""
    figure, grid = plots.panels(4, len(runs), title)
    figure.set_size_inches(max(8.0, 3.4 * len(runs)), figure.get_size_inches()[1])
    eta = {name: run["plant.eta"] for name, run in runs.items()}
    for i, row in enumerate(grid[:3]):
        exponent = plots.scale([rows[:, i] for rows in eta.values()])
        reach = 1.1 * max(float(np.max(np.abs(rows[:, i]))) for rows in eta.values()) / 10.0**exponent
        for ax, (name, run) in zip(row, runs.items(), strict=True):
            look = plots.thin(LOOKS[name], 0.8, linestyle="-")
            ax.plot(run.time, eta[name][:, i] / 10.0**exponent, label=name, **look)
            if reach > 0:
                ax.set_ylim(-reach, reach)
        row[0].set_ylabel(plots.label(rf"$\eta_{i + 1}$", "kg^(1/2).m", exponent))
    for column, (ax, (name, run)) in enumerate(zip(grid[3], runs.items(), strict=True)):
        peak = np.max(np.abs(eta[name]), axis=0)
        part = np.max(np.abs(eta[name]) / np.where(peak > 0, peak, 1.0), axis=1)
        ax.semilogy(run.time, np.maximum(part, 1e-9), **plots.thin(LOOKS[name], 0.8, linestyle="-"))
        ax.axhline(0.05, color=plots.GREY, linewidth=1, linestyle="--", label="5 % of its peak")
        _claimed(ax, {name: run}, 1)
        ax.set_ylim(1e-4, 2)
        ax.set_xlim(0, _last(runs))
        grid[0][column].set_title(name)
    grid[3][0].set_ylabel("worst part (1)")
    figure.align_ylabels([row[0] for row in grid])
    plots.legend(figure)
    return figure


def _claimed(ax: Any, runs: Mapping[str, Result], which: int) -> None:
    """Mark when the paper says that its laws have settled: attitude (0) or vibration (1)."""
    for law, times in CLAIMED.items():
        if any(name.startswith(law) for name in runs):
            look = plots.thin({}, 1.0, color=LOOKS[law]["color"], linestyle="-.")
            ax.axvline(times[which], label=f"{law}, paper: {times[which]:g} s", **look)


def _raw(runs: Mapping[str, Result], case: str) -> Figure:
    """Draw the command before the limiter, on a logarithmic axis: it is far beyond what wheels give."""
    figure, grid = plots.panels(3, 1, f"Command before the limiter, absolute value, case {case}")
    for i, (ax,) in enumerate(grid):
        for name, run in runs.items():
            rows = np.abs(run["controller.u"][:, i])
            look = plots.thin(LOOKS[name], 0.8)
            ax.plot(run.time, np.where(rows > 0, rows, np.nan), label=name, **look)
        ax.axhline(U_MAX, color=plots.GREY, linewidth=1, linestyle=plots.LINES[3], label="limit")
        ax.set_yscale("log")
        ax.set_ylim(1e-5, 1e4)
        ax.set_xlim(0, 100 if case == "S" else _last(runs))
        ax.set_ylabel(plots.label(rf"$|u_{i + 1}|$, {AXES[i]}", "N.m"))
    figure.align_ylabels([row[0] for row in grid])
    plots.legend(figure)
    return figure


def _last(runs: Mapping[str, Result]) -> float:
    return float(max(run.time[-1] for run in runs.values()))
