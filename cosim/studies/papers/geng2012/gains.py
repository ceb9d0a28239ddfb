"""The rule by which geng2012's linear gain is designed, for another vehicle than the paper's.

Linear-quadratic: the gain minimises the integral of 11.2 |e|^2 + 390 |w|^2 + 20 |eta'|^2 + |u|^2 over
    x' = A x + B u,  M = J - delta^T delta,  a = 2 zeta Omega eta' + Omega^2 eta
    e' = w,  w' = M^-1 (u + delta^T a),  eta'' = -a - delta w'                                    (1)
The columns of the gain belong to e, eta, w and eta'.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

WEIGHTS = {"e": 11.2, "eta": 0.0, "omega": 390.0, "eta_dot": 20.0}


def design(vehicle: Mapping[str, Any]) -> dict[str, Any]:
    """Return the controller's gain of x for a vehicle (J, delta, Omega, zeta; without modes: J), and its surface.

    The surface keeps its columns of e and w; those of the modes, which drop out of it on the paper's own vehicle but
    for rounding, belong to that vehicle's modes and are zero here.
    """
    from scipy.linalg import solve_continuous_are  # slow to import, and the paper's own vehicle needs no design

    J, delta, Omega, zeta = (
        np.asarray(getattr(value, "value", value), float)
        for value in (vehicle.get(name, []) for name in ("J", "delta", "Omega", "zeta"))
    )
    n = Omega.size
    delta, stiffness, damping = delta.reshape(n, 3), np.diag(Omega**2), np.diag(2 * zeta * Omega)
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
    Q = np.diag(np.concatenate([np.full(size, WEIGHTS[name]) for name, size in sizes.items()]))
    gain = -B.T @ solve_continuous_are(A, B, Q, np.eye(3))
    columns = dict(zip(sizes, np.split(gain, np.cumsum(list(sizes.values()))[:-1], axis=1), strict=True))
    return {
        **{f"controller.G_{name}": part.tolist() for name, part in columns.items()},
        **{f"controller.D_{name}": np.zeros((3, n)).tolist() for name in ("eta", "eta_dot")},
    }
