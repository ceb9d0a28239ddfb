"""Integral sliding mode control of a flexible spacecraft, its switching gain constant or from an RBF network.

Linear model of x = [e; eta; w; eta'], K = diag(Omega^2), C = diag(2 zeta Omega), M = J - delta^T delta:
    w' = M^-1 (u + delta^T (C eta' + K eta)),  eta'' = -C eta' - K eta - delta w',  e' = w        (1)
short x' = A x + B u. With the linear law G x and the surface sigma:
    sigma = D x - I,  I(t0) = D x(t0),  I' = D (A + B G) x                                        (2)
    s = (D B)^T sigma,  D B = (D_omega - D_eta_dot delta) M^-1                                    (3)
    constant gain:  u = G x - rho_0 s / (|s| + epsilon)                                           (4)
    network:        u_i = (G x)_i - rho_i s_i / (|s_i| + epsilon),  rho = W Phi                   (5)
    W_i' = gamma_W |sigma_i| Phi                                                                  (6)
    Phi_j = exp(-|xi - c_j|^2 / width^2),  xi = [roll, pitch, yaw; w; G x]                        (7)
As printed, the gain of x in u is -(D B)^-1 D A instead of G (`printed_gain`):
    D A x = D_e w + D_eta eta' + D_omega w'_0 + D_eta_dot eta''_0, the rates of (1) at u = 0      (8)
Before t0, `start_time`, the law waits:
    u = 0,  I' = 0,  W' = 0                                                                       (9)

Symbols: e rotation vector of q_RN* (x) q_BN, w rate relative to the reference (the body's in (7)), both in B; roll,
pitch, yaw: Euler angles 3-2-1 of q_BN. D is read as a torque for each state, as G is, so that sigma is a torque.
Source: Y. Geng, W. Wu, Y. Ma, Neural network compensation of flexible satellite rapid maneuver, J. Harbin Inst. Tech.
44(5), 2012, 31-35: surface, law and weights; the numbers here are this file's. Changed: K = G, since its printed
K = -(D B)^-1 D A has no attitude feedback (A has no column for e); D has one zero less. Not in the paper: G (LQ),
centres, width, epsilon, signs per axis.
Invariants: sigma(t0) = 0, after a wait where x is still that of the start; where the model is exact and rho = 0 sigma
stays zero; V = |sigma|^2 / 2 falls as V' = s^T (E - rho s / (|s| + epsilon)) with a disturbance E of u.
Limits: rest-to-rest; of a moving reference only the rate is fed back. The weights only grow. D x = 0 itself would be an
unstable surface. The integral runs on while an actuator saturates. At a pitch of +-90 deg of the body, which
`gimbal_lock` reports, roll and yaw in (7) jump and rho with them; the error does not. Gains of the wrong sign are
refused by the symmetric parts of -G_e and -G_omega; that these are positive definite does not prove A + B G stable.
"""

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
from ..mathematics import euler, quaternion
from ..mathematics.rbf import gaussian
from ..mathematics.regulator import regulator
from ..mathematics.vectors import length, smallest_eigenvalue
from ..numbers import neutral


def _gain(part: str) -> Any:
    """Return the start of a part of G: linear-quadratic, for the vehicle of the start values."""
    weights = {"e": 100.0, "eta": 0.0, "omega": 4000.0, "eta_dot": 0.0}

    def start(component: Any) -> np.ndarray:
        n = component.modes
        vehicle = (neutral.J, neutral.coupling(n), neutral.frequencies(n), np.full(n, neutral.ZETA))
        return regulator(*vehicle, weights)[part]

    return start


def _spread(reach: float, shift: int) -> Any:
    """Return the start of centres: evenly from -reach to reach along a skew line, a column a node."""

    def start(component: Any) -> np.ndarray:
        n = component.nodes
        line = np.linspace(-1, 1, n) if n > 1 else np.zeros(n)
        return reach * np.array([np.roll(line, axis + shift) for axis in range(3)]).reshape(3, n)

    return start


class IntegralSlidingMode(Component):
    ports = AttitudeController
    modes: int = 4  # structural: modes that the controller knows
    nodes: int = 6  # structural: nodes of the network

    J = vehicle.J
    delta = vehicle.delta
    Omega = vehicle.Omega
    zeta = vehicle.zeta
    G_e = Parameter(unit="N.m/rad", shape=(3, 3), start=_gain("e"), doc="gain of e")
    G_eta = Parameter(unit="kg^(1/2).m/s2", shape=(3, "modes"), start=_gain("eta"), doc="gain of eta")
    G_omega = Parameter(unit="N.m.s/rad", shape=(3, 3), start=_gain("omega"), doc="gain of the rate")
    G_eta_dot = Parameter(unit="kg^(1/2).m/s", shape=(3, "modes"), start=_gain("eta_dot"), doc="gain of eta'")
    D_e = Parameter(unit="N.m/rad", shape=(3, 3), start=np.eye(3), doc="surface, coefficient of e")
    D_eta = Parameter(unit="kg^(1/2).m/s2", shape=(3, "modes"), doc="surface, coefficient of eta")
    D_omega = Parameter(unit="N.m.s/rad", shape=(3, 3), start=5 * np.eye(3), doc="surface, coefficient of the rate")
    D_eta_dot = Parameter(unit="kg^(1/2).m/s", shape=(3, "modes"), doc="surface, coefficient of eta'")
    network = Parameter(unit="1", doc="1: gain of each axis from the network, 0: constant_gain")
    constant_gain = Parameter(
        unit="N.m", start=0.05, doc="rho_0, constant switching gain, without network; 0: the linear law"
    )
    printed_gain = Parameter(unit="1", doc="1: the printed gain -(D B)^-1 D A in place of G in u, 0: G")
    start_time = Parameter(unit="s", doc="t0, from which the law acts")
    epsilon = Parameter(unit="N.m/s", start=1e-3, doc="boundary layer of the switching term, in s")
    gamma_W = Parameter(unit="1/s", start=0.1, doc="adaptation gain of the weights")
    angle_centres = Parameter(unit="rad", shape=(3, "nodes"), start=_spread(0.5, 0), doc="centres, angles")
    omega_centres = Parameter(unit="rad/s", shape=(3, "nodes"), start=_spread(0.1, 1), doc="centres, rates")
    torque_centres = Parameter(unit="N.m", shape=(3, "nodes"), start=_spread(1.0, 2), doc="centres, G x")
    angle_width = Parameter(unit="rad", start=0.5, doc="width of the nodes, angles")
    omega_width = Parameter(unit="rad/s", start=0.1, doc="width of the nodes, rates")
    torque_width = Parameter(unit="N.m", start=1.0, doc="width of the nodes, G x")
    hub_inverse = CalculatedParameter(unit="1/(kg.m2)", shape=(3, 3), doc="inverse of M = J - delta^T delta")
    DB = CalculatedParameter(unit="1/s", shape=(3, 3), doc="D B, torque to rate of the surface")

    eta = Input(unit="kg^(1/2).m", shape=("modes",), nominal=1e-2, doc="modal coordinate, measured or estimated")
    eta_dot = Input(unit="kg^(1/2).m/s", shape=("modes",), nominal=1e-2, doc="modal rate, measured or estimated")

    integral = State(unit="N.m", shape=(3,), calculated=True, nominal=0.1, doc="I, integral part of the surface")
    W = State(unit="N.m", shape=(3, "nodes"), nominal=0.1, doc="weights of the network, a row an axis")

    sigma = Output(unit="N.m", shape=(3,), nominal=0.1, doc="surface: D x less what the linear law would give")
    s = Output(unit="N.m/s", shape=(3,), nominal=1e-2, doc="(D B)^T sigma, direction of the switching term")
    rho = Output(unit="N.m", shape=(3,), nominal=0.1, doc="switching gain")
    gimbal_lock = Output(unit="1", doc="1 where the pitch in (7) is within 0.06 deg of +-90 deg, else 0")

    def calculate(self, p: Any) -> dict[str, Any]:
        hub_inverse = ca.inv(p.J - p.delta.T @ p.delta)
        return {"hub_inverse": hub_inverse, "DB": (p.D_omega - p.D_eta_dot @ p.delta) @ hub_inverse}  # (3)

    def initial(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"integral": self._Dx(self._error(u), u, p)}  # (2)

    def derivatives(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        e, w = self._error(u)
        linear = self._linear(e, w, u, p)
        sigma = self._Dx((e, w), u, p) - x.integral
        acts = t >= p.start_time  # (9)
        return {
            "integral": ca.if_else(acts, self._DA(w, u, p) + p.DB @ linear, 0),  # (2)
            "W": ca.if_else(ca.logic_and(acts, p.network > 0.5), p.gamma_W, 0)
            * ca.fabs(sigma)
            @ self._nodes(u, p, linear).T,  # (6)
        }

    def outputs(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        e, w = self._error(u)
        linear = self._linear(e, w, u, p)
        sigma = self._Dx((e, w), u, p) - x.integral  # (2)
        s = p.DB.T @ sigma  # (3)
        rho = ca.if_else(p.network > 0.5, x.W @ self._nodes(u, p, linear), ca.repmat(p.constant_gain, 3, 1))  # (5)
        size = ca.if_else(p.network > 0.5, ca.fabs(s), ca.repmat(length(s), 3, 1))
        printed = -ca.solve(p.DB, self._DA(w, u, p))  # (8)
        torque = ca.if_else(p.printed_gain > 0.5, printed, linear) - rho * s / (size + p.epsilon)  # (4), (5)
        return {
            "tau_command_B": ca.if_else(t >= p.start_time, torque, 0),  # (9)
            "attitude_error": e,
            "sigma": sigma,
            "s": s,
            "rho": rho,
            "gimbal_lock": euler.locked(euler.angles_321(u.q_BN)),
        }

    def check(self, t: Any, x: Any, u: Any, p: Any) -> list[Condition]:
        conditions = [
            *vehicle.attitude_conditions(u),
            *vehicle.flexible_conditions(self, p),
            *positive(self, p, "epsilon", "angle_width", "omega_width", "torque_width"),
            *not_negative(self, p, "constant_gain", "gamma_W"),
            *flag_conditions(self, p, "network", "printed_gain"),
        ]
        for name, gain, unit, what in (("G_e", p.G_e, "N.m/rad", "e"), ("G_omega", p.G_omega, "N.m.s/rad", "w")):
            least = smallest_eigenvalue(-(gain + gain.T) / 2)
            text = (
                f"-{name} is not positive definite (smallest eigenvalue of its symmetric part {{}} {unit}): the torque "
                f"{name} {what} must oppose every {what}. Check the sign of {name}."
            )
            conditions.append(Condition(least, text, (least,)))
        text = (
            "D B is singular (determinant {} 1/s3): the surface does not see every torque. Change D_omega or D_eta_dot."
        )
        return [*conditions, Condition(ca.fabs(ca.det(p.DB)) - 1e-12, text, (ca.det(p.DB),))]

    def _error(self, u: Any) -> tuple[Any, Any]:
        """Return e and the rate relative to the reference."""
        q_BR = quaternion.error(u.q_BN, u.q_RN)
        return quaternion.rotation_vector(q_BR), u.omega_BN_B - quaternion.dcm(q_BR) @ u.omega_RN_R

    def _linear(self, e: Any, w: Any, u: Any, p: Any) -> Any:
        return p.G_e @ e + p.G_eta @ u.eta + p.G_omega @ w + p.G_eta_dot @ u.eta_dot

    def _Dx(self, error: tuple[Any, Any], u: Any, p: Any) -> Any:
        e, w = error
        return p.D_e @ e + p.D_eta @ u.eta + p.D_omega @ w + p.D_eta_dot @ u.eta_dot

    def _DA(self, w: Any, u: Any, p: Any) -> Any:
        """Return D A x."""
        elastic = 2 * p.zeta * p.Omega * u.eta_dot + p.Omega**2 * u.eta
        w_dot = p.hub_inverse @ (p.delta.T @ elastic)  # (1)
        eta_ddot = -elastic - p.delta @ w_dot  # (1)
        return p.D_e @ w + p.D_eta @ u.eta_dot + p.D_omega @ w_dot + p.D_eta_dot @ eta_ddot  # (8)

    def _nodes(self, u: Any, p: Any, linear: Any) -> Any:
        root = np.sqrt(2.0)  # the widths of (7) are those of rbf.py times this
        angles = euler.angles_321(u.q_BN)
        return gaussian(  # (7)
            (angles, p.angle_centres, p.angle_width / root),
            (u.omega_BN_B, p.omega_centres, p.omega_width / root),
            (linear, p.torque_centres, p.torque_width / root),
        )
