"""The figures of geng2012, with its numbers."""

from collections.abc import Mapping
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from cosim import plots
from cosim.metrics import attitude_error, series
from cosim.papers.geng2012.claims import POINTING, SINGULAR
from cosim.papers.geng2012.system import (
    COMPENSATED,
    DEAD_ZONE,
    LINEAR,
    PLANE_TORQUE,
    PRINTED_GAIN,
    PRINTED_GAMMA,
    RATE_LIMIT,
    UNCOMPENSATED,
    WEAK,
    WHEEL_TORQUE,
    Z_WHEEL_ONLY,
)
from cosim.result import Result

Array = NDArray[np.float64]

SHORT = {
    COMPENSATED: "with compensation",
    UNCOMPENSATED: "without",
    LINEAR: "linear law",
    Z_WHEEL_ONLY: "wheel about z only",
    PRINTED_GAIN: "printed gain",
    PRINTED_GAMMA: r"printed $\gamma$",
    WEAK: r"without, $\rho_0$ = 0.02 N m",
}
LOOKS: dict[str, dict[str, Any]] = {
    name: {"color": plots.COLOURS[i], "linestyle": plots.LINES[i % len(plots.LINES)]}
    for i, name in enumerate(SHORT.values())
}
END = 60.0  # s, of the drawings of the transient


def figures(results: Mapping[str, Result]) -> dict[str, Figure]:
    """Return the paper's figures 4-9, as far as `results` has the runs, and one of all runs."""
    runs = {SHORT[name]: results[name] for name in SHORT if name in results and len(results[name]) > 1}
    main = {SHORT[n]: runs[SHORT[n]] for n in (COMPENSATED, UNCOMPENSATED, LINEAR) if SHORT[n] in runs}
    drawn: dict[str, Figure] = {}
    with mpl.rc_context(plots.STYLE):
        if main:
            drawn["fig04_06_attitude_error"] = _errors(main)
            drawn["fig04_06_rates"] = _rates(main)
            if all(series(run, "plant.eta") is not None for run in main.values()):
                drawn["fig05_09_modal_coordinates"] = _modes(main)
        if SHORT[COMPENSATED] in runs:
            run = runs[SHORT[COMPENSATED]]
            drawn["fig07_singularity"] = _gyros(run)
            drawn["fig08_estimate"] = _estimate(run)
            drawn["torque"] = _torque(run)
        if len(runs) > len(main):
            drawn["all_experiments"] = _all(runs)
    return drawn


def _degrees(run: Result) -> Array:
    error = attitude_error(run)
    return np.full((len(run), 3), np.nan) if error is None else error


def _last(runs: Mapping[str, Result]) -> float:
    return float(max(run.time[-1] for run in runs.values()))


def _errors(runs: Mapping[str, Result]) -> Figure:
    """Draw e per axis: the manoeuvre on the left, its end with the 0.1 deg band on the right."""
    end = _last(runs)
    columns = 2 if end > 25.0 else 1
    figure, grid = plots.panels(3, columns, "Attitude error (figures 4 and 6)", height=2.0)
    for i, (row, axis) in enumerate(zip(grid, "xyz", strict=True)):
        for name, run in runs.items():
            for ax in row:
                ax.plot(run.time, _degrees(run)[:, i], label=name, **LOOKS[name])
        row[0].set_ylabel(f"$e_{axis}$ (deg)")
        row[0].set_xlim(0, min(END, end))
        for ax in row[1:]:
            ax.axhspan(-POINTING, POINTING, color="#000000", alpha=0.07, linewidth=0, label=f"{POINTING} deg")
            ax.set_xlim(20.0, min(END, end))
            ax.set_ylim(-0.6, 0.6)
    if columns == 2:
        grid[0][0].set_title("manoeuvre")
        grid[0][1].set_title("its end")
    figure.align_ylabels([row[0] for row in grid])
    plots.legend(figure)
    return figure


def _rates(runs: Mapping[str, Result]) -> Figure:
    end = _last(runs)
    columns = 2 if end > 25.0 else 1
    figure, grid = plots.panels(3, columns, "Body rate (figures 4 and 6)", height=2.0)
    for i, (row, axis) in enumerate(zip(grid, "xyz", strict=True)):
        for name, run in runs.items():
            for ax in row:
                ax.plot(run.time, np.degrees(run["plant.omega_BN_B"][:, i]), label=name, **LOOKS[name])
        row[0].set_ylabel(rf"$\omega_{axis}$ (deg/s)")
        row[0].set_xlim(0, min(END, end))
        for ax in row[1:]:
            ax.axhspan(-0.02, 0.02, color="#000000", alpha=0.07, linewidth=0, label="0.02 deg/s")
            ax.set_xlim(20.0, min(END, end))
            ax.set_ylim(-0.12, 0.12)
    if columns == 2:
        grid[0][0].set_title("manoeuvre")
        grid[0][1].set_title("its end")
    figure.align_ylabels([row[0] for row in grid])
    plots.legend(figure)
    return figure


def _modes(runs: Mapping[str, Result]) -> Figure:
    """Draw eta: the manoeuvre on the left, what is left after it on the right."""
    end = _last(runs)
    columns = 2 if end > 35.0 else 1
    figure, grid = plots.panels(4, columns, "Modal coordinates (figures 5 and 9)", height=1.6)
    thin: dict[str, Any] = {"linewidth": 1.0}
    for i, row in enumerate(grid):
        for name, run in runs.items():
            late = run.time >= 30.0
            look = LOOKS[name] | thin
            row[0].plot(run.time, run["plant.eta"][:, i], label=name, **look)
            for ax in row[1:]:
                ax.plot(run.time[late], 1e3 * run["plant.eta"][late, i], label=name, **look)
        row[0].set_ylabel(plots.label(rf"$\eta_{i + 1}$", "kg(1/2).m"))
        row[0].set_xlim(0, min(END, end))
        for ax in row[1:]:
            ax.set_xlim(30.0, min(END, end))
            ax.set_ylabel(plots.label(rf"$\eta_{i + 1}$", "kg(1/2).m", -3))
    figure.align_ylabels([row[0] for row in grid])
    plots.legend(figure)
    return figure


def _gyros(run: Result) -> Figure:
    """Draw the measure of singularity, the gimbals' angles and their rates with the limit and the dead zone."""
    figure, grid = plots.panels(3, 1, "Control moment gyros, with compensation (figure 7)", height=2.1)
    measure, angle, rate = (row[0] for row in grid)
    measure.plot(run.time, run["steering.singularity"], **plots.look(0))
    measure.axhline(SINGULAR, color=plots.GREY, linewidth=1, linestyle="--", label=f"singular below {SINGULAR}")
    measure.set_ylabel(r"$\det(A A^T)$ (1)")
    for i in range(2):
        look = plots.look(i)
        angle.plot(run.time, np.degrees(run["actuators.gimbal_angle"][:, i]), label=f"gyro {i + 1}", **look)
        rate.plot(run.time, np.degrees(run["steering.gimbal_rate_command"][:, i]), label=f"gyro {i + 1}", **look)
    limit = float(np.degrees(RATE_LIMIT))
    for side in (1, -1):
        rate.axhline(side * limit, color=plots.GREY, linewidth=1, linestyle=plots.LINES[3], label="limit")
    angle.set_ylabel("gimbal angle (deg)")
    rate.set_ylabel("gimbal rate (deg/s)")
    rate.set_yscale("symlog", linthresh=DEAD_ZONE)
    rate.set_yticks([-10, -1, -0.1, 0, 0.1, 1, 10])
    rate.set_xlim(0, min(END, run.time[-1]))
    figure.align_ylabels([measure, angle, rate])
    plots.legend(figure)
    return figure


def _estimate(run: Result) -> Figure:
    figure, grid = plots.panels(1, 1, r"Gain of the network, $\rho = W \Phi$ (figure 8)", height=2.8)
    ax = grid[0][0]
    for i, axis in enumerate("xyz"):
        ax.plot(run.time, run["controller.rho"][:, i], label=rf"$\rho_{axis}$", **plots.look(i))
    ax.axvline(30.0, color=plots.GREY, linewidth=1, linestyle=plots.LINES[3], label="30 s")
    ax.set_ylabel(r"$\rho$ (N m)")
    ax.set_xlim(0, run.time[-1])
    plots.legend(figure)
    return figure


def _torque(run: Result) -> Figure:
    """Draw what the law asks for, what hub and wheels get and their limits."""
    figure, grid = plots.panels(3, 1, "Torque on the hub, with compensation")
    axes = [row[0] for row in grid]
    accelerations = series(run, "steering.wheel_acceleration_command")
    for i, (ax, axis) in enumerate(zip(axes, "xyz", strict=True)):
        raw: dict[str, Any] = {"color": plots.COLOURS[6], "linewidth": 0.8, "alpha": 0.7}
        ax.plot(run.time, run["controller.tau_command_B"][:, i], label="command", **raw)
        ax.plot(run.time, run["actuators.tau_B"][:, i], label="on the hub", **plots.look(0))
        if accelerations is not None:
            inertia = _wheel_inertia(run)
            ax.plot(run.time, -inertia * accelerations[:, i], label="of it, wheels", **plots.look(1))
        for side in (1, -1):
            if axis == "y":
                ax.axhline(side * PLANE_TORQUE, color=plots.GREY, linewidth=1, linestyle="--", label="limit, plane")
            look: dict[str, Any] = {"color": plots.GREY, "linewidth": 1, "linestyle": plots.LINES[3]}
            ax.axhline(side * WHEEL_TORQUE, label="limit, wheels", **look)
        ax.set_ylabel(rf"$\tau_{axis}$ (N m)")
        ax.set_xlim(0, min(40.0, run.time[-1]))
    figure.align_ylabels(axes)
    plots.legend(figure, columns=5)
    return figure


def _wheel_inertia(run: Result) -> float:
    parameters: Mapping[str, Any] = run.info.get("parameters") or {}
    found = [v["value"] for name, v in parameters.items() if name.startswith("actuators.wheel_inertia")]
    return float(found[0]) if found else 0.02


def _all(runs: Mapping[str, Result]) -> Figure:
    figure, grid = plots.panels(1, 1, "Largest component of the attitude error, all experiments", height=3.6)
    ax = grid[0][0]
    for name, run in runs.items():
        ax.plot(run.time, np.max(np.abs(_degrees(run)), axis=1), label=name, **LOOKS[name])
    ax.axhline(POINTING, color=plots.GREY, linewidth=1, linestyle=plots.LINES[3], label=f"{POINTING} deg")
    ax.set_yscale("log")
    ax.set_ylim(1e-3, 100)
    ax.set_xlim(0, _last(runs))
    ax.set_ylabel(r"$\max_i |e_i|$ (deg)")
    plots.legend(figure)
    return figure
