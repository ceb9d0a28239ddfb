"""An agile flexible spacecraft with two parallel gyros and wheels, and an integral sliding mode.

GAIN is linear-quadratic, of the nominal model; it minimises the integral of 11.2 |e|^2 + 390 |w|^2 + 20 |eta'|^2 +
|u|^2. A row is an axis; the columns belong to e, eta, w or eta'.

Source: Y. Geng, W. Wu, Y. Ma, Neural network compensation of flexible satellite rapid maneuver, J. Harbin Inst. Tech.
44(5), 2012, section 4; SURFACE is its D with one zero less in rows 2 and 3. Chosen, for it is not in the paper: GAIN,
the centres and widths of the network, the boundary layer, the hand-over from gyros to wheels.
"""

import numpy as np

# Printed
J = [[70.0, 3.0, 4.0], [3.0, 60.0, 5.0], [4.0, 5.0, 90.0]]  # kg m2, nominal
F = [  # kg^1/2 m; a row an axis, a column a mode
    [6.45637, -1.25619, 1.11687, 1.23637],
    [1.27814, 0.91756, 2.48901, -2.65810],
    [2.15629, -1.67264, -0.83674, -1.12503],
]
OMEGA = [0.7681, 1.1038, 1.8733, 2.5496]  # rad/s
ZETA = [0.005607, 0.008620, 0.01283, 0.02516]
ANGLE = 60.0  # deg, about y
MISMATCH = 1.2  # true J over nominal J, the paper's 20 %; its sign is not printed
DISTURBANCE, ORBIT_RATE = 1.5e-5, -0.0011  # A0 in N m, w0 in rad/s

# Printed: cluster
ROTOR_MOMENTUM = 15.0  # N m s
PLANE_TORQUE, WHEEL_TORQUE = 3.5, 0.25  # N m
RATE_LIMIT = PLANE_TORQUE / ROTOR_MOMENTUM  # rad/s
DEAD_ZONE = 0.02  # deg/s
GIMBAL_ANGLES = [np.pi / 4, 5 * np.pi / 4]  # rad, at the start
LAMBDA_0, ALPHA, K_0, K_FREQUENCY = 0.01, 10.0, 0.1, 1.0  # K_FREQUENCY in rad/s

# Chosen: hand-over from gyros to wheels, law
WHEEL_INERTIA = 0.02  # kg m2
NEAR, FAR, HAND_OVER_TIME = 0.3, 1.0, 4.0  # deg, deg, s
RHO_0 = 0.15  # N m
GAMMA = 1.0  # 1/s
EPSILON, WIDTH = 1e-3, 1.0
GAIN = {
    "e": [
        [-3.3458366813933473, 0.02179175796482875, -0.07001443228061373],
        [-0.021488955837458423, -3.346538878257615, -0.014688808229649426],
        [0.0701079611726861, 0.014235715471792173, -3.3458754038644667],
    ],
    "eta": [
        [0.9321865783812631, -1.4738567625575003, 2.110057249144641, 0.8890932688120804],
        [0.2871211936868313, 0.5654741038540592, 1.0416144769762377, -0.6870504886587654],
        [-0.005030470151337705, -0.8822980856157848, 0.16112111089198475, 0.1479333529798724],
    ],
    "omega": [
        [-30.682203972554497, -0.41763980424699093, -1.3826508623855296],
        [-0.7917331015474023, -28.368198160598084, -0.6637076845219281],
        [-0.0791537609838126, -0.38708730581126993, -31.604413978612396],
    ],
    "eta_dot": [
        [2.0610316160008706, 0.7406510084336475, 0.1039419222146349, 0.36071786827469593],
        [0.48991491007103943, 1.7451691144595733, 1.343829150885184, -0.8282593332607514],
        [0.270285965645732, -1.1066989288752538, -0.4908783523236472, -0.32935720449558853],
    ],
}

# Corrected: one zero less in rows 2 and 3
SURFACE = {
    "e": [[1.02, 0, 0], [0, 1.02, 0], [0, 0, 1.4]],
    "eta": [[-1, 1.2, 1, 0], [0, 0, 0, 0], [0, 3.0486e-6, 0, 0]],
    "omega": [[4, 0, 0], [0, 4, 0], [0, 0, 6.3]],
    "eta_dot": [[-0.0041, 0, 0, 0], [0, 1.052e-5, 0, 0], [0, 0, 0, 0]],
}

# Printed: network
NODES = 6


def centres(nodes: int = NODES) -> dict[str, np.ndarray]:
    """Return the network's centres in angle, omega and torque, a column a node: uniform from -0.5 to 0.5."""
    rows = np.random.default_rng(0).random((9, nodes)) - 0.5
    return {"angle": rows[:3], "omega": rows[3:6], "torque": rows[6:]}
