"""The theorem of ye2016 on its flights: V of its (23), with the true axes and momentum, which a simulation knows.

V = e^T P e / 2 + |Theta_F - true|^2/(2 alpha_F) + |Theta_c, Theta_w - true|^2/(2 alpha_G)    (23)
V' = -e^T Q e / 2,  Q = 1, while the projection does not act
"""

from collections.abc import Mapping

import numpy as np

from cosim.arrays import FloatArray
from cosim.results.result import Result
from cosim.studies.papers.claims import Measured
from cosim.studies.papers.ye2016 import gains
from cosim.studies.papers.ye2016.system import (
    ADAPTIVE,
    ALPHA_F,
    ALPHA_F_PRINTED,
    ALPHA_G,
    PRINTED,
    unknown_axes,
    unknown_momentum,
)

FLIGHTS = {PRINTED: ALPHA_F_PRINTED, ADAPTIVE: ALPHA_F}


def storage(run: Result, alpha_F: float) -> FloatArray:
    """Return V of a flight with the printed poles and a diagonal K."""
    from scipy.linalg import solve_continuous_lyapunov  # slow to import

    A_1 = np.block([[np.zeros((3, 3)), np.eye(3)], [-gains.diagonal()]])
    P, e = solve_continuous_lyapunov(A_1.T, -np.eye(6)), error(run)
    gyros, wheels = unknown_axes()
    momentum = np.sum((run["controller.Theta_F"] - unknown_momentum()) ** 2, axis=1) / (2 * alpha_F)
    axes = [
        np.sum((run[f"controller.{name}"] - true) ** 2, axis=(1, 2)) / (2 * ALPHA_G)
        for name, true in (("Theta_c", gyros), ("Theta_w", wheels))
    ]
    return np.einsum("ti,ij,tj->t", e, P, e) / 2 + momentum + axes[0] + axes[1]  # (23)


def error(run: Result) -> FloatArray:
    """Return e of the paper, MRP and their rates, shape (n, 6)."""
    return np.hstack([run["controller.e"], run["controller.e_dot"]])


def _dissipated(run: Result) -> float:
    from scipy.integrate import simpson

    return float(simpson(np.sum(error(run) ** 2, axis=1) / 2, x=run.time))


def measure_storage(runs: Mapping[str, Result]) -> Measured:
    """Judge whether V falls all the time, and by the integral of e^T Q e / 2."""
    texts, holds = list[str](), dict[str, bool]()
    for name, alpha_F in FLIGHTS.items():
        V, lost, short = storage(runs[name], alpha_F), _dissipated(runs[name]), name.removeprefix("ye2016-")
        texts.append(f"{short}: V falls by {V[0] - V[-1]:.4g}, the integral is {lost:.4g}")
        holds |= {f"never grows, {short}": bool(np.diff(V).max() <= 0)}
        holds |= {f"by the integral, {short}": bool(abs((V[0] - V[-1]) / lost - 1) <= 0.01) if lost else False}
    return Measured("; ".join(texts), holds)
