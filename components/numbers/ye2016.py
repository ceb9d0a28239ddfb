"""A rigid spacecraft with four gyros in a pyramid and three wheels on the body axes.

Source: D. Ye, Z. Sun, Y. Liu, An adaptive control algorithm for hybrid actuator with installation deviation, J. Harbin
Inst. Tech. 48(11), 2016, 10.11918/j.issn.0367-6234.2016.11.002, section 4: reference, weights, adaptation. Chosen: the
vehicle, its cluster and the gyros' inertia; diagonal gains, a pair of the paper's eigenvalues an axis: -0.2 +- 0.2i,
-0.3 +- 0.3i and -0.2 sqrt 2, -0.3 sqrt 2.
"""

import numpy as np

from . import neutral

# Chosen: vehicle and cluster
J = [[120.0, 2.0, -1.5], [2.0, 110.0, 1.0], [-1.5, 1.0, 90.0]]  # kg m2
ROTOR_MOMENTUM = 8.0  # N m s, of each gyro
WHEEL_INERTIA = 0.02  # kg m2, of each wheel
ROTOR_INERTIA = 0.016  # kg m2, of a gyro's rotor about its axis: 500 rad/s
GYRO_INERTIA = (0.02, 0.02, 0.01)  # kg m2, of gimbal and rotor about gimbal, rotor and third axis
SKEW = np.radians(54.7356)  # of the pyramid: the faces of a cube

# Printed
RATE_AMPLITUDE = 0.02  # rad/s
RATE_PERIOD = np.array([800.0, 600.0, 400.0])  # s
EIGENVALUES = np.array(
    [-0.2 + 0.2j, -0.2 - 0.2j, -0.2 * 2**0.5, -0.3 + 0.3j, -0.3 - 0.3j, -0.3 * 2**0.5]
)  # 1/s, of A_1
ALPHA_G = 1e3  # s
BETA_G, DELTA_G = 0.05, 0.1

# Chosen: gains
K_1 = np.array([0.08, 0.18, 0.12])  # 1/s2, the diagonal of k_1
K_2 = np.array([0.4, 0.6, 0.5 * np.sqrt(2)])  # 1/s, the diagonal of k_2
ALPHA_F = 1e5  # kg2 m4/s, its 1e7 for a vehicle and a cluster of ten times the inertia and momentum


def pyramid() -> tuple[np.ndarray, np.ndarray]:
    """Return gimbal axes and rotor axes at gimbal angle 0, a column a gyro."""
    return neutral.pyramid(4, SKEW)
