"""Rigid hub with elastic appendages of any number of modes; rotation only.

    J w' + delta^T eta'' + w x h = tau + d,   h = J w + delta^T eta' + h_B                        (1)
    eta'' + 2 zeta Omega eta' + Omega^2 eta + delta w' = 0                                        (2)
    q' = 1/2 q (x) (0, w)                                                                         (3)
(2) in (1), with sigma = 2 zeta Omega eta' + Omega^2 eta:
    (J - delta^T delta) w' = tau + d - w x h + delta^T sigma                                      (4)
Total angular momentum and the energy of hub and modes:
    H_N = q (x) h (x) q*                                                                          (5)
    E = 1/2 w . J w + 1/2 eta' . eta' + w . delta^T eta' + 1/2 |Omega eta|^2                      (6)

Symbols: w omega_BN_B, q q_BN, tau tau_B, d tau_dist_B, h_B momentum stored by the actuators; B body axes at the mass
centre, N inertial. delta has a row a mode, the transpose of the papers' F. tau contains the reaction to h_B'.
Source: C. Zhang, Y. Sun, G. Ma, C. Li, Prescribed performance adaptive attitude tracking control for flexible
spacecraft, J. Harbin Inst. Tech. 50(4), 2018, equations (1), (2), with eta'' where
the print has lost a dot, and with h_B added.
Invariants: |q| = 1; H_N constant if tau = d = 0 and h_B constant; E' = w . (tau + d) - eta' . 2 zeta Omega eta'.
Limits: elastic displacement small, mass centre fixed in the hub, no orbit coupling.
"""

from typing import Any

import casadi as ca

from .. import vehicle
from ..framework import AttitudePlant, CalculatedParameter, Component, Condition, State
from ..framework.ports import NO_ROTATION
from ..mathematics import quaternion


class FlexibleSpacecraft(Component):
    ports = AttitudePlant
    modes: int = 8  # structural: fixed when the FMU is built

    J = vehicle.J
    delta = vehicle.delta
    Omega = vehicle.Omega
    zeta = vehicle.zeta
    hub_inverse = CalculatedParameter(unit="1/(kg.m2)", shape=(3, 3), doc="inverse of J - delta^T delta")

    q_BN = State(unit="1", shape=(4,), start=NO_ROTATION, output=True, doc="attitude of the body, scalar first")
    omega_BN_B = State(
        unit="rad/s",
        shape=(3,),
        output=True,
        display_unit="deg/s",
        nominal=1e-2,
        doc="body rate",
    )
    eta = State(unit="kg(1/2).m", shape=("modes",), output=True, nominal=1e-3, doc="modal coordinate, mass-normalised")
    eta_dot = State(unit="kg(1/2).m/s", shape=("modes",), output=True, nominal=1e-3, doc="modal rate")

    def calculate(self, p: Any) -> dict[str, Any]:
        return {"hub_inverse": ca.inv(p.J - p.delta.T @ p.delta)}  # (4)

    def derivatives(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        omega = x.omega_BN_B
        sigma = 2 * p.zeta * p.Omega * x.eta_dot + p.Omega**2 * x.eta
        torque = u.tau_B + u.tau_dist_B - ca.cross(omega, self._momentum(x, u, p)) + p.delta.T @ sigma
        omega_dot = p.hub_inverse @ torque  # (4)
        return {
            "q_BN": quaternion.rate(x.q_BN, omega),  # (3)
            "omega_BN_B": omega_dot,
            "eta": x.eta_dot,
            "eta_dot": -sigma - p.delta @ omega_dot,  # (2)
        }

    def project(self, x: Any, p: Any) -> dict[str, Any]:
        return {"q_BN": quaternion.normalised(x.q_BN)}

    def outputs(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        omega = x.omega_BN_B
        kinetic = ca.dot(omega, p.J @ omega) / 2 + ca.dot(x.eta_dot, x.eta_dot) / 2 + ca.dot(p.delta @ omega, x.eta_dot)
        return {
            "H_N": quaternion.rotate(x.q_BN, self._momentum(x, u, p)),  # (5)
            "energy": kinetic + ca.sumsqr(p.Omega * x.eta) / 2,  # (6)
        }

    def check(self, t: Any, x: Any, u: Any, p: Any) -> list[Condition]:
        return [*vehicle.flexible_conditions(self, p), vehicle.quaternion_condition("q_BN", x.q_BN)]

    def _momentum(self, x: Any, u: Any, p: Any) -> Any:
        return p.J @ x.omega_BN_B + p.delta.T @ x.eta_dot + u.h_B  # (1)
