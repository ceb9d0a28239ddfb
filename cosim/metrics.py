"""What an attitude run achieved, in numbers: pointing, effort, vibration, momentum.

    error      rotation vector of q_RN* (x) q_BN, short way, body axes, deg; from `plant.q_BN` and `guidance.q_RN`
    settling   the last time at which any component of the error exceeds the threshold
    APE        absolute performance error: |error|, over the window from settling (the last half, if it never
               settles) to the end; largest, and not exceeded for 95 % and 99.7 % of that time
    RPE        relative performance error: |error - its mean over an interval|, for successive intervals of the window

APE and RPE are ECSS-E-ST-60-10C's. Numbers are what the recorded rows show: a peak between two rows is not seen.
A metric whose variables are not recorded is left out. Keys carry their unit.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from cosim.result import Result

Array = NDArray[np.float64]
ATTITUDES = ("plant.q_BN", "plant.q_SN")  # of the body, and of a drag-free satellite


def attitude(run: Result, threshold_deg: float = 0.1, rpe_interval_s: float = 10.0) -> dict[str, Any]:
    """Return the metrics of a run as plain numbers, lists and None, ready for JSON."""
    found: dict[str, Any] = {}
    error = attitude_error(run)
    if error is not None and len(error) > 1:
        found |= _pointing(run.time, error, threshold_deg, rpe_interval_s)
    torque = first(run, "plant.tau_B", "plant.tau_command_S", "controller.tau_command_B")
    if torque is not None and len(torque):
        found["peak torque (N.m)"] = np.max(np.abs(torque), axis=0).tolist()
        found["torque impulse (N.m.s)"] = (_weights(run.time) @ np.abs(torque)).tolist()
    for key, name in (
        ("peak modal coordinate (kg(1/2).m)", "plant.eta"),
        ("peak wheel speed (rad/s)", "actuators.wheel_speed"),
        ("peak wheel momentum (N.m.s)", "actuators.wheel_momentum"),
        ("peak stored momentum (N.m.s)", "actuators.h_B"),
    ):
        values = series(run, name)
        if values is not None and values.size:
            found[key] = float(np.max(np.abs(values)))
    return found | _momentum(run) | _events(run)


def series(run: Result, name: str) -> Array | None:
    """Return the rows of a variable, or None if it was not recorded."""
    return run[name] if name in run else None


def first(run: Result, *names: str) -> Array | None:
    """Return the rows of the first variable of `names` that was recorded."""
    return next((rows for name in names if (rows := series(run, name)) is not None), None)


def rotations(quaternions: Array) -> Rotation:
    """Return scalar-first quaternions q_BN as rotations v_N = q_BN (x) v_B (x) q_BN*."""
    return Rotation.from_quat(quaternions, scalar_first=True)


def attitude_error(run: Result) -> Array | None:
    """Return the rotation vector from reference to body, short way, body axes, deg, shape (n, 3)."""
    body, reference = first(run, *ATTITUDES), series(run, "guidance.q_RN")
    if body is None or reference is None or not len(body):
        return None
    return np.degrees((rotations(reference).inv() * rotations(body)).as_rotvec())


def settling_time(time: Array, error: Array, threshold: float) -> float | None:
    """Return the last time at which any column exceeds the threshold: None if at the end, the first time if never.

    Between two rows |error| is read as a straight line.
    """
    size = np.max(np.abs(np.atleast_2d(error.T)), axis=0)
    outside = np.flatnonzero(size > threshold)
    if not len(outside):
        return float(time[0])
    i = int(outside[-1])
    if i + 1 == len(time):
        return None
    part = (size[i] - threshold) / (size[i] - size[i + 1])
    return float(time[i] + part * (time[i + 1] - time[i]))


def _pointing(time: Array, error: Array, threshold: float, interval: float) -> dict[str, Any]:
    settled = settling_time(time, error, threshold)
    begin = settled if settled is not None else (time[0] + time[-1]) / 2
    window = time >= begin
    if np.count_nonzero(window) < 2:
        window[-2:] = True
    t, e = time[window], error[window]
    ape, (rpe, weights) = np.linalg.norm(e, axis=1), _relative(t, e, interval)
    return {
        "settling threshold (deg)": threshold,
        "settling time (s)": settled,
        "window of APE and RPE (s)": [float(t[0]), float(t[-1])],
        "APE max (deg)": float(ape.max()),
        "APE 95 % (deg)": _quantile(ape, _weights(t), 0.95),
        "APE 99.7 % (deg)": _quantile(ape, _weights(t), 0.997),
        "APE max per axis (deg)": np.max(np.abs(e), axis=0).tolist(),
        "interval of RPE (s)": min(interval, float(t[-1] - t[0])),
        "RPE max (deg)": float(rpe.max()),
        "RPE 95 % (deg)": _quantile(rpe, weights, 0.95),
        "RPE 99.7 % (deg)": _quantile(rpe, weights, 0.997),
    }


def _relative(t: Array, e: Array, interval: float) -> tuple[Array, Array]:
    """Return |e - mean| for successive whole intervals (one, if the window is shorter), and the weights of the rows."""
    count = max(1, int((t[-1] - t[0]) / interval + 1e-9))
    length = min(interval, t[-1] - t[0])
    sizes: list[Array] = []
    weights: list[Array] = []
    for k in range(count):
        # Half a nanosecond of slack: rows carry times of whole nanoseconds.
        inside = (t >= t[0] + k * length - 5e-10) & (t <= t[0] + (k + 1) * length + 5e-10)
        if np.count_nonzero(inside) < 2:
            continue
        w = _weights(t[inside])
        mean = w @ e[inside] / w.sum()
        sizes.append(np.linalg.norm(e[inside] - mean, axis=1))
        weights.append(w)
    if not sizes:  # rows farther apart than the interval
        return np.linalg.norm(e - e.mean(axis=0), axis=1), _weights(t)
    return np.concatenate(sizes), np.concatenate(weights)


def _weights(t: Array) -> Array:
    """Return the time that each row stands for (trapezoidal rule), so that rows may be unevenly spaced."""
    half = np.diff(t) / 2
    return np.concatenate([half, [0.0]]) + np.concatenate([[0.0], half])


def _quantile(values: Array, weights: Array, part: float) -> float:
    """Return the value that is not exceeded for `part` of the time."""
    order = np.argsort(values)
    reached = np.cumsum(weights[order])
    return float(values[order][min(int(np.searchsorted(reached, part * reached[-1])), len(values) - 1)])


def _momentum(run: Result) -> dict[str, Any]:
    """Return the drift of the total inertial momentum where nothing outside acts, else how much it changed."""
    total = series(run, "plant.H_N")
    if total is None or not len(total):
        return {}
    change = float(np.max(np.linalg.norm(total - total[0], axis=1)))
    stored = series(run, "plant.h_B")
    inside = _moves(stored)  # actuators store what they give: their torque is internal
    quiet = not any(np.any(rows) for rows in _external(run, inside))
    if not quiet:
        return {"momentum change (N.m.s)": change}
    parts: Sequence[Array] = [total] if stored is None else [total, stored]
    scale = max(float(np.max(np.linalg.norm(rows, axis=1))) for rows in parts)
    return {"momentum drift (N.m.s)": change, "momentum drift, relative (1)": change / scale if scale > 0 else 0.0}


def _events(run: Result) -> dict[str, Any]:
    """Return when a test mass reached its cage, for a plant that has one; None: it did not."""
    touched, free = series(run, "plant.cage_contact"), series(run, "plant.contact_time")
    if touched is None or free is None or not len(touched):
        return {}
    return {"test mass at its cage (s)": float(free[-1]) if touched[-1] > 0.5 else None}


def _external(run: Result, inside: bool) -> list[Array]:
    names = ["plant.tau_dist_B"] if inside else ["plant.tau_dist_B", "plant.tau_B"]
    names += ["plant.tau_dist_S", "plant.tau_command_S"]
    return [rows for name in names if (rows := series(run, name)) is not None]


def _moves(rows: Array | None) -> bool:
    return rows is not None and len(rows) > 0 and bool(np.any(rows != rows[0]))


def units(metrics: Mapping[str, Any]) -> dict[str, str]:
    """Return the unit of each metric, from its key."""
    return {key: key[key.index(" (") + 2 : -1] for key in metrics}
