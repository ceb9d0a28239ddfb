"""An outside reference: zhang2018's closed loop in plain NumPy and scipy, from the paper's equations alone.

Nothing is shared with components/ or cosim/: the attitude is three Euler angles, not a quaternion; the flexible hub is
solved as one 11 x 11 mass matrix; the transformed error is differentiated by the chain rule; every number is typed.
Numbers in brackets are the paper's equations (C. Zhang, Y. Sun, G. Ma, C. Li, J. Harbin Inst. Tech. 50(4), 2018). The
controller works in degrees, as its printed bounds and network centres do, or in another unit (its size in degrees).

    python tests/cosim/zhang2018_reference.py        prints the figures of all four runs
"""

from functools import cache
from typing import Literal

import numpy as np
from scipy.integrate import solve_ivp

DEG = np.pi / 180
HUB = np.array([[420.8, 3.6, -4.2], [3.6, 410.6, 9.4], [-4.2, 9.4, 690.7]])
PANEL = np.array(
    [
        [2.62, -1.24e-3, -8.20e-4, 6.44e-1],
        [6.89e-3, 1.24e-1, 4.37e-1, 6.26e-3],
        [-3.44e-3, -2.73, -5.08e-2, 3.29e-3],
    ]
)
BOTH = np.hstack([PANEL, -PANEL])
MASS = np.block([[HUB, BOTH], [BOTH.T, np.eye(8)]])
MASS_INVERSE = np.linalg.inv(MASS)
OMEGA = 2 * np.pi * np.tile([0.379, 1.042, 1.331, 2.226], 2)
DAMPING = 2 * 0.005 * OMEGA
STIFFNESS = OMEGA**2

THETA_0 = np.array([0.25, 0.15, -0.20])  # deg
THETA_DOT_0 = np.array([0.02, 0.01, -0.02])  # deg/s
RHO_0, RHO_INF, DECAY = 0.3, 0.005, 0.15  # deg, deg, 1/s
SLOPE, GAIN, SMOOTHING = 0.125, np.array([0.5, 0.1, 0.5]), 0.01
ADAPTATION, LEAKAGE, WIDTH = 0.5, 0.01, 0.1
SIX_BY_SEVEN = np.array(
    [
        [-0.25, -0.17, -0.08, 0.0, 0.08, 0.17, 0.25],
        [-0.15, -0.10, -0.05, 0.0, 0.05, 0.10, 0.15],
        [-0.20, -0.13, -0.07, 0.0, 0.07, 0.13, 0.20],
        [-0.03, -0.02, -0.01, 0.0, 0.01, 0.02, 0.03],
        [-0.15, -0.10, -0.05, 0.0, 0.05, 0.10, 0.15],
        [-0.03, -0.02, -0.01, 0.0, 0.01, 0.02, 0.03],  # first entry printed without its sign
    ]
)
AMPLITUDE = np.array([0.5, 1.0, -0.5])  # deg
SIDE = np.where(THETA_0 >= 0, 1.0, -1.0)  # theta_d(0) = 0
LOW, HIGH = np.where(SIDE > 0, 0.0, -1.0), np.where(SIDE > 0, 1.0, 0.0)  # delta = 0

Kind = Literal["ppatc", "atc"]


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """a x b; np.cross takes ten times as long for three numbers."""
    return np.array([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


def euler_kinematics(theta: np.ndarray, theta_dot: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """G and its derivative: omega = G(theta) theta', sequence 1-2-3 (inverse of (3))."""
    (_, th, psi), (_, th_dot, psi_dot) = theta, theta_dot
    c, s, C, S = np.cos(psi), np.sin(psi), np.cos(th), np.sin(th)
    G = np.array([[c * C, s, 0.0], [-s * C, c, 0.0], [S, 0.0, 1.0]])
    by_psi = np.array([[-s * C, c, 0.0], [-c * C, -s, 0.0], [0.0, 0.0, 0.0]])
    by_th = np.array([[-c * S, 0.0, 0.0], [s * S, 0.0, 0.0], [C, 0.0, 0.0]])
    return G, by_psi * psi_dot + by_th * th_dot


def desired(t: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """theta_d and its two derivatives, deg."""
    return AMPLITUDE * np.sin(0.1 * t), 0.1 * AMPLITUDE * np.cos(0.1 * t), -0.01 * AMPLITUDE * np.sin(0.1 * t)


def disturbance(t: float) -> np.ndarray:
    """Torque on the body, N m."""
    c, s = np.cos(0.0011 * t), np.sin(0.0011 * t)
    return 0.0045 * np.array([c + 1, c + s, s + 1])


def surface(kind: Kind, t: float, e: np.ndarray, e_dot: np.ndarray, theta_d_ddot: np.ndarray, unit: float):
    """s, and the acceleration (unit/s2) that keeps it if nothing disturbs; epsilon, z, and d s'/d theta''."""
    if kind == "atc":
        s = SLOPE * e + e_dot
        return s, theta_d_ddot - SLOPE * e_dot, np.full(3, np.nan), np.full(3, np.nan), np.ones(3)
    fall, end = (RHO_0 - RHO_INF) / unit * np.exp(-DECAY * t), RHO_INF / unit
    rho, rho_dot, rho_ddot = fall + end, -DECAY * fall, DECAY**2 * fall  # (5)
    z = e / rho  # (8)
    if not np.all((z > LOW) & (z < HIGH)):
        raise ArithmeticError(f"z = {z} left its bounds at t = {t}")
    eps = 0.5 * np.log((z - LOW) / (HIGH - z))  # (9)
    # eps = S(z), z = e / rho: eps' = S' z', eps'' = S'' z'^2 + S' z''.
    S1 = 0.5 * (1 / (z - LOW) + 1 / (HIGH - z))
    S2 = 0.5 * (1 / (HIGH - z) ** 2 - 1 / (z - LOW) ** 2)
    z_dot = (e_dot - z * rho_dot) / rho
    # rho z'' = e'' - 2 z' rho' - z rho'', and s' = SLOPE eps' + eps'' = 0 asks for e''.
    z_ddot = -(SLOPE * S1 * z_dot + S2 * z_dot**2) / S1
    e_ddot = rho * z_ddot + 2 * z_dot * rho_dot + z * rho_ddot
    return SLOPE * eps + S1 * z_dot, theta_d_ddot + e_ddot, eps, z, S1 / rho  # (10), (11)


def split(x: np.ndarray):
    """Angles, body rate (rad), modal coordinates and rates, weights, bound."""
    return x[0:3], x[3:6], x[6:14], x[14:22], x[22:43].reshape(3, 7), x[43]


class Loop:
    """Right-hand side and outputs of one closed loop."""

    def __init__(self, kind: Kind, gain_factor: float, unit: float = 1.0):
        self.kind: Kind = kind
        self.unit = unit  # deg
        self.K, self.tau = gain_factor * GAIN, gain_factor * ADAPTATION

    def control(self, t: float, x: np.ndarray) -> dict[str, np.ndarray]:
        """The torque (12), the adaptation (13), (14), and what the paper calls things."""
        theta, omega, _, _, W, mu = split(x)
        theta_dot = np.linalg.solve(euler_kinematics(theta, np.zeros(3))[0], omega)  # (3)
        G, G_dot = euler_kinematics(theta, theta_dot)
        theta_d, theta_d_dot, theta_d_ddot = desired(t)
        e, e_dot = (theta / DEG - theta_d) / self.unit, (theta_dot / DEG - theta_d_dot) / self.unit
        s, keep, eps, z, r = surface(self.kind, t, e, e_dot, theta_d_ddot / self.unit, self.unit)
        norm = np.sqrt(s @ s)
        h = np.exp(-np.sum((np.concatenate([e, e_dot])[:, None] - SIX_BY_SEVEN) ** 2, axis=0) / (2 * WIDTH**2))
        D_hat = W @ h
        acceleration = keep - D_hat - mu**2 * s / (mu * norm + SMOOTHING) - self.K * s  # (12), unit/s2
        omega_dot = self.unit * DEG * G @ acceleration + G_dot @ theta_dot
        return {
            "u": HUB @ omega_dot + cross(omega, HUB @ omega),  # (1) without modes
            "W_dot": self.tau * (np.outer(s, h) - LEAKAGE * W),  # (13)
            "mu_dot": self.tau * (norm - LEAKAGE * mu),  # (14)
            "theta_dot": theta_dot,
            "e": self.unit * e,
            "s": s,
            "eps": eps,
            "z": z,
            "r": r,
            "D_hat": D_hat,
        }

    def __call__(self, t: float, x: np.ndarray) -> np.ndarray:
        """Derivative of the state."""
        _, omega, eta, eta_dot, _, _ = split(x)
        control = self.control(t, x)
        momentum = HUB @ omega + BOTH @ eta_dot
        torque = control["u"] + disturbance(t) - cross(omega, momentum)
        accelerations = MASS_INVERSE @ np.concatenate([torque, -DAMPING * eta_dot - STIFFNESS * eta])  # (1), (2)
        return np.concatenate(
            [
                control["theta_dot"],
                accelerations[:3],
                eta_dot,
                accelerations[3:],
                control["W_dot"].ravel(),
                [control["mu_dot"]],
            ]
        )


def start() -> np.ndarray:
    """The initial state."""
    x = np.zeros(44)
    theta, theta_dot = THETA_0 * DEG, THETA_DOT_0 * DEG
    x[0:3], x[3:6] = theta, euler_kinematics(theta, theta_dot)[0] @ theta_dot
    return x


def quaternion(theta: np.ndarray) -> np.ndarray:
    """Scalar-first quaternions of rows of angles 1-2-3, multiplied out by half-angle formulas."""
    (c1, c2, c3), (s1, s2, s3) = np.cos(theta.T / 2), np.sin(theta.T / 2)
    return np.stack(
        [
            c1 * c2 * c3 - s1 * s2 * s3,
            s1 * c2 * c3 + c1 * s2 * s3,
            c1 * s2 * c3 - s1 * c2 * s3,
            c1 * c2 * s3 + s1 * s2 * c3,
        ],
        axis=1,
    )


def reference(kind: Kind, gain_factor: float, t_eval: np.ndarray, unit: float = 1.0) -> dict[str, np.ndarray]:
    """The run at the times of t_eval (ascending, from 0 on): angles and rates in rad, e in deg, u in N m."""
    t_eval = np.asarray(t_eval, float)
    loop = Loop(kind, gain_factor, unit)
    solution = solve_ivp(loop, (0.0, t_eval[-1]), start(), "LSODA", t_eval, rtol=1e-9, atol=1e-13, max_step=0.5)
    if not solution.success:
        raise ArithmeticError(solution.message)
    rows = solution.y.T
    outputs = [loop.control(t, x) for t, x in zip(t_eval, rows, strict=True)]
    theta_d = np.array([DEG * desired(t)[0] for t in t_eval])
    data = {name: np.array([row[name] for row in outputs]) for name in ("u", "e", "s", "eps", "z", "r", "D_hat")}
    return data | {
        "time": t_eval,
        "theta": rows[:, 0:3],
        "theta_dot": np.array([row["theta_dot"] for row in outputs]),
        "omega": rows[:, 3:6],
        "eta": rows[:, 6:14],
        "eta_dot": rows[:, 14:22],
        "W": rows[:, 22:43].reshape(-1, 3, 7),
        "mu": rows[:, 43],
        "theta_d": theta_d,
        "tau_dist": np.array([disturbance(t) for t in t_eval]),
        "q_BN": quaternion(rows[:, 0:3]),
        "q_RN": quaternion(theta_d),
    }


@cache
def free_free() -> tuple[np.ndarray, float]:
    """Frequencies (Hz) of the unexcited spacecraft's antisymmetric modes, and the damping ratio of the first."""
    # (2) with w' from (1), linearised: (I - F^T J^-1 F) eta'' + D eta' + S eta = 0.
    inertia = np.eye(8) - BOTH.T @ np.linalg.inv(HUB) @ BOTH
    A = np.block(
        [
            [np.zeros((8, 8)), np.eye(8)],
            [-np.linalg.solve(inertia, np.diag(STIFFNESS)), -np.linalg.solve(inertia, np.diag(DAMPING))],
        ]
    )
    values, vectors = np.linalg.eig(A)
    antisymmetric = np.linalg.norm(vectors[:4] + vectors[4:8], axis=0) < 1e-6 * np.linalg.norm(vectors[:8], axis=0)
    found = values[antisymmetric & (values.imag > 0)]
    found = found[np.argsort(abs(found))]
    return abs(found) / (2 * np.pi), float(-found[0].real / abs(found[0]))


def main() -> None:
    """Print the figures that the equations file lists."""
    np.set_printoptions(precision=7, linewidth=140)
    t = np.linspace(0.0, 200.0, 20001)
    late = t >= 100
    print("free-free", *free_free())
    for kind, factor in (("ppatc", 1.0), ("atc", 1.0), ("ppatc", 0.5), ("atc", 0.5)):
        run = reference(kind, factor, t)
        e = run["e"]
        print(f"\n{kind} x {factor}")
        print("u(0)", run["u"][0], "s(0)", run["s"][0], "eps(0)", run["eps"][0], "mu(200)", run["mu"][-1])
        print("mean e", e[late].mean(axis=0), "max |e|", abs(e[late]).max(axis=0))
        print("last |e| > .005", [t[np.flatnonzero(abs(e[:, i]) > 0.005)[-1]] for i in range(3)])
        print("z", run["z"].min(axis=0), run["z"].max(axis=0))
        i = e[:, 1].argmin()
        print("pitch minimum", e[i, 1], "at", t[i])
        print(
            "eta_11 peak", abs(run["eta"][:, 0]).max(), "eta_1+eta_2", abs(run["eta"][:, :4] + run["eta"][:, 4:]).max()
        )


if __name__ == "__main__":
    main()
