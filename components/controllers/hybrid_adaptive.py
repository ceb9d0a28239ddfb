"""Adaptive tracking with a cluster of gyros and wheels whose axes and total momentum are not known exactly; MRP.

    sigma' = G w,  e = [sigma - sigma_d; sigma' - sigma_d']                                       (6)
    sigma_d' = G(sigma_d) w_d,  sigma_d'' = G'(sigma_d, sigma_d') w_d + G(sigma_d) w_d'           (7)
    sigma'' = F + G_u u + Y_F Theta_F                                                             (8)
    F = G' w - G J^-1 (w x C(sigma) H_0),  Y_F Theta_F = -G J^-1 (w x C(sigma) Theta_F)           (9)
    G_u = -G J^-1 Q_u,  Q_u = [h_i (t_i0 cos gamma_i - s_i0 sin gamma_i), I_j a_j]                (10)
    s_i0, t_i0, a_j: nominal axes plus the rows of Theta_c = [dt_i0, ds_i0] and Theta_w = da_j    (18)
    u = X^+ v,  X = G_u with the estimates,  v = sigma_d'' - k_1 e_1 - k_2 e_2 - F - Y_F Theta_F  (24)
    Theta_F' = alpha_F Y_F^T B^T P e,  B^T P e = P_12^T e_1 + P_22 e_2                            (25)
    Theta_ci', Theta_wj' = smooth projection of alpha_G Y_Gi^T B^T P e u_i within b + d           (26)
    Y_Gi = -h_i G J^-1 [cos gamma_i, -sin gamma_i] of a gyro, -I_j G J^-1 of a wheel              (26a)
X^+ has weights, (1) of mathematics/allocation.py; weights of 1 are the paper's. K = [k_1, k_2], 3 x 6, with
A_1 = A_0 - B_0 K = [0, 1; -k_1, -k_2] Hurwitz and Q = [q_1, q_12; q_12^T, q_2] positive definite:
    A_1^T P + P A_1 = -Q: mathematics/lyapunov.py                                                 (23)
    V = 1/2 e^T P e + |Theta_F - true|^2/(2 alpha_F) + |Theta_c, Theta_w - true|^2/(2 alpha_G),
    V' = -1/2 e^T Q e, or less where the projection acts                                          (27)
shadow = 1: q_RN is taken with a scalar part >= 0, so that |sigma_d| <= 1; 0: as it is signed, as in the paper. q_BN is
taken with the sign that is nearer to it.

Symbols: sigma MRP of the body, w omega_BN_B, sigma_d, w_d of the reference; C(sigma) = dcm_BN; gamma gimbal_angle, h
rotor_momentum, I wheel_inertia; H_0 the total momentum in N at the start, as the nominal axes give it. alpha_F =
alpha_G = 0: no adaptation; Theta at the true values: perfect knowledge. tau_wanted_B = J G^-1 v.
Source: D. Ye, Z. Sun, Y. Liu, An adaptive control algorithm for hybrid actuator with installation deviation, J. Harbin
Inst. Tech. 48(11), 2016. Changed: the inverse in X^+, G^-T in (18) and |Theta|^2 in the projection, which the print has
lost. Its six eigenvalues of A_1 leave K open. Q_u is its Q of (11).
Invariants: (27).
Limits: J is known and constant, no external torque. sigma is singular at a full turn of 360 deg, which `full_turn`
reports; near it the gain of (25) grows with (1 + sigma^2)^2. A lag between u and the torque lets (25) oscillate.
"""

from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from .. import vehicle
from ..framework import (
    AttitudeController,
    CalculatedParameter,
    Component,
    Condition,
    Input,
    Output,
    Parameter,
    State,
    flag_conditions,
    not_negative,
    positive,
)
from ..mathematics import allocation, cmg, lyapunov, mrp, projection, quaternion
from ..mathematics.vectors import asymmetry, length
from ..numbers import neutral


@dataclass(frozen=True)
class Law:
    """What the equations of the law share."""

    e: Any
    e_dot: Any
    G_J: Any  # G J^-1
    Y_F: Any
    rates: Any  # u of the gyros
    accelerations: Any  # u of the wheels
    tau: Any
    cosine: Any  # scalar parts of the quaternions: cosines of half the turns from N
    cosine_d: Any


def _unit(q: Any) -> Any:
    """Return q / |q|; for q = 0 it is 0 and not NaN, so that the check at the start refuses it."""
    return q / ca.fmax(length(q), 1e-9)


def _all_positive(values: list[Any]) -> Any:
    """Return whether all are above zero; one that is no number or has no bound is not."""
    every: Any = 1
    for value in values:
        every = ca.logic_and(every, ca.logic_and(value > 0, 1 / value > 0))
    return every


class HybridAdaptive(Component):
    role = "controller"
    ports = vehicle.MomentumStorage
    gimbals: int = 4  # structural: control moment gyros
    wheels: int = 3  # structural: reaction wheels

    J = vehicle.J
    k_1 = Parameter(
        unit="1/s2", shape=(3, 3), start=np.eye(3) * neutral.BANDWIDTH**2, doc="gain of e, left half of K in (24)"
    )
    k_2 = Parameter(
        unit="1/s",
        shape=(3, 3),
        start=np.eye(3) * (2 * neutral.DAMPING * neutral.BANDWIDTH),
        doc="gain of e', right half of K in (24)",
    )
    q_1 = Parameter(unit="1/s2", shape=(3, 3), start=np.eye(3), doc="weight of e with e, Q in (23)")
    q_12 = Parameter(unit="1/s", shape=(3, 3), doc="weight of e with e', Q in (23)")
    q_2 = Parameter(unit="1", shape=(3, 3), start=np.eye(3), doc="weight of e' with e', Q in (23)")
    alpha_F = Parameter(unit="kg2.m4/s", start=1e5, doc="adaptation gain of the momentum, 0: none")
    alpha_G = Parameter(unit="s", start=100.0, doc="adaptation gain of the axes, 0: none")
    b = Parameter(unit="1", start=0.05, doc="squared length of an axis' deviation where the projection begins")
    d = Parameter(unit="1", start=0.1, doc="width of the projection; squared lengths stay within b + d")
    gimbal_weight = Parameter(unit="1", shape=("gimbals",), start=1.0, doc="weight of each gyro in the allocation")
    wheel_weight = Parameter(unit="1/s2", shape=("wheels",), start=1.0, doc="weight of each wheel in the allocation")
    shadow = Parameter(unit="1", doc="1: the reference is taken the short way round from N, 0: as it is signed")
    P_11 = CalculatedParameter(unit="1/s", shape=(3, 3), doc="solution of the Lyapunov equation, e with e")
    P_12 = CalculatedParameter(unit="1", shape=(3, 3), doc="solution of the Lyapunov equation, e with e'")
    P_22 = CalculatedParameter(unit="s", shape=(3, 3), doc="solution of the Lyapunov equation, e' with e'")

    q_BN = AttitudeController.q_BN
    omega_BN_B = AttitudeController.omega_BN_B
    q_RN = AttitudeController.q_RN
    omega_RN_R = AttitudeController.omega_RN_R
    omega_dot_RN_R = AttitudeController.omega_dot_RN_R
    gimbal_angle = Input(unit="rad", shape=("gimbals",), display_unit="deg", doc="gamma, measured gimbal angles")
    wheel_speed = Input(unit="rad/s", shape=("wheels",), doc="wheel speeds at the start, for H_0")

    H_0 = State(unit="N.m.s", shape=(3,), calculated=True, doc="total momentum at the start with nominal axes, in N")
    Theta_F = State(
        unit="N.m.s", shape=(3,), output=True, doc="estimate of what the total momentum is beyond H_0, in N"
    )
    Theta_c = State(
        unit="1",
        shape=("gimbals", 6),
        output=True,
        nominal=1e-2,
        doc="estimated deviations of gyros: transverse, rotor",
    )
    Theta_w = State(
        unit="1", shape=("wheels", 3), output=True, nominal=1e-2, doc="estimated deviations of the wheels' axes"
    )

    gimbal_rate_command = Output(
        unit="rad/s", shape=("gimbals",), display_unit="deg/s", nominal=1e-2, doc="gimbal rates wanted"
    )
    wheel_acceleration_command = Output(unit="rad/s2", shape=("wheels",), doc="wheel accelerations wanted")
    attitude_error = AttitudeController.attitude_error
    tau_wanted_B = Output(unit="N.m", shape=(3,), doc="torque on the hub that the commands are to give")
    e = Output(unit="1", shape=(3,), nominal=1e-3, doc="e_1, error of sigma")
    e_dot = Output(unit="1/s", shape=(3,), nominal=1e-4, doc="e_2, error of sigma'")
    H_hat_N = Output(unit="N.m.s", shape=(3,), doc="estimated total momentum, H_0 + Theta_F")
    full_turn = Output(unit="1", doc="1 where body or reference is within 5 deg of a full turn from N, else 0")

    def calculate(self, p: Any) -> dict[str, Any]:
        P = lyapunov.solve(p.k_1, p.k_2, p.q_1, p.q_12, p.q_2)  # (23)
        return dict(zip(("P_11", "P_12", "P_22"), P, strict=True))

    def initial(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        s, _ = cmg.rotated(p.rotor_axes_B, self._transverse(p), u.gimbal_angle)
        h = p.J @ u.omega_BN_B + s @ p.rotor_momentum + p.spin_axes_B @ (p.wheel_inertia * u.wheel_speed)
        return {"H_0": quaternion.rotate(_unit(u.q_BN), h)}

    def derivatives(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        law = self._law(x, u, p)
        error = p.P_12.T @ law.e + p.P_22 @ law.e_dot  # (25)
        turn = law.G_J.T @ error
        c, s = ca.cos(u.gimbal_angle), ca.sin(u.gimbal_angle)
        rows_c, rows_w = [], []
        for i in range(self.gimbals):
            Phi = -p.rotor_momentum[i] * law.rates[i] * ca.vertcat(c[i] * turn, -s[i] * turn)  # (26), (26a)
            rows_c.append(p.alpha_G * projection.smooth(x.Theta_c[i, :].T, Phi, p.b, p.d).T)
        for j in range(self.wheels):
            Phi = -p.wheel_inertia[j] * law.accelerations[j] * turn  # (26), (26a)
            rows_w.append(p.alpha_G * projection.smooth(x.Theta_w[j, :].T, Phi, p.b, p.d).T)
        return {
            "H_0": ca.SX.zeros(3),
            "Theta_F": p.alpha_F * law.Y_F.T @ error,  # (25)
            "Theta_c": ca.vertcat(*rows_c, ca.SX(0, 6)),
            "Theta_w": ca.vertcat(*rows_w, ca.SX(0, 3)),
        }

    def outputs(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        law = self._law(x, u, p)
        return {
            "tau_wanted_B": law.tau,
            "attitude_error": quaternion.rotation_vector(quaternion.error(u.q_BN, u.q_RN)),
            "gimbal_rate_command": law.rates,
            "wheel_acceleration_command": law.accelerations,
            "e": law.e,
            "e_dot": law.e_dot,
            "H_hat_N": x.H_0 + x.Theta_F,
            "full_turn": ca.fmin(law.cosine, law.cosine_d) < -np.cos(np.radians(2.5)),
        }

    def check(self, t: Any, x: Any, u: Any, p: Any) -> list[Condition]:
        conditions = [*vehicle.inertia_conditions(p.J), *vehicle.storage_conditions(self, p)]
        conditions += vehicle.attitude_conditions(u)
        return [
            *conditions,
            *self._gain_conditions(p),
            *positive(self, p, "d", "gimbal_weight", "wheel_weight"),
            *not_negative(self, p, "alpha_F", "alpha_G", "b"),
            *flag_conditions(self, p, "shadow"),
        ]

    def _gain_conditions(self, p: Any) -> list[Condition]:
        """Return the conditions that Q is positive definite, and then that A_1 is Hurwitz, which P shows."""
        conditions: list[Condition] = []
        for name, value, unit in (("q_1", p.q_1, " 1/s2"), ("q_2", p.q_2, "")):
            text = f"{name} is not symmetric: elements that mirror each other differ by {{}}{unit}."
            conditions.append(Condition(asymmetry(value) <= 1e-9 * ca.mmax(ca.fabs(value)), text, (asymmetry(value),)))
        weights, solution = (
            lyapunov.pivots(ca.blockcat([[a, b], [b.T, c]]))
            for a, b, c in ((p.q_1, p.q_12, p.q_2), (p.P_11, p.P_12, p.P_22))
        )
        definite, hurwitz = (_all_positive(pivots) for pivots in (weights, solution))
        least = ca.mmin(ca.vertcat(*weights))
        text = (
            "Q = [q_1, q_12; q_12^T, q_2] is not positive definite (smallest pivot {}): V' of (27) could be positive."
        )
        conditions.append(Condition(definite, text, (least,)))
        text = (
            "K = [k_1, k_2]: A_1 = A_0 - B_0 K is not Hurwitz, for P of (23) is not positive definite (det k_1 {} "
            "1/s6, trace k_2 {} 1/s). Place its eigenvalues left of the imaginary axis."
        )
        stable = ca.logic_or(ca.logic_not(definite), hurwitz)
        return [*conditions, Condition(stable, text, (ca.det(p.k_1), ca.trace(p.k_2)))]

    def _transverse(self, p: Any) -> Any:
        return cmg.transverse(p.gimbal_axes_B, p.rotor_axes_B)

    def _law(self, x: Any, u: Any, p: Any) -> Law:
        q_d, w, w_d = _unit(u.q_RN), u.omega_BN_B, u.omega_RN_R
        q_d = q_d * ca.if_else(ca.logic_and(p.shadow > 0.5, q_d[0] < 0), -1, 1)
        q = _unit(u.q_BN)
        q = q * ca.if_else(ca.dot(q, q_d) < 0, -1, 1)
        sigma, sigma_d = mrp.from_quaternion(q), mrp.from_quaternion(q_d)
        G, G_d = mrp.G(sigma), mrp.G(sigma_d)
        sigma_dot, sigma_d_dot = G @ w, G_d @ w_d  # (6), (7)
        sigma_d_ddot = mrp.G_dot(sigma_d, sigma_d_dot) @ w_d + G_d @ u.omega_dot_RN_R  # (7)
        e, e_dot = sigma - sigma_d, sigma_dot - sigma_d_dot  # (6)
        G_J, C = G @ ca.inv(p.J), quaternion.dcm(q)
        Y_F = -G_J @ ca.skew(w) @ C  # (9)
        F = mrp.G_dot(sigma, sigma_dot) @ w + Y_F @ x.H_0  # (9)
        v = sigma_d_ddot - p.k_1 @ e - p.k_2 @ e_dot - F - Y_F @ x.Theta_F  # (24)
        s_0, t_0 = p.rotor_axes_B + x.Theta_c[:, 3:].T, self._transverse(p) + x.Theta_c[:, :3].T  # (18)
        _, axes = cmg.rotated(s_0, t_0, u.gimbal_angle)
        X = -G_J @ cmg.momentum_rates(axes, p.rotor_momentum, p.spin_axes_B + x.Theta_w.T, p.wheel_inertia)  # (10)
        rates = allocation.weighted_inverse(X, ca.vertcat(p.gimbal_weight, p.wheel_weight)) @ v  # (24)
        tau = p.J @ mrp.G_inverse(sigma) @ v
        return Law(e, e_dot, G_J, Y_F, rates[: self.gimbals], rates[self.gimbals :], tau, q[0], q_d[0])
