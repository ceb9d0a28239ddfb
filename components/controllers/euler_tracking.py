"""Adaptive tracking in Euler angles 1-2-3: what the laws of one paper have in common.

theta, theta_d: angles of body and reference; U: the angle unit of the gains, degrees unless set. The error and all that
follows from it have no unit of angle. The vehicle is taken without its modes; G, G' as in mathematics/euler.py:
    e = (theta - theta_d) / U,  theta' = F w,  G = F^-1                                           (3)
    J* theta'' + C theta' = G^T u + D,  J* = G^T J G                                              (4)
A law asks for an acceleration a of theta / U; r is the gain from there to its filtered error s, s' = r (a - f):
    a = f - D_hat - (k + K) s / (1 + T_s r (k + K)),  k = mu_hat^2 / (mu_hat |s| + sigma)         (12)
    tau = J (U G a + G' theta') + w x J w,   w = omega_BN_B                                       (12a)
    W_i' = tau_w (s_i h - beta W_i),  D_hat = W h,  h_j Gaussian in e and e'                      (13)
    mu_hat' = tau_mu (|s| - gamma mu_hat)                                                         (14)
A law says what s, r and f are. T_s = 0 is the paper's law; T_s = the step over which the torque is held keeps the gain
below what that step can stand. (12a) is B^-1 (a - A) with A = -J*^-1 C theta'; no matrix is inverted.

Frames: B body, R reference, N inertial. |.| is the Euclidean norm; rows of W are axes.
Source: C. Zhang, Y. Sun, G. Ma, C. Li, Prescribed performance adaptive attitude tracking control for flexible
spacecraft, J. Harbin Inst. Tech. 50(4), 2018, equations (3), (4), (12)-(14). Changed:
dots that the print lost (theta_d'', F' in C); the last rate centre of node 1 is -0.03, printed 0.03. It does not say U.
Limits: singular at a pitch of +-90 deg, of the body or of the reference: within 0.06 deg `gimbal_lock` reports it and
|cos| counts as 1e-3 in F, so that the torque stays finite; it means nothing there, and nothing prevents it.
The adaptation does not stop while an actuator saturates. D_hat learns what depends on the torque too (eta'').
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
    not_negative,
    positive,
)
from ..mathematics import euler, quaternion
from ..mathematics.rbf import gaussian
from ..mathematics.vectors import length
from ..vehicle import DEGREE


def _spread(reach: float) -> Any:
    """Return a start of centres: evenly from -reach to reach along the diagonal, a column a node."""
    return lambda c: np.tile(reach * (np.linspace(-1, 1, c.nodes) if c.nodes > 1 else np.zeros(c.nodes)), (3, 1))


@dataclass(frozen=True)
class Error:
    """Angles, rates and the error in the angle unit."""

    theta: Any
    theta_dot: Any
    theta_d: Any
    theta_d_ddot: Any  # in U per s2
    e: Any
    e_dot: Any


@dataclass(frozen=True)
class Surface:
    """What a law says: filtered error s, gain r of an acceleration on s', acceleration f without feedback of s."""

    s: Any
    r: Any
    f: Any


class EulerTracking(Component):
    ports = AttitudeController
    nodes: int = 7  # structural: nodes of the network

    J = vehicle.J
    angle_unit = Parameter(
        unit="rad", start=DEGREE, display_unit="deg", doc="angle unit U of the gains; 1 rad: radians"
    )
    Lambda = Parameter(unit="1/s", shape=(3,), start=0.2, doc="lambda, slope of the filtered error")
    K = Parameter(unit="1/s", shape=(3,), start=0.4, doc="feedback gain")
    sigma = Parameter(unit="1/s3", start=0.01, doc="smoothing of the robust term")
    tau_w = Parameter(unit="1/s2", start=0.01, doc="adaptation gain of the weights")
    tau_mu = Parameter(unit="1/s2", start=0.01, doc="adaptation gain of the bound")
    beta = Parameter(unit="s", start=1.0, doc="leakage of the weights")
    gamma = Parameter(unit="s", start=1.0, doc="leakage of the bound")
    centres = Parameter(unit="1", shape=(3, "nodes"), start=_spread(1.0), doc="centres in e, a column a node")
    rate_centres = Parameter(unit="1/s", shape=(3, "nodes"), start=_spread(0.1), doc="centres in e'")
    width = Parameter(unit="1", start=0.5, doc="b, width of the nodes in e")
    rate_width = Parameter(unit="1/s", start=0.05, doc="b, width of the nodes in e'")
    hold_step = Parameter(unit="s", start=0.0, doc="T_s, step that the torque is held over; 0: the paper's law")

    W = State(unit="1/s2", shape=(3, "nodes"), nominal=1e-2, doc="weights of the network, a row an axis, of e''")
    mu_hat = State(unit="1/s2", output=True, nominal=1e-2, doc="estimated bound of the network's error, of e''")

    e = Output(unit="rad", shape=(3,), display_unit="deg", nominal=1e-2, doc="error of roll, pitch, yaw (Euler 1-2-3)")
    s = Output(unit="1/s", shape=(3,), doc="filtered error")
    D_hat = Output(unit="1/s2", shape=(3,), doc="estimated disturbing acceleration of e")
    gimbal_lock = Output(unit="1", doc="1 where a pitch is within 0.06 deg of +-90 deg, else 0")

    def surface(self, t: Any, x: Any, p: Any, error: Error) -> Surface:
        """Return s, r and f of a law."""
        raise NotImplementedError

    def error(self, u: Any, p: Any) -> Error:
        """Return the error of the angles, roll and yaw the short way round."""
        theta, theta_d = euler.angles_123(u.q_BN), euler.angles_123(u.q_RN)
        theta_dot = euler.F_123(theta, euler.LOCK) @ u.omega_BN_B  # (3)
        theta_d_dot = euler.F_123(theta_d, euler.LOCK) @ u.omega_RN_R  # (3)
        theta_d_ddot = euler.acceleration_123(theta_d, theta_d_dot, u.omega_dot_RN_R, euler.LOCK)
        short = ca.atan2(ca.sin(theta - theta_d), ca.cos(theta - theta_d))
        U = p.angle_unit
        return Error(theta, theta_dot, theta_d, theta_d_ddot / U, short / U, (theta_dot - theta_d_dot) / U)

    def adaptation(self, x: Any, p: Any, error: Error, s: Any) -> dict[str, Any]:
        """Return the derivatives of W and mu_hat."""
        h = self._nodes(p, error)
        return {
            "W": p.tau_w * (s @ h.T - p.beta * x.W),  # (13)
            "mu_hat": p.tau_mu * (length(s) - p.gamma * x.mu_hat),  # (14)
        }

    def law(self, x: Any, u: Any, p: Any, error: Error, surface: Surface) -> dict[str, Any]:
        """Return the torque and the outputs that every law has."""
        s, w = surface.s, u.omega_BN_B
        D_hat = x.W @ self._nodes(p, error)  # (13)
        gain = p.K + x.mu_hat**2 / (x.mu_hat * length(s) + p.sigma)
        a = surface.f - D_hat - gain * s / (1 + p.hold_step * surface.r * gain)  # (12)
        G, G_dot = euler.G_123(error.theta), euler.G_dot_123(error.theta, error.theta_dot)
        tau = p.J @ (p.angle_unit * (G @ a) + G_dot @ error.theta_dot) + ca.cross(w, p.J @ w)  # (12a)
        return {
            "tau_command_B": tau,
            "attitude_error": quaternion.rotation_vector(quaternion.error(u.q_BN, u.q_RN)),
            "e": p.angle_unit * error.e,
            "s": s,
            "D_hat": D_hat,
            "gimbal_lock": ca.logic_or(euler.locked(error.theta), euler.locked(error.theta_d)),
        }

    def check(self, t: Any, x: Any, u: Any, p: Any) -> list[Condition]:
        conditions = [
            *vehicle.attitude_conditions(u),
            *vehicle.inertia_conditions(p.J),
            *positive(self, p, "angle_unit", "Lambda", "sigma", "width", "rate_width"),
            *not_negative(self, p, "K", "tau_w", "tau_mu", "beta", "gamma", "hold_step"),
            Condition(x.mu_hat >= 0, "mu_hat = {} 1/s2: it must not be negative.", (x.mu_hat,)),
        ]
        for name, q in (("q_BN", u.q_BN), ("q_RN", u.q_RN)):
            theta = euler.angles_123(q)
            text = f"pitch of {name} is {{}} deg at the start: the law has Euler angles 1-2-3, singular at +-90 deg."
            conditions.append(Condition(1 - euler.locked(theta), text, (theta[1] / DEGREE,)))
        return conditions

    def _nodes(self, p: Any, error: Error) -> Any:
        return gaussian((error.e, p.centres, p.width), (error.e_dot, p.rate_centres, p.rate_width))
