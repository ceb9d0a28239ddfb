"""Rigid hub with elastic appendages of any number of modes; rotation only, in its total momenta.

    J w' + delta^T eta'' + h_B' + w x L = tau + d,   L = J w + delta^T eta' + h_B                 (1)
    eta'' + 2 zeta Omega eta' + Omega^2 eta + delta w' = 0                                        (2)
    q' = 1/2 q (x) (0, w)                                                                         (3)
What is integrated beside q and eta is L and psi = eta' + delta w, in which no rate of w or h_B is left:
    L' = tau + d - w x L                                                                          (4)
    eta' = psi - delta w,  psi' = -2 zeta Omega eta' - Omega^2 eta                                (5)
    (J - delta^T delta) w = L - delta^T psi - h_B                                                 (6)
(6) is L of (1) with eta' of (5). The first three terms of (1) are L', so that (4) is (1); psi' is eta'' + delta w', so
that (5) is (2). Total angular momentum and the energy of hub and modes:
    H_N = q (x) L (x) q*                                                                          (7)
    E = 1/2 w . J w + 1/2 eta' . eta' + w . delta^T eta' + 1/2 |Omega eta|^2
      = 1/2 w . (J - delta^T delta) w + 1/2 |psi|^2 + 1/2 |Omega eta|^2                           (8)

Symbols: w omega_BN_B, q q_BN, L L_B, psi psi_eta, tau tau_B, d tau_dist_B, h_B momentum stored by the actuators; B body
axes at the mass centre, N inertial. delta has a row a mode, the transpose of the papers' F.
The torque of actuators that store momentum is -h_B', which is in (6): tau is that of thrusters, or an ideal one. So the
momentum is kept whatever curve a master makes of h_B between two communication points, and w and eta' follow h_B at
once.
Source: C. Zhang, Y. Sun, G. Ma, C. Li, Prescribed performance adaptive attitude tracking control for flexible
spacecraft, J. Harbin Inst. Tech. 50(4), 2018, equations (1), (2), with eta'' where
the print has lost a dot, and with h_B added.
Invariants: |q| = 1; H_N constant if tau = d = 0; E' = w . (tau + d - h_B') - eta' . 2 zeta Omega eta'.
Limits: elastic displacement small, mass centre fixed in the hub, no orbit coupling.
"""

from typing import Any

import casadi as ca

from .. import vehicle
from ..framework import AttitudePlant, CalculatedParameter, Component, Condition, Output, State
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

    q_BN = State(
        unit="1", shape=(4,), start=NO_ROTATION, output=True, unit_length=True, doc="attitude of the body, scalar first"
    )
    L_B = State(unit="N.m.s", shape=(3,), calculated=True, doc="total angular momentum, that of the actuators included")
    eta = State(unit="kg^(1/2).m", shape=("modes",), output=True, nominal=1e-3, doc="modal coordinate, mass-normalised")
    psi_eta = State(
        unit="kg^(1/2).m/s", shape=("modes",), calculated=True, nominal=1e-3, doc="modal momentum, eta' + delta w"
    )
    omega_BN_B = Output(unit="rad/s", shape=(3,), exact=True, display_unit="deg/s", nominal=1e-2, doc="body rate")
    eta_dot = Output(unit="kg^(1/2).m/s", shape=("modes",), exact=True, nominal=1e-3, doc="modal rate")

    def calculate(self, p: Any) -> dict[str, Any]:
        return {"hub_inverse": ca.inv(self._hub(p))}  # (6)

    def initial(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {
            "L_B": p.J @ x.omega_BN_B + p.delta.T @ x.eta_dot + u.h_B,  # (1)
            "psi_eta": x.eta_dot + p.delta @ x.omega_BN_B,  # (5)
        }

    def derivatives(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        omega, eta_dot = self._rates(x, u, p)
        return {
            "q_BN": quaternion.rate(x.q_BN, omega),  # (3)
            "L_B": u.tau_B + u.tau_dist_B - ca.cross(omega, x.L_B),  # (4)
            "eta": eta_dot,  # (5)
            "psi_eta": -2 * p.zeta * p.Omega * eta_dot - p.Omega**2 * x.eta,  # (5)
        }

    def project(self, x: Any, p: Any) -> dict[str, Any]:
        return {"q_BN": quaternion.normalised(x.q_BN)}

    def outputs(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        omega, eta_dot = self._rates(x, u, p)
        kinetic = ca.dot(omega, self._hub(p) @ omega) / 2 + ca.sumsqr(x.psi_eta) / 2
        return {
            "omega_BN_B": omega,
            "eta_dot": eta_dot,
            "H_N": quaternion.rotate(x.q_BN, x.L_B),  # (7)
            "energy": kinetic + ca.sumsqr(p.Omega * x.eta) / 2,  # (8)
        }

    def check(self, t: Any, x: Any, u: Any, p: Any) -> list[Condition]:
        return vehicle.flexible_conditions(self, p)

    def _hub(self, p: Any) -> Any:
        return p.J - p.delta.T @ p.delta

    def _rates(self, x: Any, u: Any, p: Any) -> tuple[Any, Any]:
        """Return the body rate and eta'."""
        omega = p.hub_inverse @ (x.L_B - p.delta.T @ x.psi_eta - u.h_B)  # (6)
        return omega, x.psi_eta - p.delta @ omega  # (5)
