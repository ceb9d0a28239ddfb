"""What ye2016 plots: 3-2-1 angles and rate of the body relative to the reference, and how good the estimates are."""

from collections.abc import Callable

import numpy as np

from cosim.arrays import FloatArray
from cosim.errors import UnknownName
from cosim.results.result import Result
from cosim.studies.metrics import reference_rate, rotations
from cosim.studies.papers.claims import window

LATE = 400.0  # s, from here on an error is the steady one


def euler_error(run: Result) -> FloatArray:
    """Return roll, pitch and yaw (sequence 3-2-1) of q_d^-1 (x) q, rad, shape (n, 3)."""
    relative = rotations(run["guidance.q_RN"]).inv() * rotations(run["plant.q_BN"])
    return relative.as_euler("ZYX")[:, ::-1]


def rate_error(run: Result) -> FloatArray:
    """Return omega - C(sigma) C(sigma_d)^T omega_f, rad/s, shape (n, 3)."""
    wanted = reference_rate(run)
    if wanted is None:
        raise UnknownName("variable", "guidance.omega_RN_R", "the result", run.names)
    return run["plant.omega_BN_B"] - wanted


def largest(error: Callable[[Result], FloatArray], run: Result, begin: float = 0.0) -> float:
    """Return the largest component of an error from a time on, s."""
    return float(np.max(np.abs(error(run)[window(run, begin)])))


def momentum_error(run: Result) -> FloatArray:
    """Return |estimated - true total momentum| as a part of what it is at the start."""
    wrong = np.linalg.norm(run["controller.H_hat_N"] - run["plant.H_N"], axis=1)
    return wrong / wrong[0]


def squared_norms(run: Result) -> tuple[FloatArray, FloatArray]:
    """Return |Theta_cGi|^2, a column a gyro, and |Theta_wGj|^2, a column a wheel."""
    return np.sum(run["controller.Theta_c"] ** 2, axis=2), np.sum(run["controller.Theta_w"] ** 2, axis=2)
