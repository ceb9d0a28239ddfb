"""The metrics of an attitude run, all in one table of names and numbers."""

from typing import Any

import numpy as np

from cosim.arrays import FloatArray
from cosim.results.result import Result
from cosim.studies.metrics.momentum import measure_momentum
from cosim.studies.metrics.pointing import INTERVAL, THRESHOLD, attitude_error, measure_pointing
from cosim.studies.metrics.rows import first, series, spans

PEAKS = {
    "peak modal coordinate (kg(1/2).m)": "plant.eta",
    "peak wheel speed (rad/s)": "actuators.wheel_speed",
    "peak wheel momentum (N.m.s)": "actuators.wheel_momentum",
    "peak gimbal rate (rad/s)": "actuators.gimbal_rate",
    "peak stored momentum (N.m.s)": "actuators.h_B",
    "peak distance of the test mass (m)": "plant.r_rel",
}


def measure(run: Result, threshold_deg: float = THRESHOLD, rpe_interval_s: float = INTERVAL) -> dict[str, Any]:
    """Return the metrics of a run as plain numbers, lists and None, ready for JSON."""
    found: dict[str, Any] = {}
    error = attitude_error(run)
    if error is not None and len(error) > 1:
        found |= measure_pointing(run.time, error, threshold_deg, rpe_interval_s)
    torque = first(run, "plant.tau_B", "plant.tau_command_S", "controller.tau_command_B")
    found |= _effort(run, torque, "torque", "N.m")
    found |= _effort(run, series(run, "plant.f_command_S"), "force", "N")
    for key, name in PEAKS.items():
        values = series(run, name)
        if values is not None and values.size:
            found[key] = float(np.max(np.abs(values)))
    return found | measure_momentum(run) | _events(run)


def _effort(run: Result, rows: FloatArray | None, what: str, unit: str) -> dict[str, Any]:
    """Return peak and impulse of each axis of what acts on the body."""
    if rows is None or not len(rows):
        return {}
    return {
        f"peak {what} ({unit})": np.max(np.abs(rows), axis=0).tolist(),
        f"{what} impulse ({unit}.s)": (spans(run.time) @ np.abs(rows)).tolist(),
    }


def _events(run: Result) -> dict[str, Any]:
    """Return when a test mass reached its cage, for a plant that has one; None: it did not."""
    touched, free = series(run, "plant.cage_contact"), series(run, "plant.contact_time")
    if touched is None or free is None or not len(touched):
        return {}
    return {"test mass at its cage (s)": float(free[-1]) if touched[-1] > 0.5 else None}
