"""What zhang2018 plots: Euler angles 1-2-3 and their error, from plant.q_BN and guidance.q_RN, and its bound."""

import numpy as np

from cosim.arrays import FloatArray
from cosim.results.result import Result
from cosim.studies.metrics import rotations, settings
from cosim.studies.papers.zhang2018.system import DECAY, OVERSHOOT, RHO_0, RHO_INF

STEADY = 100.0  # s, from here on an error is the steady one


def angles(quaternions: FloatArray) -> FloatArray:
    """Return the Euler angles of sequence 1-2-3 of rows of scalar-first quaternions, deg."""
    return rotations(quaternions).as_euler("XYZ", degrees=True)


def tracking_error(run: Result) -> FloatArray:
    """Return e = theta - theta_d, deg, shape (n, 3)."""
    difference = angles(run["plant.q_BN"]) - angles(run["guidance.q_RN"])
    return (difference + 180) % 360 - 180


def performance(run: Result) -> tuple[FloatArray, list[float]]:
    """Return rho as a run flew with it, deg, shape (n, 3), and how much of it e may overshoot, of each axis."""
    rho_0, rho_inf, decay = (
        np.degrees(settings(run, "controller.rho_0", np.radians([RHO_0] * 3))),
        np.degrees(settings(run, "controller.rho_inf", np.radians([RHO_INF] * 3))),
        np.array(settings(run, "controller.k", [DECAY] * 3)),
    )
    rho = (rho_0 - rho_inf) * np.exp(-np.outer(run.time - run.time[0], decay)) + rho_inf  # (5)
    return rho, settings(run, "controller.overshoot", [OVERSHOOT] * 3)


def bound(time: FloatArray) -> FloatArray:
    """Return rho as published, deg."""
    return (RHO_0 - RHO_INF) * np.exp(-DECAY * (time - time[0])) + RHO_INF  # (5)
