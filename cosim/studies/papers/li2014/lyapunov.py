"""Lyapunov's function of li2014 along a flight on the design model, where the true weights are known.

V = 1/2 lambda x1^2 + 1/2 z^2 + 1/2 Gamma |W* - W|^2,  z = x2 + k1 x1                             (19)
V' = -lambda k1 x1^2 - k2 z^2                                                                     (20)

of each of the three loops, summed over its axes; lambda = 1/s2, printed as 1.
"""

from dataclasses import dataclass

import numpy as np

from components.numbers.li2014 import K_1, K_2, STIFFNESS
from cosim.arrays import FloatArray
from cosim.results.result import Result
from cosim.studies.papers.li2014.design import true_weights

LOOPS = {  # of the design model: x1, x2
    "relative position": ("r_rel", "v_rel"),
    "attitude": ("phi_SN", "omega_SN_S"),
    "relative attitude": ("phi_TS", "omega_TS_T"),
}


@dataclass(frozen=True)
class Lyapunov:
    """V and V' of (20) of one loop, and |W* - W| over |W*|, a value a row."""

    V: FloatArray
    V_dot: FloatArray
    distance: FloatArray


def lyapunov(run: Result, Gamma: float) -> dict[str, Lyapunov]:
    """Return Lyapunov's function of every loop by its name; Gamma of the flight, s2."""
    found: dict[str, Lyapunov] = {}
    for i, ((loop, names), true) in enumerate(zip(LOOPS.items(), true_weights(), strict=True)):
        x1, x2 = (run[f"plant.{name}"] for name in names)
        z = x2 + K_1 * x1
        errors = true - run[f"controller.W_{i + 1}"].reshape(-1, *true.shape)
        squares = np.sum(errors**2, axis=(1, 2))
        V = (STIFFNESS * np.sum(x1**2, axis=1) + np.sum(z**2, axis=1) + Gamma * squares) / 2  # (19)
        V_dot = -np.sum(STIFFNESS * K_1 * x1**2 + K_2 * z**2, axis=1)  # (20)
        found[loop] = Lyapunov(V, V_dot, np.sqrt(squares / np.sum(true**2)))
    return found
