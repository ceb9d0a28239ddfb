"""The figures of ye2016, with the runs that it compares overlaid."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from cosim import plots
from cosim.papers.ye2016.system import (
    ADAPTIVE,
    ADAPTIVE_SLOW,
    BETA_G,
    DELTA_G,
    NONADAPTIVE,
    NONADAPTIVE_SLOW,
    PERFECT,
    PRINTED,
)
from cosim.papers.ye2016.tracking import euler_error, rate_error, squared_norms
from cosim.result import Result

Array = NDArray[np.float64]
AXES = ("roll", "pitch", "yaw")
SHORT = {
    NONADAPTIVE: "no adaptation",
    ADAPTIVE: r"adaptive, $\alpha_F = 10^5$",
    PRINTED: r"adaptive, $\alpha_F = 10^7$",
    PERFECT: "perfect knowledge",
    NONADAPTIVE_SLOW: "no adaptation, slow poles",
    ADAPTIVE_SLOW: r"adaptive, slow poles, $\alpha_F = 10^2$",
}
LOOKS: dict[str, dict[str, Any]] = {
    NONADAPTIVE: {"color": plots.COLOURS[1], "linestyle": plots.LINES[1]},
    ADAPTIVE: {"color": plots.COLOURS[0], "linestyle": plots.LINES[0]},
    PRINTED: {"color": plots.COLOURS[2], "linestyle": plots.LINES[2]},
    PERFECT: {"color": plots.COLOURS[6], "linestyle": plots.LINES[3]},
    NONADAPTIVE_SLOW: {"color": plots.COLOURS[4], "linestyle": plots.LINES[1]},
    ADAPTIVE_SLOW: {"color": plots.COLOURS[3], "linestyle": plots.LINES[0], "linewidth": 0.9, "zorder": 1.9},
}
READINGS = {
    "poles as printed": (NONADAPTIVE, ADAPTIVE, PRINTED, PERFECT),
    "a tenth of them": (NONADAPTIVE_SLOW, ADAPTIVE_SLOW),
}


def figures(results: Mapping[str, Result]) -> dict[str, Figure]:
    """Return the paper's figures 2-5, 8-11 and those of its cluster, as far as `results` has the runs."""
    runs = {name: results[name] for name in SHORT if name in results and len(results[name]) > 1}
    if not runs:
        return {}
    adapting = {name: run for name, run in runs.items() if name in (ADAPTIVE, PRINTED, ADAPTIVE_SLOW)}
    with mpl.rc_context(plots.STYLE):
        drawn = {
            "fig02_fig04_attitude_error": _errors(
                runs, euler_error, "Attitude error, angles 3-2-1 (figures 2, 4)", "rad"
            ),
            "fig03_fig05_rate_error": _errors(runs, rate_error, "Rate error (figures 3, 5)", "rad/s"),
            "cluster_angles": _cluster(runs),
            "cluster_commands": _commands(runs),
            "cluster_torque": _torque(runs),
        }
        if adapting:
            drawn["fig08-09_momentum_estimate"] = _momentum(adapting)
            drawn["fig10-11_squared_norms"] = _norms(adapting)
    return drawn


def _errors(runs: Mapping[str, Result], error: Callable[[Result], Array], title: str, unit: str) -> Figure:
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
            ax.set_ylabel(plots.label(axis if unit == "rad" else rf"$\omega_{'xyz'[i]}$", unit, exponent))
        for name, values in rows.items():
            size = np.max(np.abs(values), axis=1)
            axes[3].plot(runs[name].time, np.where(size > 0, size, np.nan), label=SHORT[name], **LOOKS[name])
        axes[3].set_yscale("log")
        if top := max(np.abs(values).max() for values in rows.values()):
            axes[3].set_ylim(1e-5 * top, 2 * top)
        axes[3].set_ylabel(plots.label("largest", unit))
        figure.align_ylabels(axes)
    plots.legend(figure, columns=2)
    return figure


def _momentum(runs: Mapping[str, Result]) -> Figure:
    """Draw the estimated total momentum in inertial axes, and the true one as straight lines, as the paper does."""
    figure, grid = plots.panels(3, 1, "Total momentum, inertial axes: estimate and truth (figures 8, 9)")
    for i, (ax,) in enumerate(grid):
        for name, run in runs.items():
            ax.plot(run.time, run["controller.H_hat_N"][:, i], label=SHORT[name], **LOOKS[name])
        first = next(iter(runs.values()))
        ax.plot(first.time, first["plant.H_N"][:, i], color=plots.COLOURS[6], linewidth=1, label="true")
        # An early excursion of an estimate may be far off: the axis shows what comes after.
        late = np.concatenate(
            [run["controller.H_hat_N"][run.time >= 100.0, i] for run in runs.values()] or [np.zeros(1)]
        )
        if late.size:
            reach = 1.2 * np.max(np.abs(late - first["plant.H_N"][0, i])) + 0.2
            ax.set_ylim(first["plant.H_N"][0, i] - reach, first["plant.H_N"][0, i] + reach)
        ax.set_ylabel(plots.label(f"$H_{'xyz'[i]}$", "N.m.s"))
    plots.legend(figure)
    return figure


def _norms(runs: Mapping[str, Result]) -> Figure:
    """Draw the squared norms of the estimated deviations, and the edge that the projection keeps."""
    figure, grid = plots.panels(2, len(runs), "Squared norms of the estimated deviations (figures 10, 11)", height=2.3)
    for column, (name, run) in enumerate(runs.items()):
        for ax, values, what in zip((grid[0][column], grid[1][column]), squared_norms(run), ("cG", "wG"), strict=True):
            for i, rows in enumerate(values.T):
                shown = np.where(rows > 0, rows, np.nan)
                ax.plot(run.time, shown, label=f"$i = {i + 1}$", linewidth=0.9, **plots.look(i))
            ax.axhline(BETA_G + DELTA_G, color=plots.GREY, linewidth=1, label=r"$\beta + \delta$")
            ax.set_yscale("log")
            if np.any(values > 0):
                ax.set_ylim(1e-5 * values.max(), 1.0)
            if column == 0:
                ax.set_ylabel(rf"$|\hat\Theta_{{{what},i}}|^2$ (1)")
        grid[0][column].set_title(SHORT[name], fontsize=9)
    plots.legend(figure, columns=5)
    return figure


def _cluster(runs: Mapping[str, Result]) -> Figure:
    """Draw gimbal angles, wheel speeds relative to their start, and how far the gyros are from a singularity."""
    count = len(next(iter(runs.values()))["actuators.gimbal_angle"][0])
    figure, grid = plots.panels(count + 1, 1, "Gimbal angles, and det(A A$^T$) of the gyros' torque axes")
    for name, run in runs.items():
        for i in range(count):
            angle = np.degrees(run["actuators.gimbal_angle"][:, i])
            grid[i][0].plot(run.time, angle, label=SHORT[name], **LOOKS[name])
            grid[i][0].set_ylabel(rf"$\gamma_{i + 1}$ (deg)")
        grid[count][0].plot(run.time, run["actuators.singularity"], label=SHORT[name], **LOOKS[name])
    grid[count][0].set_ylim(bottom=0)
    grid[count][0].set_ylabel("det (1)")
    figure.align_ylabels([line[0] for line in grid])
    plots.legend(figure, columns=2)
    return figure


def _commands(runs: Mapping[str, Result]) -> Figure:
    """Draw what the law commands: gimbal rates on the left, wheel accelerations on the right."""
    first = next(iter(runs.values()))
    gyros, wheels = (len(first[f"controller.{n}"][0]) for n in ("gimbal_rate_command", "wheel_acceleration_command"))
    figure, grid = plots.panels(max(gyros, wheels), 2, "Commands to the cluster")
    for column, (what, symbol, unit, n) in enumerate(
        (
            ("gimbal_rate_command", r"\dot\gamma", "rad/s", gyros),
            ("wheel_acceleration_command", r"\dot\Omega", "rad/s2", wheels),
        )
    ):
        axes = [line[column] for line in grid]
        rows = {name: run[f"controller.{what}"] for name, run in runs.items()}
        exponent = plots.scale(rows.values())
        _draw(axes[:n], runs, rows, exponent, [plots.label(f"${symbol}_{i + 1}$", unit, exponent) for i in range(n)])
        for unused in axes[n:]:
            unused.set_visible(False)
        axes[n - 1].tick_params(labelbottom=True)
        axes[n - 1].set_xlabel("time (s)")
        figure.align_ylabels(axes)
    plots.legend(figure, columns=2)
    return figure


def _torque(runs: Mapping[str, Result]) -> Figure:
    figure, grid = plots.panels(3, 1, "Torque of the cluster on the body")
    rows = {name: run["plant.tau_B"] for name, run in runs.items()}
    exponent = plots.scale(rows.values())
    axes = [line[0] for line in grid]
    _draw(axes, runs, rows, exponent, [plots.label(rf"$\tau_{axis}$", "N.m", exponent) for axis in "xyz"])
    figure.align_ylabels(axes)
    plots.legend(figure, columns=2)
    return figure


def _draw(
    axes: Sequence[Any], runs: Mapping[str, Result], rows: Mapping[str, Array], exponent: int, labels: Sequence[str]
) -> None:
    for i, (ax, text) in enumerate(zip(axes, labels, strict=True)):
        for name, values in rows.items():
            ax.plot(runs[name].time, values[:, i] / 10.0**exponent, label=SHORT[name], **LOOKS[name])
        ax.set_ylabel(text)
