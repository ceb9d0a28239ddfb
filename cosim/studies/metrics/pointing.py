"""How well an attitude follows its reference.

    error      rotation vector of q_RN* (x) q_BN, short way, body axes, deg; of the plant and the guidance
    settling   from the time that it is counted from to the last one at which any component of the error exceeds the
               threshold, 0 where that is earlier. Counted from the end of a slew, where the guidance tells it: the
               time t + remaining(t) of its last row with remaining > 0. Else from the first row.
    APE        absolute performance error: |error|, over the window from settling (the last half, if it never
               settles) to the end; largest, and not exceeded for 95 % and 99.7 % of that time
    RPE        relative performance error: |error - its mean over an interval|, for successive intervals of the window

APE and RPE are ECSS-E-ST-60-10C's. |error| is a norm, the threshold one of components, so that APE max may be up to
sqrt(3) times the threshold.
"""

from typing import Any

import numpy as np

from cosim.arrays import FloatArray
from cosim.results.result import Result
from cosim.studies.metrics.rows import first, rotations, series, spans
from cosim.studies.roles import Loop, loops

ATTITUDES = ("q_BN", "q_SN")  # of the body, and of a drag-free satellite
REMAINING = "remaining"  # of a guidance: the time until its reference is at rest for good, s
THRESHOLD = 0.1  # deg
INTERVAL = 10.0  # s, of RPE


def attitude_error(run: Result, loop: Loop | None = None) -> FloatArray | None:
    """Return the rotation vector from reference to body, short way, body axes, deg, shape (n, 3), of the first loop."""
    loop = loops(run)[0] if loop is None else loop
    body, reference = _attitude(run, loop), series(run, f"{loop.guidance}.q_RN")
    if body is None or reference is None or not len(body):
        return None
    return np.degrees((rotations(reference).inv() * rotations(body)).as_rotvec())


def _attitude(run: Result, loop: Loop) -> FloatArray | None:
    return first(run, *(f"{loop.plant}.{name}" for name in ATTITUDES))


def reference_rate(run: Result, loop: Loop | None = None) -> FloatArray | None:
    """Return the rate of the reference in body axes, rad/s, of the first loop."""
    loop = loops(run)[0] if loop is None else loop
    body, reference = _attitude(run, loop), series(run, f"{loop.guidance}.q_RN")
    rate = series(run, f"{loop.guidance}.omega_RN_R")
    if body is None or reference is None or rate is None or not len(body):
        return None
    return (rotations(body).inv() * rotations(reference)).apply(rate)


def settling_time(time: FloatArray, error: FloatArray, threshold: float) -> float | None:
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


def slew_end(run: Result, loop: Loop) -> float | None:
    """Return the time at which a slew of the reference ends, s, which may be after the last row; None: no slew."""
    remaining = series(run, f"{loop.guidance}.{REMAINING}")
    if remaining is None or remaining.ndim != 1:
        return None
    moving = np.flatnonzero(remaining > 0)
    return float(run.time[moving[-1]] + remaining[moving[-1]]) if len(moving) else None


def settled_after(time: FloatArray, error: FloatArray, threshold: float, start: float) -> float | None:
    """Return how long after `start` the error is within the threshold for good, s; None: not before the last row."""
    last = settling_time(time, error, threshold)
    return None if last is None or start > time[-1] else max(0.0, last - start)


def measure_pointing(
    time: FloatArray, error: FloatArray, threshold: float, interval: float, slewed: float | None = None
) -> dict[str, Any]:
    """Return the metrics of an error in deg by key, with their unit; `slewed`: when the slew ends, s, if there is one.

    A settling time is None where the error does not settle, or the slew does not end, before the last row.
    """
    start = float(time[0]) if slewed is None else slewed
    settled = settled_after(time, error, threshold, start)
    begin = start + settled if settled is not None else (time[0] + time[-1]) / 2
    window = time >= begin
    if np.count_nonzero(window) < 2:
        window[-2:] = True
    t, e = time[window], error[window]
    ape, (rpe, weights) = np.linalg.norm(e, axis=1), _relative(t, e, interval)
    return {
        "settling threshold, largest component (deg)": threshold,
        "settling counted from (s)": start,
        "settling time (s)": settled,
        "window of APE and RPE (s)": [float(t[0]), float(t[-1])],
        "APE max (deg)": float(ape.max()),
        "APE 95 % (deg)": _quantile(ape, spans(t), 0.95),
        "APE 99.7 % (deg)": _quantile(ape, spans(t), 0.997),
        "APE max per axis (deg)": np.max(np.abs(e), axis=0).tolist(),
        "interval of RPE (s)": min(interval, float(t[-1] - t[0])),
        "RPE max (deg)": float(rpe.max()),
        "RPE 95 % (deg)": _quantile(rpe, weights, 0.95),
        "RPE 99.7 % (deg)": _quantile(rpe, weights, 0.997),
    }


def _relative(t: FloatArray, e: FloatArray, interval: float) -> tuple[FloatArray, FloatArray]:
    """Return |e - mean| for successive whole intervals (one, if the window is shorter), and the weights of the rows."""
    count = max(1, int((t[-1] - t[0]) / interval + 1e-9))
    length = min(interval, t[-1] - t[0])
    sizes: list[FloatArray] = []
    weights: list[FloatArray] = []
    for k in range(count):
        # Half a nanosecond of slack: rows carry times of whole nanoseconds.
        inside = (t >= t[0] + k * length - 5e-10) & (t <= t[0] + (k + 1) * length + 5e-10)
        if np.count_nonzero(inside) < 2:
            continue
        w = spans(t[inside])
        mean = w @ e[inside] / w.sum()
        sizes.append(np.linalg.norm(e[inside] - mean, axis=1))
        weights.append(w)
    if not sizes:  # rows farther apart than the interval
        return np.linalg.norm(e - e.mean(axis=0), axis=1), spans(t)
    return np.concatenate(sizes), np.concatenate(weights)


def _quantile(values: FloatArray, weights: FloatArray, part: float) -> float:
    """Return the value that is not exceeded for `part` of the time."""
    order = np.argsort(values)
    reached = np.cumsum(weights[order])
    return float(values[order][min(int(np.searchsorted(reached, part * reached[-1])), len(values) - 1)])
