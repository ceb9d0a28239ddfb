"""Wheels and gyros: speed, momentum and torque of every cluster that a run has."""

from collections.abc import Mapping

from matplotlib.figure import Figure

from cosim.results.result import Result
from cosim.studies.plots.pages import Panel, Trace, draw_panels
from cosim.studies.plots.shown import components_of, unit_of
from cosim.studies.roles import loops

OF_ROTORS = ("wheel_speed", "wheel_momentum", "motor_torque", "gimbal_angle", "gimbal_rate")
OF_ALL = ("h_B", "tau_B")
"""What a cluster may show, in the order of the panels."""


def draw_clusters(runs: Mapping[str, Result]) -> dict[str, Figure]:
    """Return a figure of each cluster with wheels or gyros, "cluster"; of several "cluster_INSTANCE".

    Clusters of one place in the runs' order are overlaid, whatever their names.
    """
    clusters: dict[str, list[str]] = {}  # run -> its clusters
    for label, run in runs.items():
        own = dict.fromkeys(name for loop in loops(run) for name in loop.actuators)
        clusters[label] = [name for name in own if any(f"{name}.{port}" in run for port in OF_ROTORS)]
    count = max(map(len, clusters.values()), default=0)
    figures: dict[str, Figure] = {}
    for place in range(count):
        shown = {label: names[place] for label, names in clusters.items() if len(names) > place}
        title = ", ".join(dict.fromkeys(shown.values()))
        file = "cluster" if count == 1 else f"cluster_{next(iter(shown.values()))}"
        figures |= draw_panels(_panels(runs, shown), file, f"Cluster {title}: rotors, momentum and torque")
    return figures


def _panels(runs: Mapping[str, Result], shown: Mapping[str, str]) -> list[Panel]:
    panels: list[Panel] = []
    for port in (*OF_ROTORS, *OF_ALL):
        having = {label: f"{name}.{port}" for label, name in shown.items() if f"{name}.{port}" in runs[label]}
        if not having:
            continue
        first, name = next(iter(having.items()))
        unit, factor = unit_of(name, runs[first].units.get(name))
        traces = [
            Trace(label, runs[label].time, factor * runs[label][full].reshape(len(runs[label]), -1))
            for label, full in having.items()
        ]
        widest = max((runs[label][full].shape[1:] for label, full in having.items()), key=lambda shape: shape or (1,))
        panels.append(Panel(port, unit, _counted(name, widest, port), traces))
    return panels


def _counted(name: str, shape: tuple[int, ...], port: str) -> list[str]:
    """Return the names of components: rotors are counted, three of them too."""
    return [str(i + 1) for i in range(shape[0] if shape else 1)] if port in OF_ROTORS else components_of(name, shape)
