"""The figures of li2014, with its numbers, and the spectral density that its subject asks for."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from cosim.arrays import FloatArray
from cosim.results.result import Result
from cosim.studies import plots
from cosim.studies.papers.li2014.claims import ACCURACY
from cosim.studies.papers.li2014.design_figures import draw_lyapunov, draw_variants
from cosim.studies.papers.li2014.hardware import hardware
from cosim.studies.papers.li2014.spectrum import (
    GOCE_BAND,
    GOCE_REQUIREMENT,
    LISA_BAND,
    SEGMENT,
    SETTLED,
    TAIL,
    attitude,
    contact,
    drag_density,
    lisa_pathfinder,
    relative_attitude,
    relative_position,
    residual_density,
    satellite_density,
)
from cosim.studies.papers.li2014.system import (
    ACTUATORS,
    DESIGN,
    DESIGN_NO_NN,
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

SHORT = {
    NN: "network",
    NO_NN: "no network",
    NN_LVLH: "network, LVLH",
    NO_NN_LVLH: "no network, LVLH",
    DESIGN: "network, design model",
    DESIGN_NO_NN: "no network, design model",
}
SPECTRA = {NN_SPECTRUM: "network", NO_NN_SPECTRUM: "no network", ACTUATORS: "network, limits and noise"}
LOOKS: dict[str, dict[str, Any]] = {name: plots.look(i) for i, name in enumerate(SHORT.values())}
TRANSIENT, NEAR = 15.0, 20.0  # s
ANGLES = ("roll", "pitch", "yaw")


def draw(results: Mapping[str, Result]) -> dict[str, Figure]:
    """Return figures 1-3, commands, variants, V, limits and spectral density, as far as `results` has the runs."""
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
        for name, figure in (("variants", draw_variants(flown)), ("lyapunov", draw_lyapunov(flown))):
            drawn |= {name: figure} if figure is not None else {}
        if PRINTED_START in flown:
            drawn["printed_start_with_limits"] = _limits(flown[PRINTED_START])
        if ACTUATORS in flown:
            drawn["actuators"] = _actuators(flown[ACTUATORS])
        spectra = {SPECTRA[name]: flown[name] for name in SPECTRA if name in flown}
        if any(run.time[-1] > SETTLED + SEGMENT for run in spectra.values()):
            drawn["residual_acceleration"] = _density(spectra)
    return drawn


def _errors(
    runs: Mapping[str, Result],
    rows: Callable[[Result], FloatArray],
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
            row[1].axhline(ACCURACY, color=plots.GREY, linewidth=1, label=f"1e-6 {unit}")
            row[1].set_xlim(0, end)
            row[1].set_ylim(1e-14, 1e-1)
            row[1].set_ylabel(f"$|{symbol}|$, {axis} ({unit})")
    if columns == 2:
        grid[0][0].set_title("transient")
        grid[0][1].set_title("absolute value, logarithmic")
    figure.align_ylabels([row[0] for row in grid])
    plots.legend(figure, columns=3)
    return figure


def _commands(runs: Mapping[str, Result]) -> Figure:
    """Draw the size of the commands of the three loops beside what the named hardware can do."""
    numbers = {name: np.asarray(value.value) for name, value in hardware().items()}
    force = np.max(np.abs([numbers["actuators.force_lower"], numbers["actuators.force_upper"]]), axis=0)
    rows: tuple[tuple[str, list[int], str, float], ...] = (
        ("f_command_S", [0], "force, x (N)", force[0]),
        ("f_command_S", [1, 2], "force, y or z (N)", force[1]),
        ("tau_command_S", [0, 1, 2], "satellite torque (N m)", numbers["actuators.torque_limit"][0]),
        ("tau_command_T", [0, 1, 2], "test mass torque (N m)", numbers["suspension.torque_limit"][0]),
    )
    figure, grid = plots.panels(4, 1, "Size of the commands of the three loops, and what the hardware can do")
    for (ax,), (name, axes, text, limit) in zip(grid, rows, strict=True):
        for label, run in runs.items():
            size = np.abs(run[f"controller.{name}"][:, axes]).max(axis=1)
            ax.semilogy(run.time, np.where(size > 0, size, np.nan), label=label, **LOOKS[label])
        ax.axhline(limit, color=plots.GREY, linewidth=1, label="limit of the hardware")
        ax.set_ylabel(text)
        ax.set_xlim(0, min(60.0, max(run.time[-1] for run in runs.values())))
    figure.align_ylabels([row[0] for row in grid])
    plots.legend(figure, columns=3)
    return figure


def _bounds(run: Result, name: str, axis: int) -> list[float]:
    """Return a parameter of the hardware as it was flown, of one axis; [] if the run does not tell."""
    parameters: Mapping[str, Any] = run.info.get("parameters") or {}
    found = parameters.get(f"{name}[{axis + 1}]")
    return [] if found is None else [float(found["value"])]


def _force(ax: Axes, run: Result, axis: int) -> None:
    """Draw a force asked and given, mN, with the thrusters' limits."""
    bounds = [1e3 * v for end in ("lower", "upper") for v in _bounds(run, f"actuators.force_{end}", axis)]
    asked, given = 1e3 * run["controller.f_command_S"][:, axis], 1e3 * run["actuators.f_S"][:, axis]
    plots.asked_and_given(ax, run.time, asked, given, bounds)
    ax.set_ylabel(f"force, {'xyz'[axis]} (mN)")


def _limits(run: Result) -> Figure:
    """Draw the flight from the printed start with limits, up to the cage."""
    figure, grid = plots.panels(5, 1, "Printed start with the limits of the actuators")
    position, *forces, angle = (row[0] for row in grid)
    caught = contact(run)
    for i, axis in enumerate("xyz"):
        position.plot(run.time, 1e3 * run["plant.r_rel"][:, i], label=axis, **plots.look(i))
        angle.plot(run.time, np.degrees(attitude(run)[:, i]), label=axis, **plots.look(i))
    for side in (-1, 1):
        position.axhline(side * GAP, color=plots.GREY, linewidth=1, label="cage")
    position.set_ylim(-1.3 * GAP, 1.3 * GAP)
    position.set_ylabel("test mass (mm)")
    for i, ax in enumerate(forces):
        _force(ax, run, i)
        asked = 1e3 * np.abs(run["controller.f_command_S"][:, i])
        bounds = [abs(v) for v in _bounds(run, "actuators.force_upper", i)] or [1e-3]
        plots.beyond_linear(ax, 1e3 * bounds[0], float(asked.max()))
    angle.set_ylabel("attitude (deg)")
    for (ax,) in grid:
        ax.set_xlim(0, 1.05 * run.time[-1])
        if caught is not None:
            ax.axvline(caught, color="#000000", linewidth=1, linestyle=":", label=f"at the cage, {caught:.1f} s")
    figure.align_ylabels([row[0] for row in grid])
    plots.legend(figure, columns=4)
    return figure


def _actuators(run: Result) -> Figure:
    """Draw what thrusters and suspension were asked for and gave, with their limits: the flight, and its end nearer."""
    figure, grid = plots.panels(6, 2, "Limits, slew, quantisation and noise: asked and given")
    figure.set_size_inches(10.0, figure.get_size_inches()[1])
    end = float(run.time[-1])
    torque, suspension = run["controller.tau_command_S"][:, 0], run["controller.tau_command_T"][:, 0]
    for column, begin in enumerate((0.0, max(0.0, end - NEAR))):
        rows = [line[column] for line in grid]
        for i, ax in enumerate(rows[:3]):
            _force(ax, run, i)
        bounds = [side * 1e3 * v for side in (-1, 1) for v in _bounds(run, "actuators.torque_limit", 0)]
        plots.asked_and_given(rows[3], run.time, 1e3 * torque, 1e3 * run["actuators.tau_S"][:, 0], bounds)
        bounds = [side * 1e9 * v for side in (-1, 1) for v in _bounds(run, "suspension.torque_limit", 0)]
        plots.asked_and_given(rows[4], run.time, 1e9 * suspension, 1e9 * run["suspension.tau_T"][:, 0], bounds)
        late = run.time >= begin
        for i, axis in enumerate("xyz"):
            rows[5].plot(run.time[late], 1e9 * run["plant.r_rel"][late, i], label=axis, **plots.look(i))
        if column == 1:  # near enough to see the quanta of the ion thruster
            force = 1e3 * run["controller.f_command_S"][late, 0]
            rows[0].set_ylim(float(force.min()) - 0.2, float(force.max()) + 0.2)
        for ax in rows:
            ax.set_xlim(begin, end)
    for ax, text in zip(
        (line[0] for line in grid[3:]), ("torque, x (mN m)", "suspension, x (nN m)", "test mass (nm)"), strict=True
    ):
        ax.set_ylabel(text)
    for line in grid:
        line[1].set_ylabel("")
    grid[0][0].set_title("the flight")
    grid[0][1].set_title(f"its last {NEAR:g} s")
    figure.align_ylabels([line[0] for line in grid])
    plots.legend(figure, columns=6)
    return figure


def _density(runs: Mapping[str, Result]) -> Figure:
    """Draw amplitude spectral densities along x: satellite and test mass, each with the requirement that fits it."""
    figure, ((satellite,), (mass,)) = plots.panels(2, 1, "Residual acceleration along-track (x, LVLH, gusts)", 3.0)
    some = next(iter(runs.values()))
    f, drag = drag_density(some)
    satellite.loglog(f[1:], drag[1:, 0], color="#000000", linewidth=1, label="drag, no control")
    for i, (name, run) in enumerate(runs.items()):
        for ax, (f, values) in ((satellite, satellite_density(run)), (mass, residual_density(run))):
            ax.loglog(f[1:], values[1:, 0], label=name, **plots.look(i))
    required: dict[str, Any] = {"color": plots.GREY, "linewidth": 2.5, "solid_capstyle": "butt"}
    satellite.loglog(GOCE_BAND, [GOCE_REQUIREMENT] * 2, **required)
    text = r"GOCE, often quoted: 2.5 $\cdot$ 10$^{-8}$"
    satellite.text(GOCE_BAND[0], 1.4 * GOCE_REQUIREMENT, text, color=plots.GREY)
    band = np.geomspace(*LISA_BAND, 50)
    mass.loglog(band, lisa_pathfinder(band), **required)
    text = r"LISA Pathfinder: 3 $\cdot$ 10$^{-14}$ (1 + (f / 3 mHz)$^2$)"
    mass.text(1.1e-3, 2e-12, text, color=plots.GREY)
    satellite.set_title("satellite: all but gravity", fontsize=10)
    mass.set_title("test mass: spring and damper only", fontsize=10)
    satellite.set_ylim(1e-10, 1e-5)
    mass.set_ylim(1e-16, 1e-10)
    for ax in (satellite, mass):
        ax.axvspan(GUST_BAND[1], 1.0, color="#000000", alpha=0.05, linewidth=0, label="beyond the gusts' band")
        ax.set_ylabel(r"density (m/s$^2$/$\sqrt{\mathrm{Hz}}$)")
    mass.set_xlim(LISA_BAND[0], 2 * GUST_BAND[1])
    mass.set_xlabel("frequency (Hz)")
    plots.legend(figure, columns=3)
    return figure
