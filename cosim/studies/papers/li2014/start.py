"""Where the systems of li2014 start.

inertial pointing: the reference has the attitude of the inertial axes                        (1)
LVLH pointing: z to nadir, y opposite to the orbit normal, from position and velocity         (2)
"""

from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from components.numbers.earth import EARTH_RADIUS, J2, MU
from components.numbers.li2014 import ALTITUDE, INCLINATION, LATITUDE, NODE, PHI_REL, PHI_SC, R_REL
from cosim.arrays import FloatArray
from cosim.system import Value


def orbit() -> tuple[FloatArray, FloatArray]:
    """Return position (m) and velocity (m/s) at the start, inertial axes: a circular orbit."""
    plane = Rotation.from_euler("ZXZ", [NODE, INCLINATION, LATITUDE], degrees=True)
    radius = EARTH_RADIUS + ALTITUDE
    return plane.apply([radius, 0, 0]), plane.apply([0, np.sqrt(MU / radius), 0])


def orbit_attitude() -> Rotation:
    """Return the orbit frame at the start, v_N = q v_R q*."""
    r, v = orbit()
    z, y = -r / np.linalg.norm(r), -np.cross(r, v) / np.linalg.norm(np.cross(r, v))
    return Rotation.from_matrix(np.array([np.cross(y, z), y, z]).T)  # (2)


def initial_state(lvlh: bool) -> dict[str, Any]:
    """Return the plant's initial state; angles are of sequence 3-2-1, rates zero or that of the orbit."""
    r, v = orbit()
    reference = orbit_attitude() if lvlh else Rotation.identity()  # (1), (2)
    turned = Rotation.from_euler("ZYX", np.radians(PHI_SC[::-1]))
    rate = turned.inv().apply(_orbit_rate()) if lvlh else np.zeros(3)
    return {
        "plant.r_N": Value(r, "m"),
        "plant.v_N": Value(v, "m/s"),
        "plant.q_SN": (reference * turned).as_quat(scalar_first=True),
        "plant.omega_SN_S": Value(rate, "rad/s"),
        "plant.r_rel": Value(R_REL, "mm"),
        "plant.v_rel": Value([0.0] * 3, "m/s"),
        "plant.q_TS": Rotation.from_euler("ZYX", np.radians(PHI_REL[::-1])).as_quat(scalar_first=True),
        "plant.omega_TS_T": Value([0.0] * 3, "rad/s"),
    }


def _orbit_rate() -> FloatArray:
    """Return the rate of the orbit frame at the start in its own axes, with J2."""
    r, v = orbit()
    h, r1, z = np.cross(r, v), np.linalg.norm(r), r[2]
    shape = np.array([1 - 5 * z**2 / r1**2, 1 - 5 * z**2 / r1**2, 3 - 5 * z**2 / r1**2])
    g = -MU * r / r1**3 - 1.5 * MU * J2 * EARTH_RADIUS**2 / r1**5 * shape * r
    return orbit_attitude().inv().apply(h / r1**2 + r * (g @ h) / (h @ h))
