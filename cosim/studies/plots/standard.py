"""The figures that any attitude run has: one run or several overlaid."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from cosim.arrays import FloatArray
from cosim.results.result import Result
from cosim.studies.metrics import attitude_error, first, reference_rate, series, settings, torque
from cosim.studies.plots.clusters import draw_clusters
from cosim.studies.plots.estimates import draw_estimates
from cosim.studies.plots.marks import mark
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
)
from cosim.studies.roles import Loop, loops

NO_LIMIT = 1e9  # N m, a torque limit that stands for none


def draw(results: Mapping[str, Result]) -> dict[str, Figure]:
    """Return the figures that any attitude run has, by file name; runs are named by the keys of `results`.

    Of several plants in a run, each has figures of its own, NAME_PLANT; clusters, sensors and estimators have theirs.
    """
    of_run = {name: loops(result) for name, result in results.items()}
    plants = list(dict.fromkeys(loop.plant for found in of_run.values() for loop in found))
    several = any(len(found) > 1 for found in of_run.values())
    figures: dict[str, Figure] = {}
    with mpl.rc_context(STYLE):
        for plant in plants if several else plants[:1]:
            views = {
                name: View(result, loop)
                for name, result in results.items()
                for loop in of_run[name]
                if not several or loop.plant == plant
            }
            figures |= {f"{name}_{plant}" if several else name: figure for name, figure in _draw(views).items()}
    return mark(figures | draw_clusters(results) | draw_estimates(results), results)


@dataclass(frozen=True)
class View:
    """A run as one of its loops shows it."""

    run: Result
    loop: Loop

    def of_plant(self, name: str) -> FloatArray | None:
        """Return the rows of a variable of the plant."""
        return series(self.run, f"{self.loop.plant}.{name}")

    def torque(self) -> FloatArray | None:
        """Return the rows of the torque on the body."""
        return torque(self.run, self.loop)

    def command(self, *names: str) -> FloatArray | None:
        """Return the rows of the first of these variables that a controller has."""
        return first(self.run, *(f"{controller}.{n}" for n in names for controller in self.loop.controllers))


Views = Mapping[str, View]


def _draw(views: Views) -> dict[str, Figure]:
    drawn = {
        "attitude_error": _attitude_error(views),
        "rates": _rates(views),
        "torque": _torque(views),
        "modal_coordinates": _modes(views),
    }
    if drawn["attitude_error"] is None:
        drawn["attitude"] = _attitude(views)
    return {name: figure for name, figure in drawn.items() if figure is not None}


def limits(result: Result, loop: Loop | None = None) -> list[float]:
    """Return the torque limits that the parameters of a loop state, N m, one per axis or one for all; [] if none."""
    loop = loops(result)[0] if loop is None else loop
    for instance in (*loop.actuators, loop.plant, *loop.controllers):
        found = settings(result, f"{instance}.torque_limit")
        if found:
            return [] if max(found) >= NO_LIMIT else found
    return []


def _traces(views: Views, rows: Callable[[View], FloatArray | None]) -> dict[str, tuple[FloatArray, FloatArray]]:
    """Return label -> (time, rows) for the runs that have the quantity."""
    found = {name: (view.run.time, values) for name, view in views.items() if (values := rows(view)) is not None}
    return {name: trace for name, trace in found.items() if trace[1].size}


def _attitude_error(views: Views) -> Figure | None:
    traces = _traces(views, lambda view: attitude_error(view.run, view.loop))
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


def _attitude(views: Views) -> Figure | None:
    traces = _traces(views, lambda view: view.of_plant("q_BN"))
    if not traces:
        return None
    names = [f"$q_{i}$" for i in range(4)]
    figure, _ = stack(traces, names, "1", "Attitude quaternion of the body, scalar first, from inertial axes")
    legend(figure)
    return figure


def _rates(views: Views) -> Figure | None:
    traces = _traces(views, lambda view: _degrees(view.of_plant("omega_BN_B")))
    if not traces:
        return None
    if len(views) == 1:
        only = {"reference": next(iter(views.values()))}
        traces |= _traces(only, lambda view: _degrees(reference_rate(view.run, view.loop)))
    figure, _ = stack(traces, [rf"$\omega_{axis}$" for axis in "xyz"], "deg/s", "Body rate, body axes")
    legend(figure)
    return figure


def _torque(views: Views) -> Figure | None:
    traces = _traces(views, _given)
    if not traces:
        return None
    figure, grid = panels(3, 1, "Torque on the hub, body axes")
    axes = [line[0] for line in grid]
    exponents = fill(axes, traces, [rf"$\tau_{axis}$" for axis in "xyz"], "N.m")
    for index, name in enumerate(traces):
        _command(axes, views[name], name, exponents, index)
    for bound in {tuple(found) for view in views.values() if (found := limits(view.run, view.loop))}:
        for i, ax in enumerate(axes):
            for side in (1, -1):
                value = side * bound[i % len(bound)] / 10.0 ** exponents[i]
                ax.axhline(value, color=GREY, linewidth=1, linestyle=LINES[3], label="limit")
    figure.align_ylabels(axes)
    legend(figure)
    return figure


def _command(axes: Sequence[Axes], view: View, name: str, exponents: Sequence[int], index: int) -> None:
    """Draw the raw command thinly where the hub gets another; the axis follows it to three times what the hub gets.

    A controller that limits its command itself shows `u`, the one before.
    """
    command, given = view.command("u", "tau_command_B"), view.torque()
    if command is None or given is None or command.shape != given.shape or np.array_equal(command, given):
        return
    for i, (ax, exponent) in enumerate(zip(axes, exponents, strict=True)):
        rows, reach = command[:, i] / 10.0**exponent, 3 * peak(given[:, i]) / 10.0**exponent
        colour = COLOURS[index % len(COLOURS)]
        ax.plot(view.run.time, rows, label=f"{name}: command", color=colour, linewidth=0.7, alpha=0.6, zorder=2)
        if peak(rows) > reach > 0:
            ax.set_ylim(-reach, reach)


def _modes(views: Views) -> Figure | None:
    traces = _traces(views, lambda view: _columns(view.of_plant("eta")))
    if not traces:
        return None
    count = max(rows.shape[1] for _, rows in traces.values())
    names = [rf"$\eta_{{{i + 1}}}$" for i in range(count)]
    columns = 2 if count > 4 else 1
    figure, _ = stack(traces, names, "kg^(1/2).m", "Modal coordinates", columns=columns, width=0.9)
    legend(figure)
    return figure


def _given(view: View) -> FloatArray | None:
    """Return the torque on the hub; without one, what is commanded."""
    given = view.torque()
    return view.command("tau_command_B") if given is None else given


def _degrees(rows: FloatArray | None) -> FloatArray | None:
    return None if rows is None else np.degrees(rows)


def _columns(rows: FloatArray | None) -> FloatArray | None:
    return None if rows is None or not rows.size else rows.reshape(len(rows), -1)
