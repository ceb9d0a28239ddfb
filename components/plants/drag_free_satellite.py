"""Satellite on orbit around a free test mass in its cage: two rigid bodies, spring and damper between them.

    F = -K r_rel - D r_rel',  on the test mass, S axes                                            (4)
    T = -K_r th - D_r w_rel,  on the test mass, T axes; th rotation vector of A                   (5)
    r_rel'' = A_SN [g(r + A_SN^T rho) - g(r)] + F/m_tm - (F_C + F_D - F)/m_sc                     (1)
              - 2 w x r_rel' - w x (w x rho) - w' x rho
    J w' = T_C + T_D - A^T (T + T_Ct) - rho x F - w x J w + 3 mu/r^5 r x J r                      (2)
    w_rel' = (T_Ct + T)/I_tm - A w' - A w x w_rel                                                 (3)
    r'' = g(r) + A_SN^T (F_C + F_D - F)/m_sc                                                      (3a)
    q_SN' = 1/2 q_SN (x) (0, w),  q_TS' = 1/2 q_TS (x) (0, w_rel)                                 (3b)
Angular momentum about the common mass centre, inertial axes, and energy about it, m = m_sc m_tm / (m_sc + m_tm):
    H = A_SN^T [J w + m rho x V + A^T I_tm (w_rel + A w)],  V = r_rel' + w x rho                  (6)
    E = 1/2 [w . J w + m V . V + I_tm |w_rel + A w|^2 + K |r_rel|^2 + K_r |th|^2]                 (7)
Where a component of r_rel reaches the gap, the test mass stays there: cage_contact = 1, contact_time keeps its value.

Frames: N inertial, S satellite body and cage, origin at its mass centre, T test mass; A_SN takes v_N to v_S, A = A_TS.
Symbols: rho = r_h + r_rel position of the test mass, w omega_SN_S, w_rel omega_TS_T; F_C, T_C commands on the
satellite, T_Ct on the test mass, F_D, T_D disturbances of the satellite; g with J2, see mathematics/gravity.py.
Source: J. Li, H. Fan, Design of adaptive neural network controllers for LEO drag-free satellite, Computing Technology
and Automation 33(2), 2014, equations (1)-(5). Changed: dots of (4), (5); every force in S axes; the reactions -F and
-A^T (T + T_Ct) on the satellite, which the print does not define; the gyroscopic term of (3) vanishes for a cube;
(3a), (3b) and the gravity gradient are added.
Invariants: with mu = 0 and no commands the momenta are constant, and E is where D = D_r = 0.
Limits: rigid bodies, constant mass, the test mass a cube; after contact neither impact nor friction is modelled.
"""

from typing import Any

import casadi as ca

from .. import drag_free, vehicle
from ..framework import (
    CalculatedParameter,
    Component,
    Condition,
    Input,
    Output,
    Parameter,
    State,
    not_negative,
    positive,
)
from ..framework.ports import NO_ROTATION
from ..mathematics import gravity, quaternion
from ..numbers import earth, neutral
from ..vehicle import inertia_conditions


class DragFreeSatellite(Component):
    role = "plant"
    ports = drag_free.FreeMass

    J = vehicle.J
    r_h = Parameter(unit="m", shape=(3,), doc="centre of the cage, S axes")
    cage_gap = Parameter(
        unit="m", start=neutral.GAP, display_unit="mm", doc="way of the test mass to its cage, each axis"
    )
    mu = Parameter(unit="m3/s2", start=earth.MU, doc="gravitational parameter of the Earth; 0: no gravity")
    J2 = Parameter(unit="1", start=earth.J2, doc="oblateness of the Earth")
    earth_radius = Parameter(unit="m", start=earth.EARTH_RADIUS, doc="radius of the Earth")
    J_inverse = CalculatedParameter(unit="1/(kg.m2)", shape=(3, 3), doc="inverse of J")

    f_command_S = Input(unit="N", shape=(3,), nominal=1e-2, doc="force of the thrusters at the mass centre")
    tau_command_S = Input(unit="N.m", shape=(3,), nominal=1e-3, doc="torque of the thrusters on the satellite")
    tau_command_T = Input(unit="N.m", shape=(3,), nominal=1e-8, doc="torque of the suspension on the test mass")
    f_dist_S = Input(unit="N", shape=(3,), nominal=1e-2, doc="disturbing force on the satellite")
    tau_dist_S = Input(unit="N.m", shape=(3,), nominal=1e-3, doc="disturbing torque on the satellite")

    r_N = State(unit="m", shape=(3,), start=drag_free.START_R_N, output=True, doc="position of the satellite")
    v_N = State(unit="m/s", shape=(3,), start=drag_free.START_V_N, output=True, doc="velocity of the satellite")
    q_SN = State(
        unit="1",
        shape=(4,),
        start=NO_ROTATION,
        output=True,
        unit_length=True,
        doc="attitude of the satellite, scalar first",
    )
    omega_SN_S = State(unit="rad/s", shape=(3,), output=True, nominal=1e-3, doc="rate of the satellite")
    r_rel = State(
        unit="m",
        shape=(3,),
        output=True,
        nominal=1e-3,
        doc="test mass from the centre of the cage, S axes",
    )
    v_rel = State(unit="m/s", shape=(3,), output=True, nominal=1e-4, doc="rate of r_rel in S axes")
    q_TS = State(
        unit="1",
        shape=(4,),
        start=NO_ROTATION,
        output=True,
        unit_length=True,
        doc="attitude of the test mass relative to the satellite, scalar first",
    )
    omega_TS_T = State(unit="rad/s", shape=(3,), output=True, nominal=1e-3, doc="rate of the test mass, to satellite")
    cage_contact = State(unit="1", output=True, doc="1 once the test mass has reached its cage, else 0")
    contact_time = State(unit="s", output=True, doc="time flown until the test mass reached its cage")

    H_N = Output(unit="N.m.s", shape=(3,), doc="angular momentum about the common mass centre, inertial axes")
    energy = Output(unit="J", doc="kinetic energy about the common mass centre, and that of the springs")
    residual_acceleration_S = Output(
        unit="m/s2", shape=(3,), nominal=1e-9, doc="acceleration of the test mass by spring and damper"
    )

    def calculate(self, p: Any) -> dict[str, Any]:
        return {"J_inverse": ca.inv(p.J)}

    def derivatives(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        earth = gravity.Earth(p.mu, p.J2, p.earth_radius)
        A_SN, A = quaternion.dcm(x.q_SN), quaternion.dcm(x.q_TS)
        w, w_rel, rho, v_rel = x.omega_SN_S, x.omega_TS_T, p.r_h + x.r_rel, x.v_rel
        F, T = self._suspension(x, p)
        force = u.f_command_S + u.f_dist_S - F
        torque = u.tau_command_S + u.tau_dist_S - A.T @ (T + u.tau_command_T) - ca.cross(rho, F)
        torque = torque - ca.cross(w, p.J @ w) + gravity.torque(p.mu, A_SN @ x.r_N, p.J)
        w_dot = p.J_inverse @ torque  # (2)
        gradient = A_SN @ gravity.difference(earth, x.r_N, A_SN.T @ rho)
        turning = 2 * ca.cross(w, v_rel) + ca.cross(w, ca.cross(w, rho)) + ca.cross(w_dot, rho)
        v_rel_dot = gradient + F / p.m_tm - force / p.m_sc - turning  # (1)
        w_rel_dot = (u.tau_command_T + T) / p.I_tm - A @ w_dot - ca.cross(A @ w, w_rel)  # (3)
        free = x.cage_contact < 0.5
        return {
            "r_N": x.v_N,
            "v_N": gravity.acceleration(earth, x.r_N) + A_SN.T @ force / p.m_sc,  # (3a)
            "q_SN": quaternion.rate(x.q_SN, w),  # (3b)
            "omega_SN_S": w_dot,
            "r_rel": free * v_rel,
            "v_rel": free * v_rel_dot,
            "q_TS": free * quaternion.rate(x.q_TS, w_rel),  # (3b)
            "omega_TS_T": free * w_rel_dot,
            "cage_contact": 0,
            "contact_time": free,
        }

    def project(self, x: Any, p: Any) -> dict[str, Any]:
        contact = ca.logic_or(x.cage_contact > 0.5, ca.mmax(ca.fabs(x.r_rel)) >= p.cage_gap)
        return {
            "q_SN": quaternion.normalised(x.q_SN),
            "q_TS": quaternion.normalised(x.q_TS),
            "v_rel": (1 - contact) * x.v_rel,
            "omega_TS_T": (1 - contact) * x.omega_TS_T,
            "cage_contact": contact,
        }

    def outputs(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        A_SN, A, w, rho = quaternion.dcm(x.q_SN), quaternion.dcm(x.q_TS), x.omega_SN_S, p.r_h + x.r_rel
        m, V, w_tm = p.m_sc * p.m_tm / (p.m_sc + p.m_tm), x.v_rel + ca.cross(w, rho), x.omega_TS_T + A @ w
        th = quaternion.rotation_vector(quaternion.short(x.q_TS))
        F, _ = self._suspension(x, p)
        springs = p.K * ca.sumsqr(x.r_rel) + p.K_r * ca.sumsqr(th)
        return {
            "H_N": A_SN.T @ (p.J @ w + m * ca.cross(rho, V) + A.T @ (p.I_tm * w_tm)),  # (6)
            "energy": (ca.dot(w, p.J @ w) + m * ca.sumsqr(V) + p.I_tm * ca.sumsqr(w_tm) + springs) / 2,  # (7)
            "residual_acceleration_S": F / p.m_tm,
        }

    def check(self, t: Any, x: Any, u: Any, p: Any) -> list[Condition]:
        off = ca.mmax(ca.fabs(x.r_rel))
        text = "r_rel has an element of {} mm at the start, its cage is at {} mm (cage_gap)."
        return [
            *inertia_conditions(p.J),
            *positive(self, p, "m_sc", "m_tm", "I_tm", "cage_gap", "earth_radius"),
            *not_negative(self, p, "D", "D_r", "mu"),
            gravity.surface_condition(x.r_N, p.earth_radius, p.mu),
            gravity.perigee_condition(gravity.Earth(p.mu, p.J2, p.earth_radius), x.r_N, x.v_N),
            Condition(p.cage_gap - off, text, (1e3 * off, 1e3 * p.cage_gap)),
        ]

    def _suspension(self, x: Any, p: Any) -> tuple[Any, Any]:
        """Return force (S axes) and torque (T axes) on the test mass."""
        th = quaternion.rotation_vector(quaternion.short(x.q_TS))
        return -p.K * x.r_rel - p.D * x.v_rel, -p.K_r * th - p.D_r * x.omega_TS_T  # (4), (5)
