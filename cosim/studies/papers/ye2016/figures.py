"""The figures of ye2016, with the runs that it compares overlaid."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from cosim.arrays import FloatArray
from cosim.results.result import Result
from cosim.studies import plots
from cosim.studies.metrics import settings
from cosim.studies.papers.ye2016.system import (
    ADAPTIVE,
    ADAPTIVE_SLOW,
    BETA_G,
    DELTA_G,
    FULL_MODEL,
    NONADAPTIVE,
    NONADAPTIVE_SLOW,
    PERFECT,
    PRINTED,
    SLOW_PRINTED,
    unknown_axes,
)
from cosim.studies.papers.ye2016.theory import FLIGHTS
from cosim.studies.papers.ye2016.theory_figures import draw_storage, draw_terms
from cosim.studies.papers.ye2016.tracking import euler_error, rate_error, squared_norms

AXES = ("roll", "pitch", "yaw")
SHORT = {
    NONADAPTIVE: "no adaptation",
    ADAPTIVE: r"adaptive, $\alpha_F = 10^5$",
    PRINTED: r"adaptive, $\alpha_F = 10^7$",
    PERFECT: "perfect knowledge",
    NONADAPTIVE_SLOW: "no adaptation, slow poles",
    ADAPTIVE_SLOW: r"adaptive, slow poles, $\alpha_F = 10^2$",
    SLOW_PRINTED: r"adaptive, slow poles, $\alpha_F = 10^7$",
}
LOOKS: dict[str, dict[str, Any]] = {
    NONADAPTIVE: {"color": plots.COLOURS[1], "linestyle": plots.LINES[1]},
    ADAPTIVE: {"color": plots.COLOURS[0], "linestyle": plots.LINES[0]},
    PRINTED: {"color": plots.COLOURS[2], "linestyle": plots.LINES[2]},
    PERFECT: {"color": plots.COLOURS[6], "linestyle": plots.LINES[3]},
    NONADAPTIVE_SLOW: {"color": plots.COLOURS[4], "linestyle": plots.LINES[1]},
    ADAPTIVE_SLOW: {"color": plots.COLOURS[3], "linestyle": plots.LINES[0], "linewidth": 0.9, "zorder": 1.9},
    SLOW_PRINTED: {"color": plots.COLOURS[5], "linestyle": plots.LINES[0], "linewidth": 0.5, "zorder": 1.5},
}
READINGS = {
    "poles as printed": (NONADAPTIVE, ADAPTIVE, PRINTED, PERFECT),
    "poles $\\times$ 0.1": (NONADAPTIVE_SLOW, ADAPTIVE_SLOW, SLOW_PRINTED),
}
CLAIMED = {"rad": {"0.3 rad": 0.3, "0.003 rad": 0.003}, "rad/s": {"1e-3 rad/s": 1e-3, "1e-4 rad/s": 1e-4}}


def draw(results: Mapping[str, Result]) -> dict[str, Figure]:
    """Return the paper's figures 2-5, 8-11 and those of its cluster, as far as `results` has the runs."""
    runs = {name: results[name] for name in SHORT if name in results and len(results[name]) > 1}
    if not runs:
        return {"neglected_terms": draw_terms(results[FULL_MODEL])} if FULL_MODEL in results else {}
    adapting = {name: run for name, run in runs.items() if name in (ADAPTIVE, PRINTED, ADAPTIVE_SLOW, SLOW_PRINTED)}
    with mpl.rc_context(plots.STYLE):
        drawn = {
            "fig02_fig04_attitude_error": _errors(
                runs, euler_error, "Attitude error, angles 3-2-1 (figures 2, 4)", "rad"
            ),
            "fig03_fig05_rate_error": _errors(runs, rate_error, "Rate error (figures 3, 5)", "rad/s"),
            "cluster_angles": _cluster(runs),
            "cluster_commands": _commands(runs),
            "cluster_torque": _torque(runs),
            "wanted_torque": _wanted(runs),
        }
        if adapting:
            drawn["fig08-09_momentum_estimate"] = _momentum(adapting)
            drawn["fig10-11_squared_norms"] = _norms(adapting)
        known = {name: runs[name] for name in FLIGHTS if name in runs}
        if known:
            drawn["storage_function"] = draw_storage(known, SHORT)
        if FULL_MODEL in results:
            drawn["neglected_terms"] = draw_terms(results[FULL_MODEL])
    return drawn


def _errors(runs: Mapping[str, Result], error: Callable[[Result], FloatArray], title: str, unit: str) -> Figure:
    """Draw the error per axis, below it the largest component on a logarithmic scale; a column a reading of K."""
    shown = {reading: [n for n in names if n in runs] for reading, names in READINGS.items()}
    shown = {reading: names for reading, names in shown.items() if names}
    figure, grid = plots.panels(4, len(shown), title)
    for column, (reading, names) in enumerate(shown.items()):
        rows = {name: error(runs[name]) for name in names}
        exponents = [plots.scale([values[:, i] for values in rows.values()]) for i in range(3)]
        axes = [line[column] for line in grid]
        axes[0].set_title(reading)
        for i, (ax, axis, exponent) in enumerate(zip(axes, AXES, exponents, strict=False)):
            for name, values in rows.items():
                ax.plot(runs[name].time, values[:, i] / 10.0**exponent, label=SHORT[name], **LOOKS[name])
            ax.set_ylabel(plots.label(axis if unit == "rad" else rf"$\omega_{'xyz'[i]}$ error", unit, exponent))
        for name, values in rows.items():
            size = np.max(np.abs(values), axis=1)
            axes[3].plot(runs[name].time, np.where(size > 0, size, np.nan), label=SHORT[name], **LOOKS[name])
        axes[3].set_yscale("log")
        for index, (text, value) in enumerate(CLAIMED[unit].items()):
            axes[3].axhline(value, color=plots.GREY, linewidth=1, linestyle=plots.LINES[2 * index], label=text)
        if top := max(np.abs(values).max() for values in rows.values()):
            axes[3].set_ylim(1e-5 * top, 2 * max(top, max(CLAIMED[unit].values())))
        axes[3].set_ylabel(plots.label("largest", unit))
        figure.align_ylabels(axes)
    plots.legend(figure, columns=3)
    return figure


def _momentum(runs: Mapping[str, Result]) -> Figure:
    """Draw the estimated total momentum in inertial axes, and the true one as straight lines, as the paper does."""
    shown = _readings(runs)
    figure, grid = plots.panels(3, len(shown), "Total momentum, inertial axes: estimate and truth (figures 8, 9)")
    for column, (reading, own) in enumerate(shown.items()):
        grid[0][column].set_title(reading)
        for i, line in enumerate(grid):
            ax = line[column]
            for name, run in own.items():
                ax.plot(run.time, run["controller.H_hat_N"][:, i], label=SHORT[name], **LOOKS[name])
            first = next(iter(own.values()))
            ax.plot(first.time, first["plant.H_N"][:, i], color=plots.COLOURS[6], linewidth=1, label="true")
            # An early excursion of an estimate may be far off: the axis shows what comes after.
            late = np.concatenate([run["controller.H_hat_N"][run.time >= 100.0, i] for run in own.values()])
            if late.size:
                reach = 1.2 * np.max(np.abs(late - first["plant.H_N"][0, i])) + 0.2
                ax.set_ylim(first["plant.H_N"][0, i] - reach, first["plant.H_N"][0, i] + reach)
            ax.set_ylabel(plots.label(f"$H_{'xyz'[i]}$", "N.m.s"))
    plots.legend(figure, columns=3)
    return figure


def _norms(runs: Mapping[str, Result]) -> Figure:
    """Draw the squared norms of the estimated deviations and the true ones, with where the projection begins and ends.

    Of estimates that oscillate the largest of each 2 s is drawn.
    """
    figure, grid = plots.panels(2, len(runs), "Squared norms of the estimated deviations (figures 10, 11)", height=2.3)
    figure.set_size_inches(12.0, figure.get_size_inches()[1])
    true = [np.sum(axes**2, axis=1) for axes in unknown_axes()]
    for row, what, size in zip(grid, ("cG", "wG"), true, strict=True):
        for ax, (name, run) in zip(row, runs.items(), strict=True):
            norms = squared_norms(run)[0 if what == "cG" else 1]
            time, largest = _envelope(run.time, norms, 2.0)
            for i, rows in enumerate(largest.T):
                look: dict[str, Any] = plots.look(i)
                shown = np.where(rows > 0, rows, np.nan)
                ax.plot(time, shown, label=f"estimate, $i = {i + 1}$", linewidth=1.0, **look)
                look |= {"linestyle": plots.LINES[3], "linewidth": 0.8}
                ax.axhline(size[i], label=f"true, $i = {i + 1}$", **look)
            beta = settings(run, "controller.b", BETA_G)[0]
            ax.axhline(beta, color=plots.GREY, linewidth=1, linestyle="--", label=rf"$\beta$ = {beta:g}")
            edge = beta + settings(run, "controller.d", DELTA_G)[0]
            ax.axhline(edge, color=plots.GREY, linewidth=1, label=rf"$\beta + \delta$ = {edge:g}")
            ax.set_yscale("log")
            ax.set_ylim(1e-9 if what == "cG" else 1e-18, 1.0)
            grid[0][list(runs).index(name)].set_title(SHORT[name], fontsize=9)
        row[0].set_ylabel(rf"$|\hat\Theta_{{{what},i}}|^2$ (1)")
    plots.legend(figure, columns=5)
    return figure


def _envelope(time: FloatArray, rows: FloatArray, span: float) -> tuple[FloatArray, FloatArray]:
    """Return the begin of each span of time, s, and the largest of each column in it."""
    count = max(1, int(span * (len(time) - 1) / (time[-1] - time[0])))
    begins = np.arange(0, len(time), count)
    return time[begins], np.maximum.reduceat(rows, begins, axis=0)


def _readings(runs: Mapping[str, Result]) -> dict[str, dict[str, Result]]:
    """Return reading of the poles -> its runs, of those that there are."""
    found = {text: {n: runs[n] for n in names if n in runs} for text, names in READINGS.items()}
    return {text: own for text, own in found.items() if own}


def _cluster(runs: Mapping[str, Result]) -> Figure:
    """Draw gimbal angles, wheel speeds, and how far the gyros are from a singularity; a column a reading of K."""
    shown = _readings(runs)
    first = next(iter(runs.values()))
    gyros, wheels = (len(first[f"actuators.{n}"][0]) for n in ("gimbal_angle", "wheel_speed"))
    text = r"Gimbal angles, wheel speeds, and det(A A$^T$) of the gyros (captions of figures 6, 7 are lost)"
    figure, grid = plots.panels(gyros + wheels + 1, len(shown), text, height=1.3)
    figure.set_size_inches(9.0, figure.get_size_inches()[1])
    for column, (reading, own) in enumerate(shown.items()):
        axes = [line[column] for line in grid]
        axes[0].set_title(reading)
        angles = {name: np.degrees(run["actuators.gimbal_angle"]) for name, run in own.items()}
        _draw(axes[:gyros], own, angles, 0, [rf"$\gamma_{i + 1}$ (deg)" for i in range(gyros)])
        speeds = {name: run["actuators.wheel_speed"] for name, run in own.items()}
        _draw(axes[gyros:-1], own, speeds, 0, [rf"$\Omega_{i + 1}$ (rad/s)" for i in range(wheels)])
        measures = {name: run["actuators.singularity"].reshape(-1, 1) for name, run in own.items()}
        _draw(axes[-1:], own, measures, 0, ["det (1)"])
        axes[-1].set_ylim(bottom=0)
        figure.align_ylabels(axes)
    plots.legend(figure, columns=3)
    return figure


def _commands(runs: Mapping[str, Result]) -> Figure:
    """Draw what the law commands, gimbal rates and wheel accelerations; a column a reading of K.

    The paper has no limit of rates, accelerations or torques.
    """
    shown = _readings(runs)
    first = next(iter(runs.values()))
    kinds = (
        ("gimbal_rate_command", r"\dot\gamma", "rad/s"),
        ("wheel_acceleration_command", r"\dot\Omega", "rad/s2"),
    )
    sizes = [len(first[f"controller.{name}"][0]) for name, *_ in kinds]
    figure, grid = plots.panels(sum(sizes), len(shown), "Commands to the cluster; the paper limits none", height=1.3)
    figure.set_size_inches(9.0, figure.get_size_inches()[1])
    for column, (reading, own) in enumerate(shown.items()):
        axes = [line[column] for line in grid]
        axes[0].set_title(reading)
        begin = 0
        for (what, symbol, unit), size in zip(kinds, sizes, strict=True):
            rows = {name: run[f"controller.{what}"] for name, run in own.items()}
            exponent = plots.scale(rows.values())
            labels = [plots.label(f"${symbol}_{i + 1}$", unit, exponent) for i in range(size)]
            _draw(axes[begin : begin + size], own, rows, exponent, labels)
            begin += size
        figure.align_ylabels(axes)
    plots.legend(figure, columns=3)
    return figure


def _torque(runs: Mapping[str, Result]) -> Figure:
    """Draw the torque on the body; a column a reading of K."""
    shown = _readings(runs)
    figure, grid = plots.panels(3, len(shown), "Torque of the cluster on the body")
    for column, (reading, own) in enumerate(shown.items()):
        axes = [line[column] for line in grid]
        axes[0].set_title(reading)
        rows = {name: _given(run) for name, run in own.items()}
        exponent = plots.scale(rows.values())
        _draw(axes, own, rows, exponent, [plots.label(rf"$\tau_{axis}$", "N.m", exponent) for axis in "xyz"])
        figure.align_ylabels(axes)
    plots.legend(figure, columns=3)
    return figure


def _wanted(runs: Mapping[str, Result]) -> Figure:
    """Draw the torque that one law wants beside what the body gets, below it the difference for all runs.

    The difference is what the unknown axes make of the command.
    """
    name, run = next(iter(runs.items()))
    figure, grid = plots.panels(4, 1, f"Torque wanted and given: {SHORT[name]}; below, what is missing in every run")
    for i, axis in enumerate("xyz"):
        ax = grid[i][0]
        plots.asked_and_given(ax, run.time, run["controller.tau_wanted_B"][:, i], _given(run)[:, i])
        ax.set_ylabel(rf"$\tau_{axis}$ (N m)")
    for key, other in runs.items():
        missing = np.linalg.norm(other["controller.tau_wanted_B"] - _given(other), axis=1)
        time, largest = _envelope(other.time, missing.reshape(-1, 1), 2.0)
        grid[3][0].semilogy(time, np.maximum(largest[:, 0], 1e-9), label=SHORT[key], **LOOKS[key])
    grid[3][0].set_ylabel("missing (N m)")
    figure.align_ylabels([line[0] for line in grid])
    plots.legend(figure, columns=3)
    return figure


def _given(run: Result) -> FloatArray:
    """Return the torque of the cluster on the body; gyros that are in the plant give none from outside."""
    return run["actuators.tau_B"] if "actuators.tau_B" in run else run["plant.tau_B"]


def _draw(
    axes: Sequence[Any],
    runs: Mapping[str, Result],
    rows: Mapping[str, FloatArray],
    exponent: int,
    labels: Sequence[str],
) -> None:
    for i, (ax, text) in enumerate(zip(axes, labels, strict=True)):
        for name, values in rows.items():
            ax.plot(runs[name].time, values[:, i] / 10.0**exponent, label=SHORT[name], **LOOKS[name])
        ax.set_ylabel(text)
