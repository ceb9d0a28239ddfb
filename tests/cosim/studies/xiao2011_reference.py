"""xiao2011 in Euler angles as one ODE, from equations/xiao2011.md alone: nothing of it is shared with the components.

x = (Theta, omega, eta, eta', h, sum of W_f, sum of W_g J, e1), three each: with all centres at zero the nodes of an
axis are one, so that only the sum of its weights matters.
"""

import numpy as np
from scipy.integrate import solve_ivp

J = np.array([1200.0, 1000.0, 1500.0])
DELTA = np.array([0.3, 1.8, -21.0])  # a mode an axis
LAMBDA = np.array([1.02, 1.02, 1.1316])
XI, W0, U_MAX = 0.03, 1.078e-3, 0.2
K, P1, GAMMA, C, N, WIDTH2 = 5.0, 10.0, 0.2, 100.0, 5, 1.5**2
KAPPA = (GAMMA**2 + 1) / (2 * GAMMA**2)


def kinematics(theta):
    """R of (1a) and omega_c of (2b)."""
    (sp, st, ss), (cp, ct, cs) = np.sin(theta), np.cos(theta)
    R = np.array([[1, 0, -st], [0, cp, sp * ct], [0, -sp, cp * ct]])
    return R, W0 * np.array([ct * ss, cp * cs + sp * st * ss, -sp * cs + cp * st * ss])


def disturbance(t):
    c, s = np.cos(10 * W0 * t), np.sin(10 * W0 * t)
    return 1e-3 * np.array([3 * c + 1, 1.5 * s + 3 * c, 3 * s + 1])


def start(size):
    theta = size / J * np.array([1, -1, 1])
    weights = np.random.default_rng(2011).uniform(size=(6, 5)).sum(axis=1)
    zero = np.zeros(3)
    return np.concatenate([theta, -kinematics(theta)[1], zero, zero, zero, weights, zero])


def still(t):
    """y_d and its derivatives."""
    return np.zeros((3, 1))


def moving(t):
    """y_d = 5 deg sin(.02 t) about each axis, and its derivatives."""
    return np.radians(5.0) * np.array([[np.sin(0.02 * t)], [0.02 * np.cos(0.02 * t)], [-(0.02**2) * np.sin(0.02 * t)]])


def rates(t, x, wanted=still, feedforward=1.0):
    theta, w, eta, eta_dot, h, f, g, e1 = x.reshape(8, 3)
    R, omega_c = kinematics(theta)
    theta_dot = np.linalg.solve(R, w + omega_c)  # (1a)
    X = np.exp(-(theta @ theta + theta_dot @ theta_dot) / WIDTH2)
    y, y_dot, y_ddot = wanted(t) * [[1], [feedforward], [feedforward]]
    z1, z1_dot = theta - y, theta_dot - y_dot  # (6)
    z2 = z1_dot + (K + 0.5) * z1  # (7)
    e2, g_hat = z2 - e1, g * X / J
    u = (-f * X + y_ddot - (K + 0.5) * z1_dot - z1 - P1 * z2 - KAPPA * e2) / g_hat  # (18a), (29)
    out = np.clip(u, -U_MAX, U_MAX)
    spring = 2 * XI * LAMBDA * eta_dot + LAMBDA**2 * eta
    torque = disturbance(t) + out - np.cross(w, J * w + h + DELTA * eta_dot) + DELTA * spring
    w_dot = torque / (J - DELTA**2)
    return np.concatenate(
        [
            theta_dot,
            w_dot,
            eta_dot,
            -spring - DELTA * w_dot,
            -out,
            N * C * e2 * X,
            N * C * e2 * X * out / J,
            -P1 * e1 + g_hat * (out - u),
        ]
    )


def fly(t, size=4.4, wanted=still, feedforward=1.0):
    """States at the times t, a row a time."""
    options = dict(t_eval=t, rtol=1e-9, atol=1e-12, max_step=0.02, args=(wanted, feedforward))
    return solve_ivp(rates, (0, t[-1]), start(size), "LSODA", **options).y.T
