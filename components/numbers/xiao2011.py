"""A flexible spacecraft with limited torque, an adaptive L2-gain law and PID.

Source: B. Xiao, Q. Hu, G. Ma, Adaptive L2-gain controller for flexible spacecraft attitude tracking, Control Theory &
Applications 28(1), 2011, section 4. Chosen, for it takes them from a reference that it does not print: the inertia, the
initial attitudes; the weights are draws from (0, 1), as it says. The floor of g is not in it.
"""

import numpy as np

# Printed
ORBIT_RATE = 1.078e-3  # rad/s
U_MAX = 0.2  # N m
C_1 = C_2 = 100.0
K, P_1, GAMMA = 5.0, 10.0, 0.2
NODES, SIGMA = 5, 1.5
PID_GAINS = [2500.0, 50.0, 4000.0]  # of the angle, its integral, its rate

# Chosen
INERTIA = [1200.0, 1000.0, 1500.0]  # kg m^2
SMALL, LARGE = 4.4, 22.0  # kg m^2 (rad), J_i |theta_i| at the start: cases S and L
G_MIN = U_MAX / 1500.0  # 1/(kg m^2)
MOVE, MOVE_FREQUENCY = 5.0, 0.02  # deg, rad/s: amplitude and frequency of angles wanted that move


def initial_angles(size: float = SMALL) -> np.ndarray:
    """Return the Euler angles 3-2-1 at the start, rad, of a case."""
    return size * np.array([1.0, -1.0, 1.0]) / INERTIA


def initial_weights(nodes: int = NODES) -> np.ndarray:
    """Return the weights at the start, shape (2, 3, nodes): those of f, then those of g."""
    return np.random.default_rng(2011).uniform(size=(2, 3, nodes))
