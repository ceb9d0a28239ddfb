"""The figures that any attitude run has: one run or several overlaid."""

from collections.abc import Mapping, Sequence
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from cosim.arrays import FloatArray
from cosim.results.result import Result
from cosim.studies.metrics import attitude_error, first, reference_rate, series
from cosim.studies.plots.style import (
    COLOURS,
    GREY,
    LINES,
    STYLE,
    fill,
    legend,
    look,
    panels,
    peak,
    stack,
    traces_of,
)

NO_LIMIT = 1e9  # N m, a torque limit that stands for none


def draw(results: Mapping[str, Result]) -> dict[str, Figure]:
    """Return the figures that any attitude run has, by file name; runs are named by the keys of `results`."""
    with mpl.rc_context(STYLE):
        drawn = {
            "attitude_error": _attitude_error(results),
            "rates": _rates(results),
            "torque": _torque(results),
            "modal_coordinates": _modes(results),
        }
        if drawn["attitude_error"] is None:
            drawn["attitude"] = _attitude(results)
    return {name: figure for name, figure in drawn.items() if figure is not None}


def limits(result: Result) -> list[float]:
    """Return the torque limits that the run's parameters state, N m, one per axis or one for all; [] if none."""
    parameters: Mapping[str, Any] = result.info.get("parameters") or {}
    for instance in ("actuators", "plant", "controller"):
        start = f"{instance}.torque_limit"
        found = [v["value"] for name, v in parameters.items() if name == start or name.startswith(start + "[")]
        if found:
            return [] if max(found) >= NO_LIMIT else [float(v) for v in found]
    return []


def _attitude_error(results: Mapping[str, Result]) -> Figure | None:
    traces = traces_of(results, attitude_error)
    if not traces:
        return None
    figure, grid = panels(4, 1, "Attitude error: rotation from reference to body")
    axes = [line[0] for line in grid]
    fill(axes[:3], traces, [f"about {axis}" for axis in "xyz"], "deg")
    for index, (name, (time, rows)) in enumerate(traces.items()):
        angle = np.linalg.norm(rows, axis=1)
        axes[3].plot(time, np.where(angle > 0, angle, np.nan), label=name, **look(index))
    axes[3].set_yscale("log")
    axes[3].set_ylabel("angle (deg)")
    axes[3].margins(x=0.01)
    figure.align_ylabels(axes)
    legend(figure)
    return figure


def _attitude(results: Mapping[str, Result]) -> Figure | None:
    traces = traces_of(results, lambda result: series(result, "plant.q_BN"))
    if not traces:
        return None
    names = [f"$q_{i}$" for i in range(4)]
    figure, _ = stack(traces, names, "1", "Attitude quaternion of the body, scalar first, from inertial axes")
    legend(figure)
    return figure


def _rates(results: Mapping[str, Result]) -> Figure | None:
    traces = traces_of(results, lambda result: _degrees(series(result, "plant.omega_BN_B")))
    if not traces:
        return None
    if len(results) == 1:
        traces |= traces_of({"reference": next(iter(results.values()))}, lambda run: _degrees(reference_rate(run)))
    figure, _ = stack(traces, [rf"$\omega_{axis}$" for axis in "xyz"], "deg/s", "Body rate, body axes")
    legend(figure)
    return figure


def _torque(results: Mapping[str, Result]) -> Figure | None:
    traces = traces_of(results, lambda result: first(result, "plant.tau_B", "controller.tau_command_B"))
    if not traces:
        return None
    figure, grid = panels(3, 1, "Torque on the hub, body axes")
    axes = [line[0] for line in grid]
    exponents = fill(axes, traces, [rf"$\tau_{axis}$" for axis in "xyz"], "N.m")
    for index, name in enumerate(traces):
        _command(axes, results[name], name, exponents, index)
    for bound in {tuple(found) for result in results.values() if (found := limits(result))}:
        for i, ax in enumerate(axes):
            for side in (1, -1):
                value = side * bound[i % len(bound)] / 10.0 ** exponents[i]
                ax.axhline(value, color=GREY, linewidth=1, linestyle=LINES[3], label="limit")
    figure.align_ylabels(axes)
    legend(figure)
    return figure


def _command(axes: Sequence[Axes], result: Result, name: str, exponents: Sequence[int], index: int) -> None:
    """Draw the raw command thinly where the hub gets another; the axis follows it to three times what the hub gets.

    A controller that limits its command itself shows `u`, the one before.
    """
    command, given = first(result, "controller.u", "controller.tau_command_B"), series(result, "plant.tau_B")
    if command is None or given is None or command.shape != given.shape or np.array_equal(command, given):
        return
    for i, (ax, exponent) in enumerate(zip(axes, exponents, strict=True)):
        rows, reach = command[:, i] / 10.0**exponent, 3 * peak(given[:, i]) / 10.0**exponent
        colour = COLOURS[index % len(COLOURS)]
        ax.plot(result.time, rows, label=f"{name}: command", color=colour, linewidth=0.7, alpha=0.6, zorder=2)
        if peak(rows) > reach > 0:
            ax.set_ylim(-reach, reach)


def _modes(results: Mapping[str, Result]) -> Figure | None:
    traces = traces_of(results, lambda result: _columns(series(result, "plant.eta")))
    if not traces:
        return None
    count = max(rows.shape[1] for _, rows in traces.values())
    names = [rf"$\eta_{{{i + 1}}}$" for i in range(count)]
    columns = 2 if count > 4 else 1
    figure, _ = stack(traces, names, "kg(1/2).m", "Modal coordinates", columns=columns, width=0.9)
    legend(figure)
    return figure


def _degrees(rows: FloatArray | None) -> FloatArray | None:
    return None if rows is None else np.degrees(rows)


def _columns(rows: FloatArray | None) -> FloatArray | None:
    return None if rows is None or not rows.size else rows.reshape(len(rows), -1)
