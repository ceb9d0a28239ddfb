"""What xiao2011 plots: Euler angles 3-2-1 from the orbit frame, their rates, and when they and the modes have settled.

Settled: the last time outside a part of each angle's own start, or of each mode's own peak; the worst one counts. Of
angles that move it is their error that settles.
"""

import numpy as np

from cosim.arrays import FloatArray
from cosim.results.result import Result
from cosim.studies.metrics import rotations, series, settling_time


def angles(run: Result) -> FloatArray:
    """Return Theta = (phi, theta, psi), the attitude of the body in the orbit frame, rad, shape (n, 3)."""
    frame = "guidance.q_ON" if series(run, "guidance.q_ON") is not None else "guidance.q_RN"
    return (rotations(run[frame]).inv() * rotations(run["plant.q_BN"])).as_euler("ZYX")[:, ::-1]


def deviation(run: Result) -> FloatArray:
    """Return z1, the angles less those wanted, rad, shape (n, 3)."""
    wanted = series(run, "guidance.y_d")
    return angles(run) if wanted is None else angles(run) - wanted  # (6)


def rates(run: Result) -> FloatArray:
    """Return the body rate relative to the orbit frame, rad/s, shape (n, 3)."""
    error = rotations(run["guidance.q_RN"]).inv() * rotations(run["plant.q_BN"])
    return run["plant.omega_BN_B"] - error.inv().apply(run["guidance.omega_RN_R"])


def settling(run: Result, part: float) -> FloatArray:
    """Return when each angle has come to stay within `part` of its own start; inf where it does not."""
    z1 = deviation(run)
    return _last_exits(run.time, z1, part * np.abs(z1[0]))


def vibration(run: Result, part: float = 0.05) -> FloatArray:
    """Return when each mode has come to stay within `part` of its own peak; inf where it does not."""
    eta = run["plant.eta"]
    return _last_exits(run.time, eta, part * np.max(np.abs(eta), axis=0))


def _last_exits(time: FloatArray, rows: FloatArray, thresholds: FloatArray) -> FloatArray:
    times = [settling_time(time, rows[:, [i]], float(thresholds[i])) for i in range(rows.shape[1])]
    return np.array([np.inf if t is None else t for t in times])
