"""The figures of geng2012, with its numbers: of configuration N, which is ours; those of all clusters: clusters.py."""

from collections.abc import Mapping
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from components.numbers.geng2012 import DEAD_ZONE, PLANE_TORQUE, RATE_LIMIT, WHEEL_TORQUE
from cosim.arrays import FloatArray
from cosim.results.result import Result
from cosim.studies import plots
from cosim.studies.metrics import attitude_error, series, settings
from cosim.studies.papers.geng2012 import clusters
from cosim.studies.papers.geng2012.measures import POINTING, SETTLED_RHO, SINGULAR
from cosim.studies.papers.geng2012.system import (
    COMPENSATED,
    DEGREES,
    END_PHASE_COMPENSATED,
    END_PHASE_UNCOMPENSATED,
    END_PHASE_WHEELS,
    LIGHT,
    LIGHT_UNCOMPENSATED,
    LINEAR,
    NOMINAL,
    NOMINAL_UNCOMPENSATED,
    OBSERVER_PLACED,
    OBSERVER_PLACED_REAL,
    OBSERVER_START,
    PREPOSITIONED,
    PRINTED_GAIN,
    PRINTED_GAMMA,
    STRONG,
    UNCOMPENSATED,
    WEAK,
    Z_WHEEL_COMPENSATED,
    Z_WHEEL_DEGREES,
    Z_WHEEL_ONLY,
    Z_WHEEL_PRINTED_GAMMA,
    Z_WHEEL_UNCOMPENSATED,
)

SHORT = {
    COMPENSATED: "with compensation",
    UNCOMPENSATED: r"without, $\rho_0$ = 0.15 N m",
    LINEAR: "linear law",
    Z_WHEEL_ONLY: "wheel about z only",
    PRINTED_GAMMA: r"printed $\gamma$",
    DEGREES: r"printed $\gamma$, $\sigma$ in deg",
}
LOOKS: dict[str, dict[str, Any]] = {name: plots.look(i) for i, name in enumerate(SHORT.values())}
GROUPS = {  # panels of the figure of all experiments
    "law, configuration N": (COMPENSATED, UNCOMPENSATED, LINEAR, WEAK, STRONG, PRINTED_GAIN),
    "one wheel (section 4)": (
        Z_WHEEL_COMPENSATED,
        Z_WHEEL_UNCOMPENSATED,
        Z_WHEEL_PRINTED_GAMMA,
        Z_WHEEL_DEGREES,
        Z_WHEEL_ONLY,
    ),
    "three wheels in the end phase (section 2)": (
        END_PHASE_COMPENSATED,
        END_PHASE_UNCOMPENSATED,
        END_PHASE_WHEELS,
        PREPOSITIONED,
    ),
    "learning, configuration N": (COMPENSATED, DEGREES, PRINTED_GAMMA),
    "inertia, configuration N": (
        COMPENSATED,
        NOMINAL,
        LIGHT,
        UNCOMPENSATED,
        NOMINAL_UNCOMPENSATED,
        LIGHT_UNCOMPENSATED,
    ),
    "observer, configuration N": (COMPENSATED, OBSERVER_START, OBSERVER_PLACED, OBSERVER_PLACED_REAL),
}
END = 60.0  # s, of the drawings of the transient
NEAR = 0.25  # deg/s, room for the rates of the gimbals at the end
FLOOR = 1e-10  # of the measure of singularity, as it is drawn


def draw(results: Mapping[str, Result]) -> dict[str, Figure]:
    """Return the paper's figures 4-9, as far as `results` has the runs, and one of all runs."""
    results = {name: run for name, run in results.items() if len(run) > 1}
    runs = {SHORT[name]: results[name] for name in SHORT if name in results}
    main = _among(runs, COMPENSATED, UNCOMPENSATED, LINEAR)
    pair = _among(runs, COMPENSATED, UNCOMPENSATED)
    networks = _among(runs, COMPENSATED, PRINTED_GAMMA, DEGREES)
    drawn: dict[str, Figure] = {}
    with mpl.rc_context(plots.STYLE):
        if main:
            drawn["fig04_fig06_attitude_error"] = _errors(main)
            drawn["fig04_fig06_rates"] = _rates(main)
            if all(series(run, "plant.eta") is not None for run in main.values()):
                drawn["fig05_fig09_modal_coordinates"] = _modes(main)
        if gyros := _among(runs, COMPENSATED, UNCOMPENSATED, LINEAR, Z_WHEEL_ONLY):
            drawn["fig07_singularity_and_gimbals"] = _gyros(gyros)
        if networks:
            drawn["fig08_estimate"] = _estimate(networks)
        if pair:
            drawn["asked_and_given_torque"] = _torque(pair)
        others = {name for names in GROUPS.values() for name in names} - {COMPENSATED, UNCOMPENSATED, LINEAR}
        if others & set(results):
            drawn["all_experiments"] = _all(results)
        drawn |= clusters.draw(results)
    return drawn


def _among(runs: Mapping[str, Result], *names: str) -> dict[str, Result]:
    return {SHORT[name]: runs[SHORT[name]] for name in names if SHORT[name] in runs}


def _degrees(run: Result) -> FloatArray:
    error = attitude_error(run)
    return np.full((len(run), 3), np.nan) if error is None else error


def _last(runs: Mapping[str, Result]) -> float:
    return float(max(run.time[-1] for run in runs.values()))


def _errors(runs: Mapping[str, Result]) -> Figure:
    """Draw e per axis: the manoeuvre on the left, its end with the 0.1 deg band on the right."""
    end = _last(runs)
    columns = 2 if end > 25.0 else 1
    figure, grid = plots.panels(3, columns, "Attitude error, configuration N (figures 4 and 6)", height=2.0)
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
    figure, grid = plots.panels(3, columns, "Body rate, configuration N (figures 4 and 6)", height=2.0)
    for i, (row, axis) in enumerate(zip(grid, "xyz", strict=True)):
        for name, run in runs.items():
            for ax in row:
                ax.plot(run.time, np.degrees(run["plant.omega_BN_B"][:, i]), label=name, **LOOKS[name])
        row[0].set_ylabel(rf"$\omega_{axis}$ (deg/s)")
        row[0].set_xlim(0, min(END, end))
        for ax in row[1:]:
            ax.axhspan(-0.02, 0.02, color="#000000", alpha=0.1, linewidth=0, label="0.02 deg/s")
            ax.axhspan(-0.1, 0.1, color="#000000", alpha=0.05, linewidth=0, label="0.1 deg/s")
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
    figure, grid = plots.panels(4, columns, "Modal coordinates, configuration N (figures 5 and 9)", height=1.6)
    thin: dict[str, Any] = {"linewidth": 1.0}
    for i, row in enumerate(grid):
        for name, run in runs.items():
            late = run.time >= 30.0
            look = LOOKS[name] | thin
            row[0].plot(run.time, run["plant.eta"][:, i], label=name, **look)
            for ax in row[1:]:
                ax.plot(run.time[late], 1e3 * run["plant.eta"][late, i], label=name, **look)
        row[0].set_ylabel(plots.label(rf"$\eta_{i + 1}$", "kg^(1/2).m"))
        row[0].set_xlim(0, min(END, end))
        for ax in row[1:]:
            ax.set_xlim(30.0, min(END, end))
            ax.set_ylabel(plots.label(rf"$\eta_{i + 1}$", "kg^(1/2).m", -3))
    if columns == 2:
        grid[0][0].set_title("manoeuvre")
        grid[0][1].set_title("what is left")
    figure.align_ylabels([row[0] for row in grid])
    plots.legend(figure)
    return figure


def _gyros(runs: Mapping[str, Result]) -> Figure:
    """Draw the measure of singularity, the gimbals' angles and their rates: the manoeuvre, and its end with less room.

    Of the angles and rates gyro 1 is a full line, gyro 2 a broken one.
    """
    end = _last(runs)
    columns = 2 if end > 25.0 else 1
    figure, grid = plots.panels(
        3, columns, "Gyros, configuration N but where said (figure 7); gyro 1 full, 2 broken", height=2.1
    )
    first = next(iter(runs.values()))
    limit = float(np.degrees(max(settings(first, "actuators.gimbal_rate_limit", RATE_LIMIT))))
    dead = float(np.degrees(max(settings(first, "steering.gimbal_dead_zone", np.radians(DEAD_ZONE)))))
    for column in range(columns):
        measure, angle, rate = (row[column] for row in grid)
        for name, run in runs.items():
            values = np.maximum(run["steering.singularity"].ravel(), FLOOR)
            measure.semilogy(run.time, values, label=name, **LOOKS[name])
            for i, line in enumerate(("-", "--")):
                look: dict[str, Any] = {"color": LOOKS[name]["color"], "linestyle": line, "linewidth": 1.0}
                angle.plot(run.time, np.degrees(run["actuators.gimbal_angle"][:, i]), **look)
                rate.plot(run.time, np.degrees(run["steering.gimbal_rate_command"][:, i]), **look)
        measure.axhline(SINGULAR, color=plots.GREY, linewidth=1, label=f"singular below {SINGULAR}")
        measure.set_ylim(FLOOR, 2.0)
        for side in (1, -1):
            rate.axhline(side * limit, color=plots.GREY, linewidth=1, linestyle=plots.LINES[3], label="rate limit")
        rate.set_ylim(-1.4 * limit, 1.4 * limit)
        rate.set_xlim(0, min(END, end))
        if column == 1:
            rate.axhspan(-dead, dead, color="#000000", alpha=0.07, linewidth=0, label="dead zone")
            rate.set_ylim(-NEAR, NEAR)
            rate.set_xlim(20.0, min(END, end))
    grid[0][0].set_ylabel(r"$\det(A A^T)$ (1)")
    grid[1][0].set_ylabel("gimbal angle (deg)")
    grid[2][0].set_ylabel("rate command (deg/s)")
    if columns == 2:
        grid[0][0].set_title("manoeuvre")
        grid[0][1].set_title("its end")
    figure.align_ylabels([row[0] for row in grid])
    plots.legend(figure)
    return figure


def _estimate(runs: Mapping[str, Result]) -> Figure:
    """Draw the network's gain, below it how far it is from its last value."""
    figure, (gain, rest) = plots.panels(
        2, len(runs), r"Gain of the network, $\rho = W \Phi$, configuration N (figure 8)", height=2.4
    )
    for upper, lower, (name, run) in zip(gain, rest, runs.items(), strict=True):
        rho = run["controller.rho"]
        for i, axis in enumerate("xyz"):
            upper.plot(run.time, rho[:, i], label=rf"$\rho_{axis}$", **plots.look(i))
            away = np.abs(rho[:, i] - rho[-1, i])
            lower.semilogy(run.time, np.maximum(away, 1e-9), label=rf"$\rho_{axis}$", **plots.look(i))
        lower.axhline(SETTLED_RHO, color=plots.GREY, linewidth=1, label=f"{SETTLED_RHO:g} N m")
        for ax in (upper, lower):
            ax.axvline(30.0, color=plots.GREY, linewidth=1, linestyle=plots.LINES[3], label="30 s")
            ax.set_xlim(0, run.time[-1])
        lower.set_ylim(1e-6, 1.0)
        upper.set_title(name)
    gain[0].set_ylabel(r"$\rho$ (N m)")
    rest[0].set_ylabel(r"$|\rho - \rho(\mathrm{end})|$ (N m)")
    figure.align_ylabels([gain[0], rest[0]])
    plots.legend(figure, columns=5)
    return figure


def _torque(runs: Mapping[str, Result]) -> Figure:
    """Draw what the law asks for, what hub and wheels get and their limits; a column a run."""
    figure, grid = plots.panels(3, len(runs), "Torque on the hub: asked and given, configuration N", height=2.0)
    for column, (name, run) in enumerate(runs.items()):
        plane = settings(run, "steering.plane_torque_limit", PLANE_TORQUE)[0]
        wheel = settings(run, "actuators.wheel_torque_limit", [WHEEL_TORQUE] * 3)
        accelerations = series(run, "steering.wheel_acceleration_command")
        for i, (row, axis) in enumerate(zip(grid, "xyz", strict=True)):
            ax = row[column]
            asked, given = run["controller.tau_command_B"][:, i], run["actuators.tau_B"][:, i]
            plots.asked_and_given(ax, run.time, asked, given, given_label="on the hub")
            if accelerations is not None:
                wheels: dict[str, Any] = {"color": plots.COLOURS[1], "linestyle": plots.LINES[1], "linewidth": 1.0}
                ax.plot(run.time, -_wheel_inertia(run) * accelerations[:, i], label="by the wheels", **wheels)
            for side in (1, -1):
                if axis != "z":
                    ax.axhline(side * plane, color=plots.GREY, linewidth=1, linestyle="--", label="limit, plane")
                look: dict[str, Any] = {"color": plots.GREY, "linewidth": 1, "linestyle": plots.LINES[3]}
                ax.axhline(side * wheel[i], label="limit, wheels", **look)
            ax.set_xlim(0, min(40.0, run.time[-1]))
            row[0].set_ylabel(rf"$\tau_{axis}$ (N m)")
        grid[0][column].set_title(name)
    figure.align_ylabels([row[0] for row in grid])
    plots.legend(figure, columns=5)
    return figure


def _wheel_inertia(run: Result) -> float:
    return settings(run, "actuators.wheel_inertia", 0.02)[0]


def _all(results: Mapping[str, Result]) -> Figure:
    """Draw the largest component of the error of every run, a panel a question."""
    found = {title: [name for name in names if name in results] for title, names in GROUPS.items()}
    titles = [title for title, names in found.items() if names]
    rows = -(-len(titles) // 2)
    figure, grid = plots.panels(
        rows, min(2, len(titles)), "Largest component of the attitude error, all experiments", 2.6
    )
    axes = [ax for row in grid for ax in row]
    for ax, title in zip(axes, titles, strict=False):
        for i, name in enumerate(found[title]):
            run = results[name]
            ax.plot(run.time, np.max(np.abs(_degrees(run)), axis=1), label=name.partition("-")[2], **plots.look(i))
        ax.axhline(POINTING, color=plots.GREY, linewidth=1, linestyle=plots.LINES[3], label=f"{POINTING} deg")
        ax.set_yscale("log")
        ax.minorticks_off()
        ax.set_ylim(1e-9, 100)  # the lowest curves end above 1e-6, below is room for the legend
        ax.set_xlim(0, max(results[name].time[-1] for name in found[title]))
        ax.set_title(title)
        ax.legend(loc="lower left", fontsize=8)
    for ax in axes[len(titles) :]:
        ax.set_visible(False)
    for row in grid:
        row[0].set_ylabel(r"$\max_i |e_i|$ (deg)")
    return figure
