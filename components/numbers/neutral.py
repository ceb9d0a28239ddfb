"""The one vehicle, cluster and orbit of the start values of all components: no paper's, chosen plain and round.

What is not asked for does not act: the start values elsewhere are the identity attitude, at rest, without disturbance,
noise or limit. Gains are such that each law brings this vehicle to rest from some degrees away.
"""

import numpy as np

from .earth import EARTH_RADIUS, MU

# Vehicle
J = np.diag([300.0, 200.0, 250.0])  # kg m2
COUPLING = 3.0  # kg^1/2 m, of mode i with the axis i mod 3
FREQUENCY = 2 * np.pi * 0.5  # rad/s, of the first mode; mode i has i times it
ZETA = 0.005

# Cluster
ROTOR_MOMENTUM, WHEEL_INERTIA = 10.0, 0.05  # N m s, kg m2
ROTOR_INERTIA, GYRO_INERTIA = 0.02, (0.025, 0.025, 0.015)  # kg m2; of gimbal and rotor about gimbal, rotor, third axis
SKEW = np.radians(54.7356)  # of a pyramid: the faces of a cube
NO_LIMIT = 1e9  # of a force, torque, momentum or rate

# Orbit: a circle at 500 km
ORBIT_RADIUS = EARTH_RADIUS + 500e3  # m
ORBIT_SPEED = np.sqrt(MU / ORBIT_RADIUS)  # m/s
ORBIT_RATE = ORBIT_SPEED / ORBIT_RADIUS  # rad/s

# A test mass in the middle of its cage, held by nothing, and its satellite
M_SC, M_TM, I_TM = 500.0, 2.0, 7e-4  # kg, kg, kg m2: a cube of 46 mm
GAP = 4e-3  # m

# Control
SAMPLE = 0.1  # s
GYRO_SAMPLE, TRACKER_SAMPLE = 0.01, 0.2  # s

# What a filter assumes of its sensors, which have no noise unless they are told
ANGLE_WALK, RATE_WALK = 1e-5, 1e-8  # rad/s^1/2, rad/s^3/2
CROSS_NOISE, ROLL_NOISE = 5e-5, 5e-4  # rad
BANDWIDTH, DAMPING = 0.2, 0.9  # rad/s, 1: of the closed loop of an axis, well below the first mode


def coupling(modes: int) -> np.ndarray:
    """Return delta, a row a mode, kg^1/2 m."""
    return COUPLING * np.eye(3)[np.arange(modes) % 3]


def frequencies(modes: int) -> np.ndarray:
    """Return the modes' frequencies, rad/s."""
    return FREQUENCY * np.arange(1, modes + 1)


def pyramid(gyros: int, skew: float = SKEW) -> tuple[np.ndarray, np.ndarray]:
    """Return gimbal axes and rotor axes at gimbal angle 0 of gyros evenly around z, a column a gyro."""
    f = 2 * np.pi * np.arange(gyros) / max(gyros, 1)
    g = np.array([np.sin(skew) * np.cos(f), np.sin(skew) * np.sin(f), np.full(gyros, np.cos(skew))])
    return g, np.array([-np.sin(f), np.cos(f), np.zeros(gyros)])


def wheel_axes(wheels: int) -> np.ndarray:
    """Return the spin axes, a column a wheel: body axes up to three, else a pyramid 35.26 deg above x-y."""
    if wheels <= 3:
        return np.eye(3)[:, :wheels]
    angle = 2 * np.pi * np.arange(wheels) / wheels
    return np.vstack([np.sqrt(2 / 3) * np.cos(angle), np.sqrt(2 / 3) * np.sin(angle), np.full(wheels, np.sqrt(1 / 3))])
