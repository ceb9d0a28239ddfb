"""Figures of geng2012, a column a cluster: the one that the paper flies, the one that it words, and configuration N."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from cosim.arrays import FloatArray
from cosim.results.result import Result
from cosim.studies import plots
from cosim.studies.metrics import attitude_error
from cosim.studies.papers.geng2012 import surface
from cosim.studies.papers.geng2012.measures import POINTING, RATE, SINGULAR, STEADY_RATE
from cosim.studies.papers.geng2012.system import (
    COMPENSATED,
    END_PHASE_COMPENSATED,
    END_PHASE_UNCOMPENSATED,
    POSITIONING_TIME,
    PREPOSITIONED,
    UNCOMPENSATED,
    Z_WHEEL_COMPENSATED,
    Z_WHEEL_UNCOMPENSATED,
)

COLUMNS = {
    "one wheel (section 4)": (Z_WHEEL_COMPENSATED, Z_WHEEL_UNCOMPENSATED),
    "three wheels at the end (sect. 2)": (END_PHASE_COMPENSATED, END_PHASE_UNCOMPENSATED),
    "configuration N (ours)": (COMPENSATED, UNCOMPENSATED),
}
LAWS = (r"with compensation, $\gamma$ = 1", r"without, $\rho_0$ = 0.15 N m")
NOTHING = 1e-14  # N2 m2, of V as it is drawn
AFTER = 5.0  # s, that is shown of the manoeuvre after the gimbals were turned

Draw = Callable[[list[Axes], str, Result, Mapping[str, Any]], None]
"""Draw a run into the panels of a column: axes from top to bottom, label, run, look."""


def draw(results: Mapping[str, Result]) -> dict[str, Figure]:
    """Return figures 4 to 9 for the clusters, V, and the turning of the gimbals, as far as `results` has the runs."""
    drawn: dict[str, Figure] = {}
    if set(results) & {name for names in list(COLUMNS.values())[:2] for name in names}:
        drawn["fig04_fig06_clusters"] = _motion(results)
        drawn["fig05_fig09_clusters"] = _modes(results)
        drawn["fig07_clusters"] = _singularity(results)
        if any(names[0] in results for names in COLUMNS.values()):
            drawn["fig08_clusters"] = _estimate(results)
    if any(names[1] in results for names in COLUMNS.values()):
        drawn["lyapunov"] = _lyapunov(results)
    if PREPOSITIONED in results:
        drawn["prepositioning"] = _turning(results[PREPOSITIONED])
    return drawn


def _columns(
    results: Mapping[str, Result], rows: int, title: str, height: float, show: Draw, laws: tuple[int, ...] = (0, 1)
) -> tuple[Figure, list[list[Axes]]]:
    """Return a figure with a column for each cluster that has runs of the laws, drawn by `show`."""
    found = {name: {LAWS[i]: results[names[i]] for i in laws if names[i] in results} for name, names in COLUMNS.items()}
    found = {name: runs for name, runs in found.items() if runs}
    figure, grid = plots.panels(rows, len(found), title, height)
    for column, (name, runs) in enumerate(found.items()):
        axes = [row[column] for row in grid]
        for label, run in runs.items():
            show(axes, label, run, plots.look(LAWS.index(label)))
            axes[0].set_xlim(0, run.time[-1])
        axes[0].set_title(name)
    return figure, grid


def _finish(figure: Figure, grid: list[list[Axes]], labels: tuple[str, ...], columns: int = 3) -> Figure:
    for row, label in zip(grid, labels, strict=True):
        row[0].set_ylabel(label)
        for ax in row:
            ax.minorticks_off()
    figure.align_ylabels([row[0] for row in grid])
    plots.legend(figure, columns=columns)
    return figure


def _largest(rows: FloatArray | None) -> FloatArray:
    return np.array([]) if rows is None else np.max(np.abs(rows), axis=1)


def _motion(results: Mapping[str, Result]) -> Figure:
    def show(axes: list[Axes], label: str, run: Result, look: Mapping[str, Any]) -> None:
        error = attitude_error(run)
        if error is None:
            return
        axes[0].plot(run.time, error[:, 1], label=label, **look)
        axes[1].semilogy(run.time, _largest(error), label=label, **look)
        axes[2].semilogy(run.time, np.degrees(_largest(run["plant.omega_BN_B"])), label=label, **look)

    figure, grid = _columns(results, 3, "Attitude error and body rate (figures 4 and 6)", 2.1, show)
    limit: dict[str, Any] = {"color": plots.GREY, "linewidth": 1}
    for error, rate in zip(*grid[1:], strict=True):
        error.axhline(POINTING, label=f"{POINTING} deg", linestyle=plots.LINES[1], **limit)
        rate.axhline(RATE, label=f"{RATE} deg/s", linestyle=plots.LINES[2], **limit)
        rate.axhline(STEADY_RATE, label=f"{STEADY_RATE} deg/s", linestyle=plots.LINES[3], **limit)
        error.set_ylim(1e-3, 100)
        rate.set_ylim(1e-4, 10)
    return _finish(figure, grid, (r"$e_y$ (deg)", r"$\max_i |e_i|$ (deg)", r"$\max_i |\omega_i|$ (deg/s)"))


def _modes(results: Mapping[str, Result]) -> Figure:
    def show(axes: list[Axes], label: str, run: Result, look: Mapping[str, Any]) -> None:
        for ax, eta in zip(axes, run["plant.eta"].T, strict=True):
            ax.plot(run.time, eta, label=label, **plots.thin(look, 1.0))

    figure, grid = _columns(results, 4, "Modal coordinates (figures 5 and 9)", 1.6, show)
    return _finish(figure, grid, tuple(plots.label(rf"$\eta_{i}$", "kg^(1/2).m") for i in (1, 2, 3, 4)))


def _singularity(results: Mapping[str, Result]) -> Figure:
    def show(axes: list[Axes], label: str, run: Result, look: Mapping[str, Any]) -> None:
        names = ("singularity", "inverted_determinant", "inverted_singular_value")
        for ax, name, floor in zip(axes, names, (1e-8, 0, 0), strict=True):
            ax.semilogy(run.time, np.maximum(run[f"steering.{name}"].ravel(), floor), label=label, **look)

    figure, grid = _columns(results, 3, "Measures of singularity (figure 7)", 2.1, show)
    for row, low in zip(grid, (1e-8, 3e-3, 3e-3), strict=True):
        for ax in row:
            ax.set_ylim(low, 3)
    for ax in (*grid[0], *grid[1]):
        ax.axhline(SINGULAR, color=plots.GREY, linewidth=1, label=f"singular below {SINGULAR}")
    return _finish(figure, grid, (r"$\det A A^T$ (1)", r"$\det(A W A^T + V)$ (1)", r"its $\sigma_{\min}$ (1)"))


def _estimate(results: Mapping[str, Result]) -> Figure:
    def show(axes: list[Axes], _label: str, run: Result, _look: Mapping[str, Any]) -> None:
        for i, axis in enumerate("xyz"):
            axes[0].plot(run.time, run["controller.rho"][:, i], label=rf"$\rho_{axis}$", **plots.look(i))
        axes[0].axvline(30.0, color=plots.GREY, linewidth=1, linestyle=plots.LINES[3], label="30 s")

    figure, grid = _columns(results, 1, r"Gain of the network, $\gamma$ = 1 (figure 8)", 2.8, show, laws=(0,))
    return _finish(figure, grid, (r"$\rho$ (N m)",), columns=4)


def _lyapunov(results: Mapping[str, Result]) -> Figure:
    """Draw V of both laws; below it E, rho and its part that acts in the boundary layer, of the constant gain."""

    def show(axes: list[Axes], label: str, run: Result, look: Mapping[str, Any]) -> None:
        axes[0].semilogy(run.time, np.maximum(surface.lyapunov(run), NOTHING), label=label, **look)
        if label == LAWS[1]:
            size = np.linalg.norm(surface.uncertainty(run), axis=1)
            axes[1].semilogy(run.time, size, color=plots.COLOURS[6], linewidth=1.0, label="|E|, without compensation")
            axes[1].semilogy(run.time, surface.acting(run), label=r"$\rho_0$ that acts", **plots.look(2))
            axes[1].semilogy(run.time, run["controller.rho"][:, 0], label=r"$\rho_0$", **plots.look(3))

    figure, grid = _columns(results, 2, r"$V = |\sigma|^2 / 2$ (sections 3.1, 3.2) and the uncertainty E", 2.6, show)
    for v, e in zip(*grid, strict=True):
        v.set_ylim(1e-13, 10)
        e.set_ylim(1e-6, 10)
    return _finish(figure, grid, (r"V (N$^2$ m$^2$)", "torque (N m)"))


def _turning(run: Result) -> Figure:
    figure, ((angle,), (torque,)) = plots.panels(2, 1, "Gyros turned before the manoeuvre (section 2)", 2.2)
    for i in range(2):
        degrees = np.degrees(run["actuators.gimbal_angle"][:, i])
        angle.plot(run.time, degrees, label=f"gyro {i + 1}", **plots.look(i))
    for i, axis in enumerate("xyz"):
        torque.plot(run.time, run["actuators.tau_B"][:, i], label=rf"$\tau_{axis}$", **plots.look(i + 2))
    for ax in (angle, torque):
        ax.axvline(0.0, color=plots.GREY, linewidth=1, linestyle=plots.LINES[3], label="manoeuvre begins")
        ax.set_xlim(-POSITIONING_TIME, AFTER)
    return _finish(figure, [[angle], [torque]], ("gimbal angle (deg)", "torque on the hub (N m)"))
