"""The figures of zhang2018, with its numbers."""

from collections.abc import Mapping
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from cosim.results.result import Result
from cosim.studies import plots
from cosim.studies.metrics import reference_rate, series, settings
from cosim.studies.papers.claims import AXES
from cosim.studies.papers.zhang2018.system import (
    ATC,
    ATC_HALF,
    PPATC,
    PPATC_HALF,
    READINGS,
    RHO_INF,
)
from cosim.studies.papers.zhang2018.tracking import STEADY, angles, performance, tracking_error

SHORT = {PPATC: "PPATC", ATC: "ATC", PPATC_HALF: "PPATC, half gains", ATC_HALF: "ATC, half gains"}
LOOKS: dict[str, dict[str, Any]] = {  # blue: PPATC, orange: ATC, the paler with half gains
    "PPATC": {"color": plots.COLOURS[0], "linestyle": plots.LINES[0]},
    "ATC": {"color": plots.COLOURS[1], "linestyle": plots.LINES[1]},
    "PPATC, half gains": {"color": plots.COLOURS[5], "linestyle": plots.LINES[2]},
    "ATC, half gains": {"color": plots.COLOURS[4], "linestyle": plots.LINES[3], "linewidth": 1.8},
}


def draw(results: Mapping[str, Result]) -> dict[str, Figure]:
    """Return the paper's figures 2-11, in each reading of the unit of angle as far as `results` has the runs."""
    drawn: dict[str, Figure] = {}
    with mpl.rc_context(plots.STYLE):
        for reading, angles_in in READINGS.items():
            named = {SHORT[name]: results.get(name + angles_in.suffix) for name in SHORT}
            runs = {name: run for name, run in named.items() if run is not None and len(run) > 1}
            first = reading == next(iter(READINGS))
            ending, note = ("", "") if first else (f"_{reading}", f"; gains in {reading}")
            drawn |= {name + ending: figure for name, figure in _draw(runs, note).items()}
    return drawn


def _draw(runs: Mapping[str, Result], note: str) -> dict[str, Figure]:
    """Draw the runs of one reading, by their short names; `note` ends the titles."""
    full = {name: runs[name] for name in ("PPATC", "ATC") if name in runs}
    half = {name: run for name, run in runs.items() if name not in full}
    drawn: dict[str, Figure] = {}
    if full:
        drawn["fig02-04_tracking_error"] = _errors(full, f"Tracking error (figures 2-4){note}")
    if "PPATC" in full:
        run = full["PPATC"]
        drawn["fig05_attitude"] = _attitude(run, note)
        drawn["fig06_rates"] = _rates(run, note)
        drawn["fig07_torque"] = _torque(run, note)
        if all(series(run, "plant.eta") is not None for run in full.values()):
            drawn["fig08_modal_coordinates"] = _modes(full, note)
    if half:
        title = f"Tracking error, half gains (figures 9-11){note}"
        drawn["fig09-11_tracking_error_half_gains"] = _errors(full | half, title)
    return drawn


def _errors(runs: Mapping[str, Result], title: str) -> Figure:
    """Draw e per axis with the performance bounds: the transient on the left, the steady state on the right."""
    end = max(run.time[-1] for run in runs.values())
    columns = 2 if end > STEADY else 1
    figure, grid = plots.panels(3, columns, title, height=2.1)
    longest = max(runs.values(), key=lambda run: run.time[-1])
    bounded = next((run for run in runs.values() if settings(run, "controller.rho_0")), longest)
    rhos, overshoots = performance(bounded)
    steady = max(np.degrees(settings(bounded, "controller.rho_inf", np.radians(RHO_INF))))
    errors = {name: tracking_error(run) for name, run in runs.items()}
    for i, (row, axis) in enumerate(zip(grid, AXES, strict=True)):
        for name, run in runs.items():
            for ax in row:
                ax.plot(run.time, errors[name][:, i], label=name, **LOOKS[name])
        rho, start = rhos[:, i], errors[next(iter(runs))][0, i]
        lo, hi = (-overshoots[i], 1.0) if start >= 0 else (-1.0, overshoots[i])
        for ax in row:
            ax.fill_between(bounded.time, lo * rho, hi * rho, color="#000000", alpha=0.07, linewidth=0, label="bounds")
            for side in (lo, hi):
                ax.plot(bounded.time, side * rho, color=plots.GREY, linewidth=0.8)
        row[0].set_ylabel(f"$e_{i + 1}$, {axis} (deg)")
        row[0].set_xlim(0, min(60.0, end))
        if columns == 2:
            row[1].set_xlim(STEADY, end)
            row[1].set_ylim(-1.3 * steady, 1.3 * steady)
    if columns == 2:
        grid[0][0].set_title("transient")
        grid[0][1].set_title(f"steady state; bounds {steady:.4g} deg")
    figure.align_ylabels([row[0] for row in grid])
    plots.legend(figure, columns=5)
    return figure


def _attitude(run: Result, note: str) -> Figure:
    traces = {"body": (run.time, angles(run["plant.q_BN"])), "reference": (run.time, angles(run["guidance.q_RN"]))}
    names = [rf"${symbol}$, {axis}" for symbol, axis in zip((r"\varphi", r"\theta", r"\psi"), AXES, strict=True)]
    figure, _ = plots.stack(traces, names, "deg", f"Attitude, PPATC (figure 5){note}")
    plots.legend(figure)
    return figure


def _rates(run: Result, note: str) -> Figure:
    traces = {"body": (run.time, np.degrees(run["plant.omega_BN_B"]))}
    wanted = reference_rate(run)
    if wanted is not None:
        traces["reference"] = (run.time, np.degrees(wanted))
    figure, _ = plots.stack(
        traces, [rf"$\omega_{axis}$" for axis in "xyz"], "deg/s", f"Body rate, PPATC (figure 6){note}"
    )
    plots.legend(figure)
    return figure


def _torque(run: Result, note: str) -> Figure:
    """Draw u on the left, and on the right what remains after the first seconds."""
    rows = run["controller.tau_command_B"]
    large = np.max(np.abs(rows), axis=1) > 0.1 * np.max(np.abs(rows))
    later = float(np.clip(4 * run.time[large][-1], 1.0, 20.0)) if large.any() else 20.0
    columns = 2 if run.time[-1] > 1.5 * later else 1
    figure, grid = plots.panels(3, columns, f"Control torque, PPATC (figure 7); the paper has no limit{note}")
    for i, row in enumerate(grid):
        row[0].plot(run.time, rows[:, i], label="PPATC", **plots.look(0))
        row[0].set_ylabel(plots.label(f"$u_{i + 1}$, {AXES[i]}", "N.m"))
        row[0].set_xlim(0, min(later, run.time[-1]))
        if columns == 2:
            rest = run.time >= later
            row[1].plot(run.time[rest], rows[rest, i], label="PPATC", **plots.look(0))
            row[1].set_xlim(later, run.time[-1])
    if columns == 2:
        grid[0][0].set_title(f"first {later:g} s")
        grid[0][1].set_title(f"from {later:g} s on")
    figure.align_ylabels([row[0] for row in grid])
    plots.legend(figure)
    return figure


def _modes(runs: Mapping[str, Result], note: str) -> Figure:
    """Draw the modes of panel 1; those of panel 2 are their opposites."""
    figure, grid = plots.panels(4, 1, f"Modal coordinates of panel 1 (figure 8: PPATC){note}")
    axes = [row[0] for row in grid]
    for i, ax in enumerate(axes):
        rows = {name: run["plant.eta"][:, i] for name, run in runs.items()}
        exponent = plots.scale(rows.values())
        for name, run in runs.items():
            ax.plot(run.time, rows[name] / 10.0**exponent, label=name, **plots.thin(LOOKS[name], 0.9))
        ax.set_ylabel(plots.label(rf"$\eta_{{1{i + 1}}}$", "kg^(1/2).m", exponent))
        ax.margins(x=0.01)
    figure.align_ylabels(axes)
    plots.legend(figure)
    return figure
