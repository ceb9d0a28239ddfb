"""The metrics of an attitude run, all in one table of names and numbers."""

from typing import Any

import numpy as np

from cosim.arrays import FloatArray
from cosim.results.result import Result
from cosim.studies.metrics.momentum import measure_momentum, unknown_drift
from cosim.studies.metrics.pointing import INTERVAL, REMAINING, THRESHOLD, attitude_error, measure_pointing, slew_end
from cosim.studies.metrics.rows import first, series, spans
from cosim.studies.metrics.torque import torque
from cosim.studies.roles import Loop, loops

PEAKS = {  # of a plant
    "peak modal coordinate (kg^(1/2).m)": "eta",
    "peak distance of the test mass (m)": "r_rel",
}
PEAKS_OF_A_CLUSTER = {
    "peak wheel speed (rad/s)": "wheel_speed",
    "peak wheel momentum (N.m.s)": "wheel_momentum",
    "peak gimbal rate (rad/s)": "gimbal_rate",
    "peak stored momentum (N.m.s)": "h_B",
}


def measure(run: Result, threshold_deg: float = THRESHOLD, rpe_interval_s: float = INTERVAL) -> dict[str, Any]:
    """Return the metrics of a run as plain numbers, lists and None, ready for JSON.

    Of several plants, and of several clusters of one, each has its metrics under "NAME: ".
    """
    found: dict[str, Any] = {}
    every = loops(run)
    for loop in every:
        prefix = f"{loop.plant}: " if len(every) > 1 else ""
        error = attitude_error(run, loop)
        if error is not None and len(error) > 1:
            end = slew_end(run, loop)
            found |= _named(prefix, measure_pointing(run.time, error, threshold_deg, rpe_interval_s, end))
        found |= _named(prefix, _of_plant(run, loop) | _of_clusters(run, loop) | measure_momentum(run, loop))
        found |= _named(prefix, _events(run, loop))
    return found


def not_measured(run: Result) -> str:
    """Return which metrics a run does not allow to take, and why, in one line; "" if it allows all."""
    every = loops(run)
    gaps = [f"{loop.plant}: {gap}" if len(every) > 1 else gap for loop in every for gap in _gaps(run, loop)]
    return "; ".join(dict.fromkeys(gaps))


def _named(prefix: str, found: dict[str, Any]) -> dict[str, Any]:
    return {f"{prefix}{key}": value for key, value in found.items()}


def _of_plant(run: Result, loop: Loop) -> dict[str, Any]:
    """Return effort and vibration of a plant; without a torque on it, of what its controller commands."""
    given = torque(run, loop)
    if given is None:
        commands = (f"{controller}.tau_command_B" for controller in loop.controllers)
        given = first(run, f"{loop.plant}.tau_command_S", *commands)
    found = _effort(run, given, "torque", "N.m")
    found |= _effort(run, series(run, f"{loop.plant}.f_command_S"), "force", "N")
    return found | _peaks(run, loop.plant, PEAKS)


def _of_clusters(run: Result, loop: Loop) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for cluster in loop.actuators:
        found |= _named(f"{cluster}: " if len(loop.actuators) > 1 else "", _peaks(run, cluster, PEAKS_OF_A_CLUSTER))
    return found


def _peaks(run: Result, instance: str, names: dict[str, str]) -> dict[str, Any]:
    rows = {key: series(run, f"{instance}.{name}") for key, name in names.items()}
    return {key: float(np.max(np.abs(values))) for key, values in rows.items() if values is not None and values.size}


def _effort(run: Result, rows: FloatArray | None, what: str, unit: str) -> dict[str, Any]:
    """Return peak and impulse of each axis of what acts on the body."""
    if rows is None or not len(rows):
        return {}
    return {
        f"peak {what} ({unit})": np.max(np.abs(rows), axis=0).tolist(),
        f"{what} impulse ({unit}.s)": (spans(run.time) @ np.abs(rows)).tolist(),
    }


def _events(run: Result, loop: Loop) -> dict[str, Any]:
    """Return when a test mass reached its cage, for a plant that has one; None: it did not."""
    touched, free = (series(run, f"{loop.plant}.{name}") for name in ("cage_contact", "contact_time"))
    if touched is None or free is None or not len(touched):
        return {}
    return {"test mass at its cage (s)": float(free[-1]) if touched[-1] > 0.5 else None}


def _gaps(run: Result, loop: Loop) -> list[str]:
    """Return which metrics of a loop are missing, and why."""
    if not loop.plant:
        return ["attitude, for no instance is an attitude plant (it shows q_BN and omega_BN_B and takes tau_B)"]
    gaps: list[str] = []
    shown = run.info.get("components", {}).get(loop.guidance, {}).get("outputs", ())
    if first(run, f"{loop.plant}.q_BN", f"{loop.plant}.q_SN") is None:
        gaps.append(f"pointing, for the attitude of {loop.plant} was not recorded")
    elif not loop.guidance:
        gaps.append("pointing, for no instance gives one reference (q_RN)")
    elif f"{loop.guidance}.q_RN" not in run:
        gaps.append(f"pointing, for {loop.guidance}.q_RN was not recorded")
    elif REMAINING in shown and f"{loop.guidance}.{REMAINING}" not in run:
        gaps.append(f"settling from the end of the slew, for {loop.guidance}.{REMAINING} was not recorded")
    drag_free = f"{loop.plant}.q_SN" in run
    if not drag_free and f"{loop.plant}.H_N" not in run:
        gaps.append(f"momentum, for {loop.plant} has no H_N that was recorded")
    elif drift := unknown_drift(run, loop):
        gaps.append(drift)
    return gaps
