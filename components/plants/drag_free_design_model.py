"""The model that the law of a drag-free satellite is designed on: three loops, each axis of them by itself.

Per axis, x1' = x2 in each loop:
    r_rel:     v_rel' = a1 r_rel + b1 v_rel + c1 F_C + f1,  a1 = -K/m_tm, b1 = -D/m_tm, c1 = -1/m_sc     (7)
    satellite: w' = c2 T_C + f2,  c2 = 1/J_ii                                                            (8)
    test mass: w_rel' = a2 phi_TS + b2 w_rel - c2 T_C + c3 T_Ct + f3,                                    (9)
               a2 = -K_r/I_tm, b2 = -D_r/I_tm, c3 = 1/I_tm
What is unknown: of the paper's form, a function of the loop's own x1, x2, and the disturbances that remark 2.1 names:
    f1 = W_1^T h_1 + c1 F_D,  f2 = W_2^T h_2 + c2 T_D,  f3 = W_3^T h_3 - c2 T_D                          (12)
    q_SN, q_TS: quaternions of the angles phi_SN, phi_TS, sequence 3-2-1                                 (12a)

Frames: S satellite and cage, T test mass, N inertial; angles as (roll, pitch, yaw), their rates are taken for w, w_rel.
Symbols: w omega_SN_S, w_rel omega_TS_T; F_C, T_C, T_Ct commands, F_D, T_D disturbances; h Gaussian nodes, as the
law's, see components/drag_free.py.
Source: J. Li, H. Fan, Design of adaptive neural network controllers for LEO drag-free satellite, Computing Technology
and Automation 33(2), 2014, equations (6)-(12). Changed: a2, b2 have the sign of (5); `printed_signs` has the printed
one, with which the test mass is unstable, exp(sqrt(K_r/I_tm) t). Chosen: the networks as f, which the paper assumes.
Invariants: no axis and no loop acts on another but T_C on the test mass; with f = 0 and no commands r_rel swings.
Limits: that of DragFreeSatellite for small angles and rates, a test mass much lighter than its satellite, r_h = 0 and
without gravity. No cage; a pitch beyond 90 deg is not in the quaternions.
"""

from typing import Any

import casadi as ca

from .. import drag_free, vehicle
from ..framework import Component, Condition, Input, Output, Parameter, State, flag_conditions, not_negative, positive
from ..mathematics import euler
from ..vehicle import DEGREE, inertia_conditions


class DragFreeDesignModel(Component):
    role = "plant"
    ports = (drag_free.FreeMass, drag_free.Networks)
    nodes: int = 25  # structural: nodes of each network

    J = vehicle.J
    printed_signs = drag_free.printed_signs
    W_1 = Parameter(unit="m/s2", shape=(3, "nodes"), nominal=1e-4, doc="weights of f1, a row an axis")
    W_2 = Parameter(unit="rad/s2", shape=(3, "nodes"), nominal=1e-4, doc="weights of f2")
    W_3 = Parameter(unit="rad/s2", shape=(3, "nodes"), nominal=1e-4, doc="weights of f3")

    f_command_S = Input(unit="N", shape=(3,), nominal=1e-2, doc="force of the thrusters on the satellite")
    tau_command_S = Input(unit="N.m", shape=(3,), nominal=1e-3, doc="torque of the thrusters on the satellite")
    tau_command_T = Input(unit="N.m", shape=(3,), nominal=1e-8, doc="torque of the suspension on the test mass")
    f_dist_S = Input(unit="N", shape=(3,), nominal=1e-2, doc="disturbing force on the satellite")
    tau_dist_S = Input(unit="N.m", shape=(3,), nominal=1e-3, doc="disturbing torque on the satellite")

    r_rel = State(unit="m", shape=(3,), output=True, nominal=1e-3, doc="test mass from the centre of the cage")
    v_rel = State(unit="m/s", shape=(3,), output=True, nominal=1e-4, doc="rate of r_rel")
    phi_SN = State(
        unit="rad", shape=(3,), output=True, display_unit="deg", nominal=1e-2, doc="roll, pitch, yaw of S to N"
    )
    omega_SN_S = State(unit="rad/s", shape=(3,), output=True, nominal=1e-3, doc="rate of phi_SN")
    phi_TS = State(
        unit="rad", shape=(3,), output=True, display_unit="deg", nominal=1e-2, doc="roll, pitch, yaw of T to S"
    )
    omega_TS_T = State(unit="rad/s", shape=(3,), output=True, nominal=1e-3, doc="rate of phi_TS")
    q_SN = Output(unit="1", shape=(4,), doc="attitude of the satellite, scalar first")
    q_TS = Output(unit="1", shape=(4,), doc="attitude of the test mass relative to the satellite, scalar first")

    def derivatives(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        sign, c_2 = 2 * p.printed_signs - 1, 1 / ca.diag(p.J)
        f_1, f_2, f_3 = self._unknown(x, u, p)
        spring = -p.K / p.m_tm * x.r_rel - p.D / p.m_tm * x.v_rel
        twist = sign * (p.K_r * x.phi_TS + p.D_r * x.omega_TS_T) / p.I_tm
        return {
            "r_rel": x.v_rel,
            "v_rel": spring - u.f_command_S / p.m_sc + f_1,  # (7)
            "phi_SN": x.omega_SN_S,
            "omega_SN_S": c_2 * u.tau_command_S + f_2,  # (8)
            "phi_TS": x.omega_TS_T,
            "omega_TS_T": twist - c_2 * u.tau_command_S + u.tau_command_T / p.I_tm + f_3,  # (9)
        }

    def outputs(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"q_SN": euler.quaternion_from_321(x.phi_SN), "q_TS": euler.quaternion_from_321(x.phi_TS)}  # (12a)

    def check(self, t: Any, x: Any, u: Any, p: Any) -> list[Condition]:
        beside = ca.mmax(ca.fabs(p.J - ca.diag(ca.diag(p.J))))
        coupled = "J has an element of {} kg.m2 beside its diagonal: this model has no coupling. Use DragFreeSatellite."
        conditions = [
            *inertia_conditions(p.J),
            Condition(beside <= 0, coupled, (beside,)),
            *positive(self, p, "m_sc", "m_tm", "I_tm"),
            *not_negative(self, p, "D", "D_r"),
            *drag_free.network_conditions(self, p),
            *flag_conditions(self, p, "printed_signs"),
        ]
        for name, phi in (("phi_SN", x.phi_SN), ("phi_TS", x.phi_TS)):
            pitch = phi[1] / DEGREE
            text = f"{name}[2] = {{}} deg at the start: a pitch of angles 3-2-1 is within +-90 deg."
            conditions.append(Condition(90 - ca.fabs(pitch), text, (pitch,)))
        return conditions

    def _unknown(self, x: Any, u: Any, p: Any) -> tuple[Any, Any, Any]:
        """Return f1, f2, f3."""
        loops = ((p.W_1, x.r_rel, x.v_rel), (p.W_2, x.phi_SN, x.omega_SN_S), (p.W_3, x.phi_TS, x.omega_TS_T))
        f_1, f_2, f_3 = (
            ca.vertcat(*(W[axis, :] @ h for axis, h in enumerate(drag_free.node_values(p, i, x1, x2))))
            for i, (W, x1, x2) in enumerate(loops)
        )
        moved = u.tau_dist_S / ca.diag(p.J)
        return f_1 - u.f_dist_S / p.m_sc, f_2 + moved, f_3 - moved  # (12)
