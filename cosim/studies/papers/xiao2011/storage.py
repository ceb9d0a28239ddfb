"""The storage function of xiao2011's theorems along a flight, where the ideal weights are known: a rigid body at rest.

    V = (z1^2 + e2^2) / 2 + |W_f|^2 / (2 c1),  e2 = z2 - e1                                       (30)
    V(t) <= V(0) + 1/2 integral of (gamma^2 d^2 - |y|^2),  y = (z1, z2)                           (22), (35)
Without modes, orbit or rate f vanishes, so that W_f = 0 is ideal, and g is set exactly. Without a limit e1 = 0, and
(30) is (19). All nodes of the network are one: |W_f|^2 = n (f_hat / (n X))^2.

Symbols: d = tau_dist / J, rad/s^2; z1 rad, z2 rad/s; summed over the axes, in the units of the paper (T = 1 s).
Limits: what f has where angles and rates are not small is left out.
"""

import numpy as np

from cosim.arrays import FloatArray
from cosim.results.result import Result
from cosim.studies.papers.xiao2011.system import C_1, GAMMA, INERTIA, NODES, SIGMA, K

ROUNDING = 1e-3  # of the bound: what the sums over rows are off


def storage(run: Result) -> FloatArray:
    """Return V at each row, 1/s^2."""
    z1, z2, e1 = (run[f"controller.{name}"] for name in ("theta", "z2", "e1"))
    theta_dot = z2 - (K + 0.5) * z1
    X = np.exp(-np.minimum(np.sum(z1**2 + theta_dot**2, axis=1) / SIGMA**2, 300.0))  # (38), never zero
    weights = NODES * (run["controller.f_hat"] / (NODES * X[:, None])) ** 2
    return np.sum((z1**2 + (z2 - e1) ** 2) / 2 + weights / (2 * C_1), axis=1)  # (30)


def bound(run: Result) -> FloatArray:
    """Return what the theorems let V be at each row, 1/s^2."""
    y2 = run["controller.theta"] ** 2 + run["controller.z2"] ** 2
    d2 = (run["plant.tau_dist_B"] / INERTIA) ** 2
    rate = np.sum(GAMMA**2 * d2 - y2, axis=1) / 2
    steps = np.diff(run.time) * (rate[1:] + rate[:-1]) / 2
    return storage(run)[0] + np.concatenate([[0.0], np.cumsum(steps)])  # (22), (35)


def excess(run: Result) -> float:
    """Return by how much V exceeds its bound at most, as a part of the largest bound; zero if it never does."""
    allowed = bound(run)
    return float(max(np.max(storage(run) - allowed), 0.0) / np.max(np.abs(allowed)))
