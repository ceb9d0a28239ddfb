"""An outside reference: geng2012's closed loop in plain NumPy, from shared equations alone, as one ODE.

Nothing is shared with components/ or cosim/: the attitude is a rotation matrix, hub and modes are one 7 x 7 mass
matrix, the linear model is built from it, the controller is evaluated in every RK4 stage; every number is typed but
the linear gain, which is the solution of its Riccati equation.

    python tests/cosim/geng2012_reference.py        prints the figures of the runs
"""

from functools import cache
from typing import NamedTuple

import numpy as np
from scipy.linalg import block_diag, solve_continuous_are

NOMINAL = np.array([[70.0, 3, 4], [3, 60, 5], [4, 5, 90]])
F = np.array(
    [
        [6.45637, -1.25619, 1.11687, 1.23637],
        [1.27814, 0.91756, 2.48901, -2.65810],
        [2.15629, -1.67264, -0.83674, -1.12503],
    ]
)
LAM = np.array([0.7681, 1.1038, 1.8733, 2.5496])
C, K = 2 * np.array([0.005607, 0.008620, 0.01283, 0.02516]) * LAM, LAM**2
D = np.zeros((3, 14))
D[0, [0, 3, 4, 5, 7, 10]] = 1.02, -1, 1.2, 1, 4, -0.0041
D[1, [1, 8, 11]] = 1.02, 4, 1.052e-5
D[2, [2, 4, 9]] = 1.4, 3.0486e-6, 6.3
CENTRES = np.random.default_rng(0).random((9, 6)) - 0.5
TARGET = np.array([[0.5, 0, np.sqrt(0.75)], [0, 1, 0], [-np.sqrt(0.75), 0, 0.5]])  # v_N from v_R, 60 deg about y
H_0 = 15.0
DEG = np.pi / 180


class Law(NamedTuple):
    """Which law and cluster: as the experiments have them."""

    network: bool = False
    rho_0: float = 0.0
    gamma: float = 1.0
    printed: bool = False
    trim: bool = True  # wheels about x and y give what the gyros do not
    end_phase: bool = False  # and they do so within 1 deg only
    dead_zone: float = 0.02  # deg/s


def linear_model():
    """A, B of x = [e, eta, w, eta'] at nominal inertia."""
    mass = np.block([[NOMINAL, F], [F.T, np.eye(4)]])
    A, B = np.zeros((14, 14)), np.zeros((14, 3))
    A[:3, 7:10], A[3:7, 10:] = np.eye(3), np.eye(4)
    forces = np.zeros((7, 14))
    forces[3:, 3:7], forces[3:, 10:] = -np.diag(K), -np.diag(C)
    A[7:], B[7:] = np.linalg.solve(mass, forces), np.linalg.solve(mass, np.eye(7, 3))
    return A, B


A, B = linear_model()
WEIGHTS = block_diag(11.2 * np.eye(3), np.zeros((4, 4)), 390 * np.eye(3), 20 * np.eye(4))
G = -B.T @ solve_continuous_are(A, B, WEIGHTS, np.eye(3))
DB = D @ B
DRIFT = D @ (A + B @ G)
PRINTED = -np.linalg.solve(DB, D @ A)
TRUE_MASS = np.linalg.inv(np.block([[1.2 * NOMINAL, F], [F.T, np.eye(4)]]))


def cross(a, b):
    """a x b; np.cross takes ten times as long for three numbers."""
    return np.array([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


def rotation_vector(R):
    """Axis times angle of a rotation matrix; away from half a turn."""
    v = np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]]) / 2
    sine = np.sqrt(v @ v)
    return v if sine < 1e-12 else v * (np.arctan2(sine, (np.trace(R) - 1) / 2) / sine)


def control(t, x, law):
    """u and what it is made of."""
    R, w, eta_hat, psi, integral, W = x[:9].reshape(3, 3), x[9:12], x[20:24], x[24:28], x[28:31], x[31:49].reshape(3, 6)
    e = rotation_vector(TARGET.T @ R)
    state = np.concatenate([e, eta_hat, w, psi - F.T @ w])
    linear, sigma = G @ state, D @ state - integral
    s = DB.T @ sigma
    angles = np.array([np.arctan2(R[2, 1], R[2, 2]), -np.arcsin(np.clip(R[2, 0], -1, 1)), np.arctan2(R[1, 0], R[0, 0])])
    nodes = np.exp(-np.sum((np.concatenate([angles, w, linear])[:, None] - CENTRES) ** 2, axis=0))
    rho = W @ nodes if law.network else np.full(3, law.rho_0)
    size = np.abs(s) if law.network else np.sqrt(s @ s)
    u = (PRINTED @ state if law.printed else linear) - rho * s / (size + 1e-3)
    return u, e, state, sigma, rho, nodes


def allocate(t, x, u, e, law):
    """Gimbal rates and wheel torques, and the torque on the hub."""
    w, d = x[9:12], x[49:51]
    shape = np.array([-np.sin(d), np.cos(d)])
    away = np.clip((np.linalg.norm(e) + 4 * np.linalg.norm(w) - 0.3 * DEG) / (0.7 * DEG), 0, 1)
    c = 3 * away**2 - 2 * away**3 if law.trim else 1.0
    wheels_help = law.trim and (away < 1 or not law.end_phase)
    plane = u[:2] * min(1, 3.5 / max(np.linalg.norm(u[:2]), 1e-30))
    lam, k = 0.01 * np.exp(-10 * np.linalg.det(shape @ shape.T)), 0.1 * np.cos(t)
    V, weights = lam * np.array([[1, k], [k, 1]]), np.array([[1, lam], [lam, 1]])
    rate = weights @ shape.T @ np.linalg.solve(shape @ weights @ shape.T + V, -c * plane / H_0)
    rate = rate * min(1, 3.5 / 15 / max(np.abs(rate).max(), 1e-30))
    rate[np.abs(rate) < law.dead_zone * DEG] = 0
    gyros = H_0 * shape @ rate
    wheels = np.zeros(3)
    wheels[2] = -np.clip(u[2], -0.25, 0.25)
    if wheels_help:
        wheels[:2] = -np.clip(plane + gyros, -0.25, 0.25)
    return rate, wheels, -np.append(gyros, 0) - wheels


def rates(t, x, law):
    """The derivative of [R, w, eta, eta', eta_hat, psi, I, W, gimbal angles, wheel momenta]."""
    R, w, eta, eta_dot, eta_hat, psi = x[:9].reshape(3, 3), x[9:12], x[12:16], x[16:20], x[20:24], x[24:28]
    u, e, state, sigma, _, nodes = control(t, x, law)
    rate, wheels, torque = allocate(t, x, u, e, law)
    phase = -0.0011 * t
    disturbance = 1.5e-5 * np.array(
        [3 * np.cos(phase) + 1, 1.5 * np.sin(phase) + 3 * np.cos(phase), 3 * np.sin(phase) + 1]
    )
    d = x[49:51]
    stored = x[51:54] + H_0 * np.array([np.cos(d).sum(), np.sin(d).sum(), 0])
    momentum = 1.2 * NOMINAL @ w + F @ eta_dot + stored
    hub = torque + disturbance - cross(w, momentum)
    motion = TRUE_MASS @ np.concatenate([hub, -C * eta_dot - K * eta])
    hat_dot = psi - F.T @ w
    spin = np.array([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]])
    learning = law.gamma * np.abs(sigma)[:, None] * nodes if law.network else np.zeros((3, 6))
    return np.concatenate(
        [
            (R @ spin).ravel(),
            motion[:3],
            eta_dot,
            motion[3:],
            hat_dot,
            -K * eta_hat - C * hat_dot,
            DRIFT @ state,
            learning.ravel(),
            rate,
            wheels,
        ]
    )


def start():
    """At rest, gyros against each other, I = D x(0)."""
    x = np.zeros(54)
    x[:9] = np.eye(3).ravel()
    x[28:31] = D[:, :3] @ rotation_vector(TARGET.T)
    x[49:51] = np.pi / 4, 5 * np.pi / 4
    return x


@cache
def fly(law: Law, stop: float, h: float = 0.01):
    """t, e (deg), w (deg/s), eta, rho every h; RK4."""
    x, rows = start(), []
    count = round(stop / h)
    for n in range(count + 1):
        t = n * h
        _, e, _, _, rho, _ = control(t, x, law)
        rows.append(np.concatenate([e / DEG, x[9:12] / DEG, x[12:16], rho]))
        if n < count:
            a = rates(t, x, law)
            b = rates(t + h / 2, x + h / 2 * a, law)
            c = rates(t + h / 2, x + h / 2 * b, law)
            x = x + h / 6 * (a + 2 * b + 2 * c + rates(t + h, x + h * c, law))
    found = np.array(rows)
    return h * np.arange(count + 1), found[:, :3], found[:, 3:6], found[:, 6:10], found[:, 10:]


def settled(t, e, bound=0.1):
    """The last time at which a component exceeds the bound."""
    outside = np.flatnonzero(np.abs(e).max(axis=1) > bound)
    return t[outside[-1]]


if __name__ == "__main__":
    for name, law in {
        "network": Law(network=True),
        "constant": Law(rho_0=0.15),
        "linear": Law(),
        "linear, end phase": Law(end_phase=True),
    }.items():
        t, e, w, _, rho = fly(law, 60.0)
        print(
            f"{name}: settled {settled(t, e):.2f} s, peak rate {w[:, 1].max():.3f} deg/s at {t[w[:, 1].argmax()]:.2f} s"
        )
        print("   rho(30 s)", rho[3000])
