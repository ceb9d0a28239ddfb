"""The figures of li2014, with its numbers, and the spectral density that its subject asks for."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from cosim import plots
from cosim.metrics import series
from cosim.papers.li2014.spectrum import (
    GOCE_BAND,
    GOCE_REQUIREMENT,
    LISA_BAND,
    LISA_PATHFINDER,
    SEGMENT,
    SETTLED,
    TAIL,
    Array,
    attitude,
    contact,
    drag_density,
    relative_attitude,
    relative_position,
    residual_density,
)
from cosim.papers.li2014.system import (
    ACTUATORS,
    GAP,
    GUST_BAND,
    NN,
    NN_LVLH,
    NN_SPECTRUM,
    NO_NN,
    NO_NN_LVLH,
    NO_NN_SPECTRUM,
    PRINTED_START,
)
from cosim.result import Result

SHORT = {
    NN: "network",
    NO_NN: "no network",
    NN_LVLH: "network, LVLH",
    NO_NN_LVLH: "no network, LVLH",
}
SPECTRA = {NN_SPECTRUM: "network", NO_NN_SPECTRUM: "no network", ACTUATORS: "network, limits and noise"}
LOOKS: dict[str, dict[str, Any]] = {name: plots.look(i) for i, name in enumerate(SHORT.values())}
TRANSIENT = 15.0  # s
ANGLES = ("roll", "pitch", "yaw")


def figures(results: Mapping[str, Result]) -> dict[str, Figure]:
    """Return the paper's figures 1-3, limits and spectral density, as far as `results` has the runs."""
    flown = {name: run for name, run in results.items() if len(run) > 1}
    runs = {SHORT[name]: flown[name] for name in SHORT if name in flown}
    drawn: dict[str, Figure] = {}
    with mpl.rc_context(plots.STYLE):
        if runs:
            position = "Test mass in its cage (figure 1)"
            drawn["fig01_relative_position"] = _errors(runs, relative_position, "xyz", "m", "r", position)
            text = "Attitude of the satellite to its reference (figure 2)"
            drawn["fig02_attitude"] = _errors(runs, attitude, ANGLES, "rad", r"\varphi_{sc}", text)
            text = "Attitude of the test mass to the satellite (figure 3)"
            drawn["fig03_relative_attitude"] = _errors(runs, relative_attitude, ANGLES, "rad", r"\varphi_{rel}", text)
            drawn["commands"] = _commands(runs)
        if PRINTED_START in flown:
            drawn["printed_start_with_limits"] = _limits(flown[PRINTED_START])
        spectra = {SPECTRA[name]: flown[name] for name in SPECTRA if name in flown}
        if any(run.time[-1] > SETTLED + SEGMENT for run in spectra.values()):
            drawn["residual_acceleration"] = _density(spectra)
    return drawn


def _errors(
    runs: Mapping[str, Result],
    rows: Callable[[Result], Array],
    axes: Sequence[str],
    unit: str,
    symbol: str,
    title: str,
) -> Figure:
    """Draw three components: the transient on the left, |component| in the steady state on the right."""
    end = max(run.time[-1] for run in runs.values())
    columns = 2 if end > TAIL[0] else 1
    figure, grid = plots.panels(3, columns, title, height=2.0)
    values = {name: rows(run) for name, run in runs.items()}
    exponent = plots.scale(values.values())
    for i, (row, axis) in enumerate(zip(grid, axes, strict=True)):
        for name, run in runs.items():
            row[0].plot(run.time, values[name][:, i] / 10.0**exponent, label=name, **LOOKS[name])
            if columns == 2:
                size = np.abs(values[name][:, i])
                row[1].semilogy(run.time, np.where(size > 0, size, np.nan), label=name, **LOOKS[name])
        row[0].set_ylabel(plots.label(f"${symbol}$, {axis}", unit, exponent))
        row[0].set_xlim(0, min(TRANSIENT, end))
        if columns == 2:
            row[1].set_xlim(0, end)
            row[1].set_ylim(1e-14, 1e-1)
            row[1].set_ylabel(f"size ({unit})")
    if columns == 2:
        grid[0][0].set_title("transient")
        grid[0][1].set_title("size, logarithmic")
    figure.align_ylabels([row[0] for row in grid])
    plots.legend(figure)
    return figure


def _commands(runs: Mapping[str, Result]) -> Figure:
    """Draw the size of the commands of the three loops."""
    names = ("f_command_S", "tau_command_S", "tau_command_T")
    texts = ("force (N)", "satellite torque (N m)", "test mass torque (N m)")
    limits = (20e-3, 1e-3, 2e-8)
    figure, grid = plots.panels(3, 1, "Commands of the three loops, and what the named thrusters can do", height=2.0)
    for row, name, text, limit in zip(grid, names, texts, limits, strict=True):
        for label, run in runs.items():
            size = np.abs(run[f"controller.{name}"]).max(axis=1)
            row[0].semilogy(run.time, np.where(size > 0, size, np.nan), label=label, **LOOKS[label])
        row[0].axhline(limit, color=plots.GREY, linewidth=1, label="limit of the hardware")
        row[0].set_ylabel(text)
        row[0].set_xlim(0, min(60.0, max(run.time[-1] for run in runs.values())))
    figure.align_ylabels([row[0] for row in grid])
    plots.legend(figure, columns=3)
    return figure


def _limits(run: Result) -> Figure:
    """Draw the flight from the printed start with limits, up to the cage."""
    figure, grid = plots.panels(3, 1, "Printed start with the limits of the actuators", height=2.0)
    caught = contact(run)
    last = run.time[-1] if caught is None else 1.4 * caught
    for i, axis in enumerate("xyz"):
        grid[0][0].plot(run.time, 1e3 * run["plant.r_rel"][:, i], label=axis, **plots.look(i))
        grid[1][0].plot(run.time, 1e3 * run["actuators.f_S"][:, i], label=axis, **plots.look(i))
        command = np.abs(run["controller.f_command_S"][:, i])
        grid[2][0].semilogy(run.time, np.where(command > 0, command, np.nan), label=axis, **plots.look(i))
    for side in (-1, 1):
        grid[0][0].axhline(side * GAP, color=plots.GREY, linewidth=1, label="cage")
    grid[0][0].set_ylim(-1.3 * GAP, 1.3 * GAP)
    grid[0][0].set_ylabel("test mass (mm)")
    grid[1][0].set_ylabel("force given (mN)")
    grid[2][0].set_ylabel("force asked (N)")
    for (ax,) in grid:
        ax.set_xlim(0, last)
        if caught is not None:
            ax.axvline(caught, color="#000000", linewidth=1, linestyle=":", label=f"at the cage, {caught:.1f} s")
    figure.align_ylabels([row[0] for row in grid])
    plots.legend(figure, columns=5)
    return figure


def _density(runs: Mapping[str, Result]) -> Figure:
    """Draw the amplitude spectral density of the test mass, x axis, with two missions' requirements."""
    figure, ((ax,),) = plots.panels(1, 1, "Acceleration of the test mass, along-track", height=4.2)
    some = next(iter(runs.values()))
    if series(some, "environment.f_dist_B") is not None:
        f, drag = drag_density(some)
        ax.loglog(f[1:], drag[1:, 0], color="#000000", linewidth=1, label="drag, no control")
    for i, (name, run) in enumerate(runs.items()):
        f, values = residual_density(run)
        ax.loglog(f[1:], values[1:, 0], label=name, **plots.look(i))
    for band, level, place, text in (
        (GOCE_BAND, GOCE_REQUIREMENT, 1.4, "GOCE, drag-free control"),
        (LISA_BAND, LISA_PATHFINDER, 0.45, "LISA Pathfinder requirement"),
    ):
        ax.loglog(band, [level] * 2, color=plots.GREY, linewidth=2.5, solid_capstyle="butt")
        ax.text(max(band[0], 2.3e-3), place * level, text, color=plots.GREY)
    ax.set_xlim(2e-3, GUST_BAND[1])
    ax.set_ylim(1e-16, 1e-5)
    ax.set_xlabel("frequency (Hz)")
    ax.set_ylabel(r"amplitude spectral density (m/s$^2$/$\sqrt{\mathrm{Hz}}$)")
    plots.legend(figure)
    return figure
