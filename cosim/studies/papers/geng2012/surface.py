"""What drives geng2012's surface along a flight: the uncertainty E, the gain that acts against it, V.

    B (u + E) is what the flight did:  E = M w' - u - F (C eta' + K eta),  M = J - F F^T, J nominal        (1)
    w' = (J_true - F F^T)^-1 (tau + d - w x (J_true w + F eta' + h) + F (C eta' + K eta))                   (2)
    V = |sigma|^2 / 2,  V' = s^T (E - rho s / (|s| + epsilon))                                              (3)
    by the triangle inequality V' < 0 where |E| < rho |s| / (|s| + epsilon)                                 (4)

E contains what the inertia is off, the disturbance, the gyroscopic torque and what the actuators do not give; of it
nothing is taken from the controller but u. In (4) with the boundary layer of our law; printed is |E| < rho.

Symbols: w body rate, tau torque on the hub, d disturbance, h momentum of the actuators, K = diag(Omega^2),
C = diag(2 zeta Omega), all in body axes.
Source: Y. Geng, W. Wu, Y. Ma, Neural network compensation of flexible satellite rapid maneuver, J. Harbin Inst. Tech.
44(5), 2012, section 3.1; the equation numbers here are this file's.
Limits: e' = w in the model of the law; what that leaves of E is not in (1).
"""

import numpy as np

from components.numbers.geng2012 import EPSILON, MISMATCH, OMEGA, ZETA, F, J
from cosim.arrays import BoolArray, FloatArray
from cosim.results.result import Result

COUPLING, NOMINAL = np.array(F), np.array(J)


def uncertainty(run: Result, mismatch: float = MISMATCH) -> FloatArray:
    """Return E at every row, N m; mismatch: true J over nominal J."""
    w, eta, eta_dot = (run[f"plant.{name}"] for name in ("omega_BN_B", "eta", "eta_dot"))
    elastic = (2 * np.array(ZETA) * OMEGA * eta_dot + np.square(OMEGA) * eta) @ COUPLING.T
    momentum = mismatch * w @ NOMINAL + eta_dot @ COUPLING.T + run["actuators.h_B"]
    hub = run["actuators.tau_B"] + run["environment.tau_dist_B"] - np.cross(w, momentum) + elastic
    stiff = COUPLING @ COUPLING.T
    w_dot = np.linalg.solve(mismatch * NOMINAL - stiff, hub.T).T  # (2)
    return w_dot @ (NOMINAL - stiff) - run["controller.tau_command_B"] - elastic  # (1)


def lyapunov(run: Result) -> FloatArray:
    """Return V at every row, N2 m2."""
    return np.sum(np.square(run["controller.sigma"]), axis=1) / 2  # (3)


def acting(run: Result) -> FloatArray:
    """Return the part of a constant gain that acts within the boundary layer, N m."""
    size = np.linalg.norm(run["controller.s"], axis=1)
    return run["controller.rho"][:, 0] * size / (size + EPSILON)  # (4)


def slopes(run: Result, held: BoolArray) -> FloatArray:
    """Return the change of V from row to row, N2 m2, of the intervals at both ends of which something held."""
    return np.diff(lyapunov(run))[held[1:] & held[:-1]]
