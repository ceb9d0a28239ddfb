"""Whether the angular momentum of body and actuators together was kept, in inertial axes.

    change   H(t) - H(t0),  H = H_N of the plant, with what the actuators store                          (1)
    drift    change - integral of q_BN (x) tau (x) q_BN* over the torques tau from outside        (2)
             tau: its tau_dist_B, and its tau_B unless that is what actuators give that store it
    relative: drift over the largest of |H|, |h| stored and |integral|                            (3)

The integral is Simpson's rule over the recorded rows. A torque that the master holds over each step H from its value
at the start (at_point) or the end (after_step) gives the integral of its rows less, or more, H/2 times its change, by
Euler and Maclaurin; with that the drift of an ideal torque is of second order in the step. A drift is what the exchange
between FMUs has lost; a thruster's and a drag-free satellite's momentum has no drift here, for its torques act about
another point.
"""

from typing import Any

import numpy as np

from cosim.arrays import FloatArray
from cosim.results.result import Result
from cosim.studies.metrics.rows import rotations, series
from cosim.studies.roles import Loop

STEP_MEAN = "step mean"  # a timing in run.json
HELD = {"at_point": -0.5, "after_step": 0.5}


def measure_momentum(run: Result, loop: Loop) -> dict[str, Any]:
    """Return change and drift of the total momentum of a plant and its actuators by key, with their unit."""
    plant = loop.plant
    total = series(run, f"{plant}.H_N")
    if total is None or not len(total):
        return {}
    change = total - total[0]  # (1)
    found: dict[str, Any] = {"momentum change (N.m.s)": _largest(change)}
    impulse = _impulse(run, plant)
    if impulse is None:
        return found
    stored = series(run, f"{plant}.h_B")
    scale = max(_largest(rows) for rows in (total, impulse, total if stored is None else stored))  # (3)
    drift = _largest(change - impulse)  # (2)
    return found | {
        "momentum drift (N.m.s)": drift,
        "momentum drift, relative (1)": drift / scale if scale > 0 else 0.0,
    }


def _impulse(run: Result, plant: str) -> FloatArray | None:
    """Return the angular impulse from outside up to each row, inertial axes; None where the rows cannot tell."""
    names = ("q_BN", "tau_dist_B", "tau_B", "h_B")
    body, outside, given, stored = (series(run, f"{plant}.{name}") for name in names)
    if body is None or outside is None or given is None or stored is None or len(body) < 3:
        return None
    frame = rotations(body)
    impulse = _integral(run.time, frame.apply(outside))
    timing = run.info.get("connections", {}).get(f"{plant}.tau_B", {}).get("timing", "")
    if timing == STEP_MEAN or ("connections" not in run.info and np.any(stored != stored[0])):
        return impulse  # it is the mean of the stored momentum's rate: internal
    given = frame.apply(given)
    step = HELD.get(timing, 0.0) * run.info.get("communication_step_size", 0.0)
    return impulse + _integral(run.time, given) + step * (given - given[0])


def _integral(time: FloatArray, rows: FloatArray) -> FloatArray:
    from scipy.integrate import cumulative_simpson  # slow to import: only for a run that has a momentum

    return cumulative_simpson(rows, x=time, axis=0, initial=0)


def _largest(rows: FloatArray) -> float:
    return float(np.max(np.linalg.norm(rows, axis=1)))
