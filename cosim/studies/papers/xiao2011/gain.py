"""The L2 gain of xiao2011's loop: without saturation, linearised at the reference, and as it is flown.

    z1' = z2 - (k + 1/2) z1                                                                       (1)
    z2' = d - z1 - (p1 + kappa) z2 - F,  kappa = (gamma^2 + 1) / (2 gamma^2)                      (2)
    F' = n c1 z2                                                                                  (3)
Symbols: F = f_hat - f of n nodes at their centre, d the disturbing acceleration, rad/s^2; z1 rad, z2 rad/s; the gain is
that from d to y = (z1, z2) in the paper's units, per frequency; its supremum is the L2 gain.

Flown from rest with f and g known, so that the storage function starts at zero, an axis' gain is
    sqrt(integral of |y|^2 / integral of d^2),  d = tau_dist / J                                  (4)
"""

import numpy as np

from cosim.arrays import FloatArray
from cosim.results.result import Result
from cosim.studies.papers.xiao2011.system import C_1, GAMMA, INERTIA, NODES, P_1, K


def frequency_response(omega: FloatArray) -> FloatArray:
    """Return the gain from d to y at the angular frequencies omega, rad/s."""
    s = 1j * np.asarray(omega)
    kappa = (GAMMA**2 + 1) / (2 * GAMMA**2)
    z1_of_z2 = 1 / (s + K + 0.5)  # (1)
    z2 = 1 / (s + P_1 + kappa + z1_of_z2 + NODES * C_1 / s)  # (2), (3)
    return np.sqrt(np.abs(z2) ** 2 + np.abs(z1_of_z2 * z2) ** 2)


def flown(run: Result, begin: float = 0.0) -> FloatArray:
    """Return the gain of each axis of a run of a rigid body at rest, over whole rows from `begin` (s) on."""
    late = run.time >= begin
    time = run.time[late]
    y = run["controller.theta"][late] ** 2 + run["controller.z2"][late] ** 2
    d = (run["plant.tau_dist_B"][late] / INERTIA) ** 2
    return np.sqrt(np.trapezoid(y, time, axis=0) / np.trapezoid(d, time, axis=0))  # (4)


def supremum() -> tuple[float, float]:
    """Return the largest gain and its frequency, rad/s."""
    omega = np.geomspace(1e-2, 1e4, 20001)
    gains = frequency_response(omega)
    return float(gains.max()), float(omega[gains.argmax()])
