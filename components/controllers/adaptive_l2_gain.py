"""Adaptive L2-gain attitude tracking with input constraint, axis by axis in Euler angles 3-2-1.

theta angles from the reference to the body, w_e = omega_BN_B - dcm_BR omega_RN_R, T the unit of time of the gains; y_d
the angles wanted, here zero (adaptive_l2_gain_tracking.py has others):
    theta' = R^-1 w_e                                                                             (1a)
    z1 = theta - y_d                                                                              (6)
    z2 = theta' - y_d' - alpha                                                                    (7)
    alpha = -(k + 1/2) z1 / T,  alpha' = -(k + 1/2) (theta' - y_d') / T                           (14)
    X_j = exp(-(|theta - c_j|^2 + T^2 |theta' - c'_j|^2) / sigma^2)                               (38)
    f_hat = W_f X,  g_hat = max(W_g X / J_n, g_min)                                               (1c)
    u_adap = -f_hat + y_d'' + alpha' - z1 / T^2 - p1 z2 / T                                       (18a)
    u_rob = -kappa e2 / T,  kappa = (gamma^2 + 1) / (2 gamma^2)                                   (29)
    u = (u_adap + u_rob) / g_hat                                                                  (27)
    tau_command = u_out = min(max(u, -torque_limit), torque_limit)                                (23)
    W_f' = c1 e2 X^T / T^2                                                                        (28a)
    W_g' = c2 T^2 e2 u_out X^T / J_n; 0 where W_g X / J_n <= g_min and it would fall further      (28b)
    e1' = -p1 e1 / T + g_hat (u_out - u)                                                          (25)
    e2 = z2 - e1                                                                                  (26)
J_n: the diagonal of J (normalised), or 1 kg m^2, as the print has it. torque_limit = 1e9: Theorem 1, without constraint
e1 = 0. With true f, g: V3 = sum z1^2/T^2 + e2^2 + |W_f~|^2 T^2/c1 + |W_g~|^2/(c2 T^2), halved, has on each axis
    V3' = -(k + 1/2) z1^2 / T^3 + e1 z1 / T^2 - (p1 + kappa) e2^2 / T + e2 (what f, g leave over) (32)

Frames: B body, R reference. Symbols: rows of W_f, W_g are axes.
Source: B. Xiao, Q. Hu, G. Ma, Adaptive L2-gain controller for flexible spacecraft attitude tracking, Control Theory &
Applications 28(1), 2011, section 3. Changed: z2, not e2, in (18a) as its proof has it; floor, projection and J_n are
not in it; (1c) is a number of this file. The start weights make g_hat = 1 / J_n at the centres; the paper draws them
from (0, 1).
Invariants: (32) while the floor is not reached; at theta = w_e = 0, W_f = 0, e1 = 0 no torque.
Limits: near a pitch of 90 deg (0.06 deg) `gimbal_lock` reports it and |cos| counts as 1e-3: the torque is bounded and
means nothing. No feedforward of the reference's acceleration: f_hat learns it. X vanishes beyond some 3 rad: the floor
acts, `floor_active` reports it. With the printed scale (J_n = 1 kg m^2) it does not settle. The L2 bound of Theorem 2
does not hold while saturated.
"""

from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from .. import vehicle
from ..framework import (
    AttitudeController,
    Component,
    Condition,
    Output,
    Parameter,
    State,
    flag_conditions,
    not_negative,
    positive,
)
from ..mathematics import euler, quaternion
from ..mathematics.limits import floored, saturated
from ..mathematics.rbf import gaussian
from ..numbers import neutral
from ..vehicle import DEGREE


@dataclass(frozen=True)
class Motion:
    """The body's angles and their rates from where they start, the angles wanted and their derivatives."""

    theta: Any
    theta_dot: Any
    y_d: Any = 0
    y_d_dot: Any = 0
    y_d_ddot: Any = 0


@dataclass(frozen=True)
class Law:
    """What the outputs and the rates of the law are made of."""

    theta: Any
    X: Any
    z1: Any
    z2: Any
    e2: Any
    f_hat: Any
    product: Any
    g_hat: Any
    u: Any
    u_out: Any
    lock: Any


def angles_from(q_BN: Any, omega_BN_B: Any, q_FN: Any, omega_FN_F: Any) -> tuple[Any, Any]:
    """Return the body's angles 3-2-1 from a frame F, and their rates."""
    q_BF = quaternion.error(q_BN, q_FN)
    theta = euler.angles_321(q_BF)
    return theta, euler.rates_321(theta, omega_BN_B - quaternion.dcm(q_BF) @ omega_FN_F, euler.LOCK)  # (1a)


class AdaptiveL2Gain(Component):
    ports = AttitudeController
    nodes: int = 5  # structural: nodes of the networks

    J = vehicle.J
    normalised = Parameter(unit="1", start=1.0, doc="1: weights of g in units of 1/J_ii, 0: of 1/(kg m^2), as printed")
    torque_limit = Parameter(
        unit="N.m",
        shape=(3,),
        start=neutral.NO_LIMIT,
        shared=True,
        doc="u_max, limit per body axis; 1e9: none (Theorem 1)",
    )
    time_unit = Parameter(unit="s", start=5.0, doc="T, unit of time of the gains and of the widths")
    k_theta = Parameter(unit="1", start=0.5, doc="k, gain of the angles")
    p1 = Parameter(unit="1", start=1.0, doc="gain of the filtered error, rate of the auxiliary system")
    gamma_l2 = Parameter(unit="1", start=1.0, doc="gamma, L2 gain that is asked for")
    c1 = Parameter(unit="1", start=1.0, doc="adaptation gain of the weights of f")
    c2 = Parameter(unit="1", start=0.1, doc="adaptation gain of the weights of g")
    g_min = Parameter(unit="1/(kg.m2)", start=1e-3, nominal=1e-3, doc="floor of the estimated input gain")
    theta_centres = Parameter(unit="rad", shape=(3, "nodes"), doc="centres in theta, a column a node")
    theta_dot_centres = Parameter(unit="rad/s", shape=(3, "nodes"), doc="centres in theta', a column a node")
    theta_width = Parameter(unit="rad", start=1.0, doc="sigma, width of the nodes; in theta' it is sigma / T")

    W_f = State(
        unit="1/s2",
        shape=(3, "nodes"),
        nominal=0.1,
        doc="weights of f, a row an axis",
    )
    W_g = State(
        unit="1",
        shape=(3, "nodes"),
        start=lambda c: 1 / max(c.nodes, 1),
        doc="weights of g times J_n, a row an axis",
    )
    e1 = State(unit="rad/s", shape=(3,), output=True, nominal=1e-2, doc="auxiliary system")

    theta = Output(unit="rad", shape=(3,), display_unit="deg", nominal=1e-2, doc="roll, pitch, yaw (Euler 3-2-1)")
    z2 = Output(unit="rad/s", shape=(3,), nominal=1e-2, doc="filtered error")
    f_hat = Output(unit="1/s2", shape=(3,), doc="estimated acceleration without torque")
    g_hat = Output(unit="1/(kg.m2)", shape=(3,), nominal=1e-3, doc="estimated input gain, not under its floor")
    u = Output(unit="N.m", shape=(3,), doc="torque before the limit")
    saturated = Output(unit="1", doc="number of axes at their limit")
    floor_active = Output(unit="1", doc="number of axes whose estimated input gain is held at its floor")
    gimbal_lock = Output(unit="1", doc="1 where the pitch is within 0.06 deg of +-90 deg, else 0")

    def derivatives(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        law = self._law(x, u, p)
        J_n, T = self._scale(p), p.time_unit
        growth = p.c2 * T**2 * law.e2 * law.u_out / J_n
        return {
            "W_f": p.c1 * law.e2 @ law.X.T / T**2,  # (28a)
            "W_g": floored(law.product, growth, p.g_min) @ law.X.T,  # (28b)
            "e1": -p.p1 * x.e1 / T + law.g_hat * (law.u_out - law.u),  # (25)
        }

    def outputs(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        law = self._law(x, u, p)
        return {
            "tau_command_B": law.u_out,
            "attitude_error": quaternion.rotation_vector(quaternion.error(u.q_BN, u.q_RN)),
            "theta": law.theta,
            "z2": law.z2,
            "f_hat": law.f_hat,
            "g_hat": law.g_hat,
            "u": law.u,
            "saturated": ca.sum1(abs(law.u) > p.torque_limit),
            "floor_active": ca.sum1(law.product <= p.g_min),
            "gimbal_lock": law.lock,
        }

    def check(self, t: Any, x: Any, u: Any, p: Any) -> list[Condition]:
        conditions = [
            *vehicle.attitude_conditions(u),
            *vehicle.inertia_conditions(p.J),
            *positive(self, p, "time_unit", "p1", "gamma_l2", "c1", "c2", "g_min", "theta_width", "torque_limit"),
            *not_negative(self, p, "k_theta"),
            *flag_conditions(self, p, "normalised"),
        ]
        law = self._law(x, u, p)
        for i, axis in enumerate(("roll", "pitch", "yaw")):
            text = (
                f"ghat(0) of {axis}, row {i + 1} of W_g times X over its inertia, is {{}} 1/(kg.m2), under its floor "
                "g_min = {} 1/(kg.m2). Start with larger weights or a smaller floor."
            )
            conditions.append(Condition(law.product[i] - p.g_min, text, (law.product[i], p.g_min)))
        pitch = law.theta[1]
        text = "pitch is {} deg from the reference at the start: the law has Euler angles 3-2-1, singular at +-90 deg."
        return [*conditions, Condition(1 - law.lock, text, (pitch / DEGREE,))]

    def _scale(self, p: Any) -> Any:
        """Return J_n."""
        return ca.if_else(p.normalised > 0.5, ca.diag(p.J), ca.SX.ones(3))

    def motion(self, u: Any, p: Any) -> Motion:
        """Return the angles that the law is about, from the reference, and what is wanted of them."""
        return Motion(*angles_from(u.q_BN, u.omega_BN_B, u.q_RN, u.omega_RN_R))

    def _law(self, x: Any, u: Any, p: Any) -> Law:
        motion, T = self.motion(u, p), p.time_unit
        theta, theta_dot = motion.theta, motion.theta_dot
        slope = (p.k_theta + 0.5) / T
        z1, z1_dot = theta - motion.y_d, theta_dot - motion.y_d_dot  # (6)
        z2 = z1_dot + slope * z1  # (7), (14)
        width = p.theta_width / np.sqrt(2)
        X = gaussian((theta, p.theta_centres, width), (theta_dot, p.theta_dot_centres, width / T))  # (38)
        f_hat, product = x.W_f @ X, x.W_g @ X / self._scale(p)
        g_hat = ca.fmax(product, p.g_min)  # (1c)
        e2 = z2 - x.e1  # (26)
        kappa = (p.gamma_l2**2 + 1) / (2 * p.gamma_l2**2)
        adaptive = -f_hat + motion.y_d_ddot - slope * z1_dot - z1 / T**2 - p.p1 * z2 / T  # (18a)
        robust = -kappa * e2 / T  # (29)
        raw = (adaptive + robust) / g_hat  # (27)
        return Law(
            theta=theta,
            X=X,
            z1=z1,
            z2=z2,
            e2=e2,
            f_hat=f_hat,
            product=product,
            g_hat=g_hat,
            u=raw,
            u_out=saturated(raw, p.torque_limit),  # (23)
            lock=euler.locked(theta),
        )
