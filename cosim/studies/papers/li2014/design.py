"""The design model of li2014, on which the paper most likely flew: its start, and the unknown that it contains.

    f_i = W_i^T h_i(x_i1, x_i2), of the paper's form, with equal weights in all nodes             (12)
    at zero error, by remark 2.1: f_1 = -F_D/m_sc, f_2 = T_D/I_sc, f_3 = -T_D/I_sc                (1)
    F_D: the mean drag, against the velocity at the start; T_D = r_cp x F_D                       (2)

Chosen: the weights and with them f, of which the paper says that it is smooth and unknown. It is no function of time,
as (7) to (9) have it; the full plant has drag and gravity along an orbit.
"""

from typing import Any

import numpy as np

from components.numbers.li2014 import (
    I_SC,
    M_SC,
    MEAN_DRAG,
    PHI_REL,
    PHI_SC,
    PRESSURE_CENTRE,
    R_REL,
    WIDTH,
)
from cosim.arrays import FloatArray
from cosim.studies.papers.li2014.start import orbit
from cosim.system import Value

CENTRES = np.array(np.meshgrid(*[[-1, -0.5, 0, 0.5, 1]] * 2, indexing="ij")).reshape(2, 25)


def disturbances() -> FloatArray:
    """Return f_1 (m/s2), f_2 and f_3 (rad/s2) at zero error, a row each, S axes."""
    _, v = orbit()
    force = -MEAN_DRAG * v / np.linalg.norm(v)
    torque = np.cross(PRESSURE_CENTRE, force)  # (2)
    return np.array([-force / M_SC, torque / I_SC, -torque / I_SC])  # (1)


def true_weights() -> list[FloatArray]:
    """Return W_1, W_2, W_3 of f, a row an axis."""
    nodes = np.exp(-np.sum(CENTRES**2, axis=0) / (2 * WIDTH**2))
    return [np.outer(f, np.full(len(nodes), 1 / nodes.sum())) for f in disturbances()]  # (12)


def start() -> dict[str, Any]:
    """Return the initial state, at rest, and the weights of f."""
    units = ("m/s2", "rad/s2", "rad/s2")
    weights = {
        f"plant.W_{i + 1}": Value(W, unit) for i, (W, unit) in enumerate(zip(true_weights(), units, strict=True))
    }
    return weights | {
        "plant.r_rel": Value(R_REL, "mm"),
        "plant.v_rel": Value([0.0] * 3, "m/s"),
        "plant.phi_SN": Value(PHI_SC, "deg"),
        "plant.omega_SN_S": Value([0.0] * 3, "rad/s"),
        "plant.phi_TS": Value(PHI_REL, "deg"),
        "plant.omega_TS_T": Value([0.0] * 3, "rad/s"),
    }
