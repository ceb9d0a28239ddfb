"""What sensors and estimators say, less the truth: found by their outputs, whatever their names.

    attitude   rotation vector of q_true* (x) q, short way, body axes                             (1)
    others     x - x_true, in the unit that the quantity is shown in                              (2)

A sensor or estimator is what has that role or, of an FMU that says none, has none of a loop's, and is fed by a plant,
directly or through others. The truth of an output is the plant's of the same name; that of a bias is the one of the
sensor ahead, of the same name, else its only one of a bias. Where an estimator shows the standard deviation of an error
(SIGMA), three of it are dotted to either side. Rows are of one time: latency and holding over samples are part of what
is shown.
"""

from collections.abc import Iterable, Mapping

import numpy as np
from matplotlib.figure import Figure

from cosim.arrays import FloatArray
from cosim.results.result import Result
from cosim.studies import roles
from cosim.studies.metrics import rotations, series
from cosim.studies.plots.pages import Panel, Trace, draw_panels
from cosim.studies.plots.shown import components_of, unit_of
from fmus.description.names import split_port

ESTIMATING = ("sensor", "estimator")
NO_TRUTH = ("tau_B", "h_B", "tau_dist_B", "H_N", "energy")  # of a plant: nothing estimates these by showing them
BIAS = "bias"
SIGMA = {"q_BN": "attitude_sigma", "bias": "bias_sigma"}
"""Output -> the output of one standard deviation of its error, of each component."""


def draw_estimates(runs: Mapping[str, Result]) -> dict[str, Figure]:
    """Return a figure of every sensor and estimator that any run has, "estimate_INSTANCE"."""
    panels: dict[str, dict[str, Panel]] = {}
    for label, run in runs.items():
        for instance, plant in estimating(run).items():
            for name, truth in _truths(run, instance, plant).items():
                found = panels.setdefault(instance, {})
                unit, components, rows = error(run, f"{instance}.{name}", truth)
                bound = _three_sigma(run, instance, name, rows.shape)
                old = found.get(name, Panel(f"{name}", unit, components, []))
                found[name] = Panel(name, unit, components, [*old.traces, Trace(label, run.time, rows, bound)])
    return {
        name: figure
        for instance, found in panels.items()
        for name, figure in draw_panels(
            list(found.values()), f"estimate_{instance}", f"{instance}: estimate less truth"
        ).items()
    }


def estimating(run: Result) -> dict[str, str]:
    """Return the sensors and estimators of a run, each with the plant that feeds it."""
    known = roles.find(run)
    plants = [name for name, role in known.items() if role == "plant"]
    found: dict[str, str] = {}
    for instance in run.info.get("components") or {}:
        if known.get(instance, "") in ("", *ESTIMATING):
            ahead = roles.upstream(run, instance)
            fed = [plant for plant in plants if plant in ahead]
            found |= {instance: fed[0]} if fed else {}
    return found


def error(run: Result, name: str, truth: str) -> tuple[str, list[str], FloatArray]:
    """Return unit, components and rows of an estimate less the truth."""
    shown, true = run[name], run[truth]
    components = components_of(name, shown.shape[1:])
    if components == ["w", "x", "y", "z"]:
        turned = (rotations(true).inv() * rotations(shown)).as_rotvec(degrees=True)  # (1)
        return "deg", ["x", "y", "z"], turned
    unit, factor = unit_of(name, run.units.get(name))
    return unit, components, factor * (shown - true).reshape(len(shown), -1)  # (2)


def _three_sigma(run: Result, instance: str, name: str, shape: tuple[int, ...]) -> FloatArray | None:
    """Return three standard deviations of an estimate's error, in the unit shown, None where there is none."""
    port = f"{instance}.{SIGMA.get(name, '')}"
    if name not in SIGMA or port not in run or run[port].shape != shape:
        return None
    return 3 * unit_of(port, run.units.get(port))[1] * run[port]


def _truths(run: Result, instance: str, plant: str) -> dict[str, str]:
    """Return the outputs of an instance of which the truth was recorded, with that."""
    found: dict[str, str] = {}
    outputs = [name for name in _shown(run, instance) if name not in NO_TRUTH]
    for name in outputs:
        truth = f"{plant}.{name}"
        if BIAS in name:
            truth = _bias(run, instance, name)
        if truth in run and run[truth].shape == run[f"{instance}.{name}"].shape and len(run):
            found[name] = truth
    return found


def _bias(run: Result, instance: str, name: str) -> str:
    """Return the true bias that an estimate is of, "" where no sensor ahead shows one."""
    for sensor in roles.upstream(run, instance):
        own = [n for n in _shown(run, sensor) if BIAS in n]
        if name in own or len(own) == 1:
            return f"{sensor}.{name if name in own else own[0]}"
    return ""


def _shown(run: Result, instance: str) -> Iterable[str]:
    """Return the outputs of an instance that were recorded as numbers."""
    inputs = run.info["components"].get(instance, {}).get("inputs", ())
    for port in run.names:
        owner, name = split_port(port)
        if owner == instance and name not in inputs and (rows := series(run, port)) is not None:
            if np.issubdtype(rows.dtype, np.floating):
                yield name
