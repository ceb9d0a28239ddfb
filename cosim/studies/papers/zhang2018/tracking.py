"""What zhang2018 plots: Euler angles 1-2-3 and their error, from plant.q_BN and guidance.q_RN, and its bound."""

import numpy as np

from cosim.arrays import FloatArray
from cosim.results.result import Result
from cosim.studies.metrics import rotations
from cosim.studies.papers.zhang2018.system import DECAY, RHO_0, RHO_INF

STEADY = 100.0  # s, from here on an error is the steady one


def angles(quaternions: FloatArray) -> FloatArray:
    """Return the Euler angles of sequence 1-2-3 of rows of scalar-first quaternions, deg."""
    return rotations(quaternions).as_euler("XYZ", degrees=True)


def tracking_error(run: Result) -> FloatArray:
    """Return e = theta - theta_d, deg, shape (n, 3)."""
    difference = angles(run["plant.q_BN"]) - angles(run["guidance.q_RN"])
    return (difference + 180) % 360 - 180


def bound(time: FloatArray) -> FloatArray:
    """Return rho, deg."""
    return (RHO_0 - RHO_INF) * np.exp(-DECAY * (time - time[0])) + RHO_INF  # (5)
