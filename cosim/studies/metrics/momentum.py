"""Whether the angular momentum of body and actuators together was kept, in inertial axes.

    change   H(t) - H(t0),  H = H_N of the plant, with what the actuators store                          (1)
    drift    change - integral of q_BN (x) tau (x) q_BN* over the torques tau from outside        (2)
             tau: its tau_dist_B, and its tau_B unless that is what actuators give that store it
    relative: drift over the largest of |H|, |h| stored and |integral|                            (3)
    known to: the largest difference of the integral over all rows and over every second one      (4)

The integral is Simpson's rule over the recorded rows. A torque that the master holds over each step H from its value
at the start (at_point) or the end (after_step) gives the integral of its rows less, or more, H/2 times its change, by
Euler and Maclaurin; with that the drift of an ideal torque is of second order in the step. A drift is what the exchange
between FMUs has lost; a thruster's and a drag-free satellite's momentum has no drift here, for its torques act about
another point.

Of smooth rows (4) is some 15 times the error of the integral, of rows that miss a transient it is as large as that. A
drift below it is the integral's, not the exchange's: where (4) is more than `KEPT` of the momentum too, no drift is
given, and `unknown_drift` says why.
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from cosim.arrays import FloatArray
from cosim.results.result import Result
from cosim.studies.metrics.rows import rotations, series
from cosim.studies.roles import Loop

STEP_MEAN = "step mean"  # a timing in run.json
HELD = {"at_point": -0.5, "after_step": 0.5}
KEPT = 1e-5  # of the momentum: a drift that is known to this part of it is shown, whoever it is of
FEWEST = 5  # rows: Simpson's rule over every second one takes three
DRIFT = "momentum drift (N.m.s)"


@dataclass(frozen=True)
class Balance:
    """Change and drift of the total momentum, to what the drift is `known`, and the `scale` of both, N m s."""

    change: float
    drift: float
    known: float
    scale: float

    @property
    def tells(self) -> bool:
        """Whether the drift is one of the exchange, or so small that it does not matter whose it is."""
        return self.drift > self.known or self.known <= KEPT * self.scale


def measure_momentum(run: Result, loop: Loop) -> dict[str, Any]:
    """Return change and drift of the total momentum of a plant and its actuators by key, with their unit."""
    found = _balance(run, loop.plant)
    if found is None:
        return {}
    change = {"momentum change (N.m.s)": found.change}
    if math.isinf(found.known) or not found.tells:
        return change
    return change | {
        DRIFT: found.drift,
        "momentum drift, known to (N.m.s)": found.known,
        "momentum drift, relative (1)": found.drift / found.scale if found.scale > 0 else 0.0,
    }


def unknown_drift(run: Result, loop: Loop) -> str:
    """Return why a run whose rows have all that a drift takes has none, "" if it has one or lacks them."""
    found = _balance(run, loop.plant)
    if found is None or math.isinf(found.known) or found.tells:
        return ""
    apart = float(np.median(np.diff(run.time)))
    return (
        f"momentum drift, for rows {apart:.3g} s apart give the impulse from outside to {found.known:.2g} N.m.s only, "
        f"of {found.scale:.2g}: record more often (--every)"
    )


def _balance(run: Result, plant: str) -> Balance | None:
    """Return the balance of a plant's momentum; `known` is infinite where the rows lack what a drift takes."""
    total = series(run, f"{plant}.H_N")
    if total is None or not len(total):
        return None
    change = total - total[0]  # (1)
    acting = _acting(run, plant)
    if acting is None:
        return Balance(_largest(change), math.inf, math.inf, _largest(total))
    torque, jumps = acting
    whole, half = _integral(run.time, torque), _integral(run.time[::2], torque[::2])
    impulse = whole + jumps
    stored = series(run, f"{plant}.h_B")
    scale = max(_largest(rows) for rows in (total, impulse, total if stored is None else stored))  # (3)
    return Balance(_largest(change), _largest(change - impulse), _largest(whole[::2] - half), scale)  # (2), (4)


def _acting(run: Result, plant: str) -> tuple[FloatArray, FloatArray | float] | None:
    """Return the torque from outside at each row, inertial axes, and what holding it over steps adds to its integral.

    None where the rows cannot tell.
    """
    names = ("q_BN", "tau_dist_B", "tau_B", "h_B")
    body, outside, given, stored = (series(run, f"{plant}.{name}") for name in names)
    if body is None or outside is None or given is None or stored is None or len(body) < FEWEST:
        return None
    frame = rotations(body)
    outside = frame.apply(outside)
    timing = run.info.get("connections", {}).get(f"{plant}.tau_B", {}).get("timing", "")
    if timing == STEP_MEAN or ("connections" not in run.info and np.any(stored != stored[0])):
        return outside, 0.0  # it is the mean of the stored momentum's rate: internal
    given = frame.apply(given)
    step = HELD.get(timing, 0.0) * run.info.get("communication_step_size", 0.0)
    return outside + given, step * (given - given[0])


def _integral(time: FloatArray, rows: FloatArray) -> FloatArray:
    from scipy.integrate import cumulative_simpson  # slow to import: only for a run that has a momentum

    return cumulative_simpson(rows, x=time, axis=0, initial=0)


def _largest(rows: FloatArray) -> float:
    return float(np.max(np.linalg.norm(rows, axis=1)))
