"""A flexible spacecraft with two panels, and a law with prescribed performance.

Source: C. Zhang, Y. Sun, G. Ma, C. Li, Prescribed performance adaptive attitude tracking control for flexible
spacecraft, J. Harbin Inst. Tech. 50(4), 2018, 10.11918/j.issn.0367-6234.201612089, section 4. Read so: the rates of
Table 1 are those of the Euler angles 1-2-3, the gains are of angles in degrees; the first rate centre, printed 0.03.
"""

import numpy as np

# Printed, Table 1
J = [[420.8, 3.6, -4.2], [3.6, 410.6, 9.4], [-4.2, 9.4, 690.7]]  # kg m2
F_1 = np.array(  # kg^1/2 m; a row an axis, a column a mode of panel 1; panel 2 has the opposite
    [[2.62, -1.24e-3, -8.20e-4, 6.44e-1], [6.89e-3, 1.24e-1, 4.37e-1, 6.26e-3], [-3.44e-3, -2.73, -5.08e-2, 3.29e-3]]
)
OMEGA = 2 * np.pi * np.array([0.379, 1.042, 1.331, 2.226])  # rad/s, of either panel
ZETA = 0.005
THETA_0 = [0.25, 0.15, -0.20]  # deg
THETA_DOT_0 = [0.02, 0.01, -0.02]  # deg/s

# Printed, Table 2
RHO_0, RHO_INF = 0.3, 0.005  # deg
DECAY = 0.15  # k, 1/s
OVERSHOOT = 0.0  # delta

# Printed: reference and environment
AMPLITUDE = [0.5, 1.0, -0.5]  # deg
FREQUENCY = 0.1  # rad/s
BIAS, SINE, COSINE = [0.0045, 0.0, 0.0045], [0.0, 0.0045, 0.0045], [0.0045, 0.0045, 0.0]  # N m
ORBIT_RATE = 0.0011  # rad/s

# Printed: gains
LAMBDA = [0.125, 0.125, 0.125]
K = [0.5, 0.1, 0.5]
SIGMA, BETA, GAMMA = 0.01, 0.01, 0.01
TAU_W, TAU_MU = 0.5, 0.5
WIDTH = 0.1
CENTRES = [
    [-0.25, -0.17, -0.08, 0, 0.08, 0.17, 0.25],
    [-0.15, -0.10, -0.05, 0, 0.05, 0.10, 0.15],
    [-0.20, -0.13, -0.07, 0, 0.07, 0.13, 0.20],
]

# Corrected: the first entry, printed 0.03
RATE_CENTRES = [
    [-0.03, -0.02, -0.01, 0, 0.01, 0.02, 0.03],
    [-0.15, -0.10, -0.05, 0, 0.05, 0.10, 0.15],
    [-0.03, -0.02, -0.01, 0, 0.01, 0.02, 0.03],
]
