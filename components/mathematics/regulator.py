"""Linear-quadratic gain of a flexible vehicle at rest, designed with scipy where an FMU is built.

The gain minimises the integral of weights_i |x_i|^2 + |u|^2, x_i of e, eta, w, eta', over
    x' = A x + B u,  M = J - delta^T delta,  a = 2 zeta Omega eta' + Omega^2 eta
    e' = w,  w' = M^-1 (u + delta^T a),  eta'' = -a - delta w'                                    (1)
Source: textbook (algebraic Riccati equation); (1) is (4) of plants/flexible_spacecraft.py linearised at rest.
"""

from collections.abc import Mapping

import numpy as np


def regulator(
    J: np.ndarray, delta: np.ndarray, Omega: np.ndarray, zeta: np.ndarray, weights: Mapping[str, float]
) -> dict[str, np.ndarray]:
    """Return the gain's columns of e, eta, omega and eta_dot, shapes (3, 3) and (3, n), of a torque in N m.

    J (3, 3) in kg m2, delta (n, 3) in kg^1/2 m, Omega (n,) in rad/s, zeta (n,); `weights` has one of each of the four.
    """
    from scipy.linalg import solve_continuous_are  # slow to import

    n = Omega.size
    stiffness, damping = np.diag(Omega**2), np.diag(2 * zeta * Omega)
    inverse = np.linalg.inv(J - delta.T @ delta)
    rate = np.hstack([np.zeros((3, 3)), inverse @ delta.T @ stiffness, np.zeros((3, 3)), inverse @ delta.T @ damping])
    elastic = np.hstack([np.zeros((n, 3)), stiffness, np.zeros((n, 3)), damping])
    A = np.vstack(
        [
            np.eye(3, 6 + 2 * n, 3 + n),
            np.eye(n, 6 + 2 * n, 6 + n),
            rate,
            -elastic - delta @ rate,
        ]
    )  # (1)
    B = np.vstack([np.zeros((3 + n, 3)), inverse, -delta @ inverse])  # (1)
    sizes = {"e": 3, "eta": n, "omega": 3, "eta_dot": n}
    Q = np.diag(np.concatenate([np.full(size, weights[name]) for name, size in sizes.items()]))
    gain = -B.T @ solve_continuous_are(A, B, Q, np.eye(3))
    return dict(zip(sizes, np.split(gain, np.cumsum(list(sizes.values()))[:-1], axis=1), strict=True))
