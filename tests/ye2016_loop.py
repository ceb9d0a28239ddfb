"""The closed loop of ye2016 as components and connections, and once more in numpy from its equations, with MRP."""

import numpy as np
from published import published
from scipy.integrate import solve_ivp

from components.framework import Component
from components.numbers import ye2016 as numbers
from cosim.studies.papers.ye2016 import system

CONNECTIONS = [
    ("plant.q_BN", "controller.q_BN"),
    ("plant.omega_BN_B", "controller.omega_BN_B"),
    ("guidance.q_RN", "controller.q_RN"),
    ("guidance.omega_RN_R", "controller.omega_RN_R"),
    ("guidance.omega_dot_RN_R", "controller.omega_dot_RN_R"),
    ("actuators.gimbal_angle", "controller.gimbal_angle"),
    ("actuators.wheel_speed", "controller.wheel_speed"),
    ("controller.gimbal_rate_command", "actuators.gimbal_rate_command"),
    ("controller.wheel_acceleration_command", "actuators.wheel_acceleration_command"),
    ("actuators.h_B", "plant.h_B"),
]
DEVIATIONS = {
    "rotor_deviation": system.ROTOR_DEVIATION,
    "transverse_deviation": system.TRANSVERSE_DEVIATION,
    "spin_deviation": system.WHEEL_DEVIATION,
}
OFF = {"alpha_F": 0.0, "alpha_G": 0.0}
SLOW = {"k_1": np.diag(0.01 * numbers.K_1), "k_2": np.diag(0.1 * numbers.K_2)}
_C, _W = system.unknown_axes()
KNOWN = OFF | {"Theta_F": system.unknown_momentum(), "Theta_c": _C, "Theta_w": _W}


def loop(**controller) -> dict[str, Component]:
    """The components with the paper's numbers, and with values of the controller."""
    return published("ye2016-adaptive", controller=controller)


def skew(a):
    return np.array([[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0]])


def dcm(s):
    n = s @ s
    return np.eye(3) - 4 * (1 - n) / (1 + n) ** 2 * skew(s) + 8 / (1 + n) ** 2 * skew(s) @ skew(s)


def kinematics(s):
    return 0.25 * ((1 - s @ s) * np.eye(3) + 2 * skew(s) + 2 * np.outer(s, s))


def kinematics_dot(s, v):
    return 0.5 * (skew(v) + np.outer(v, s) + np.outer(s, v) - v @ s * np.eye(3))


def outside(time, alpha_F, alpha_G):
    """sigma, omega, gimbal angles and Theta_F at the times: literal (5)-(26), stacked as the paper does."""
    J, h, i_w = np.array(system.J), np.array(system.ROTOR_MOMENTUM), np.array(system.WHEEL_INERTIA)
    S, T, A = system.ROTOR_AXES, np.cross(system.GIMBAL_AXES.T, system.ROTOR_AXES.T).T, system.WHEEL_AXES
    dS, dT, dA = system.ROTOR_DEVIATION, system.TRANSVERSE_DEVIATION, system.WHEEL_DEVIATION
    K = np.hstack([np.diag(numbers.K_1), np.diag(numbers.K_2)])
    A_1 = np.block([[np.zeros((3, 3)), np.eye(3)], [-K]])
    # A_1' P + P A_1 = -1 as a linear system of 36 equations
    P = np.linalg.solve(np.kron(A_1.T, np.eye(6)) + np.kron(np.eye(6), A_1.T), -np.eye(6).ravel()).reshape(6, 6)
    H_n = S @ h + A @ (i_w * system.WHEEL_SPEED)
    f = 2 * np.pi / system.RATE_PERIOD

    def torques(gamma, s, t, a):
        return np.hstack([(t * np.cos(gamma) - s * np.sin(gamma)) * h, a * i_w])

    def project(theta, phi):
        n, out = theta @ theta, theta @ phi
        return phi - (n - 0.05) / 0.1 * out / n * theta if n >= 0.05 and out > 0 else phi

    def rates(t, x):
        sigma, w, gamma, speed, sigma_d = x[:3], x[3:6], x[6:10], x[10:13], x[13:16]
        Theta_F, Theta_c, Theta_w = x[16:19], x[19:43].reshape(4, 6), x[43:52].reshape(3, 3)
        w_d, w_d_dot = 0.02 * np.sin(f * t), 0.02 * f * np.cos(f * t)
        G, G_d = kinematics(sigma), kinematics(sigma_d)
        v, v_d = G @ w, G_d @ w_d
        a_d = kinematics_dot(sigma_d, v_d) @ w_d + G_d @ w_d_dot
        H_star = np.linalg.inv(G).T @ J @ np.linalg.inv(G)  # (13)
        lever = np.linalg.inv(H_star) @ np.linalg.inv(G).T
        C, e = dcm(sigma), np.concatenate([sigma - sigma_d, v - v_d])
        F = kinematics_dot(sigma, v) @ np.linalg.inv(G) @ v - lever @ skew(w) @ C @ H_n  # (9)
        Y_F = -lever @ skew(w) @ C  # (16)
        X = -lever @ torques(gamma, S + Theta_c[:, 3:].T, T + Theta_c[:, :3].T, A + Theta_w.T)
        u = np.linalg.pinv(X) @ (-K @ e - F - Y_F @ Theta_F + a_d)  # (24)
        BPe = P[3:] @ e
        c_dot = [
            alpha_G * project(Theta_c[i], -h[i] * u[i] * np.concatenate([np.cos(gamma[i]) * m, -np.sin(gamma[i]) * m]))
            for i in range(4)
            for m in [lever.T @ BPe]
        ]
        w_dot = [alpha_G * project(Theta_w[j], -i_w[j] * u[4 + j] * lever.T @ BPe) for j in range(3)]
        stored = ((S + dS) * np.cos(gamma) + (T + dT) * np.sin(gamma)) @ h + (A + dA) @ (i_w * speed)
        torque = -torques(gamma, S + dS, T + dT, A + dA) @ u
        omega_dot = np.linalg.solve(J, torque - np.cross(w, J @ w + stored))  # (5)
        return np.concatenate([v, omega_dot, u, v_d, alpha_F * Y_F.T @ BPe, *c_dot, *w_dot])

    start = np.zeros(52)
    start[10:13] = system.WHEEL_SPEED
    y = solve_ivp(rates, (time[0], time[-1]), start, "DOP853", t_eval=time, rtol=1e-9, atol=1e-13).y
    return y[:3].T, y[3:6].T, y[6:10].T, y[16:19].T
