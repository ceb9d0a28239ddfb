"""Adaptive neural backstepping for a drag-free satellite: test mass in its cage, attitudes of satellite and test mass.

Loop i, per axis, x1 error, x2 its rate: x2' = a x1 + b x2 + c u + f, and
    z = x2 + k1 x1,  u = 1/c (-lambda x1 - a x1 - b x2 - W^T h - k1 x2 - k2 z)                    (10)
    W' = Gamma^-1 h z,  h Gaussian in (x1/s1, x2/s2)                                              (22)
    1: x1 = r_rel, a = -K/m_tm, b = -D/m_tm, c = -1/m_sc, u = f_command                           (21)
    2: x1 = angles of S to R, x2 = w - A_SR w_R, a = b = 0, c = 1/J_ii, u = tau_command_S         (33)
    3: x1 = angles of T to S, x2 = w_rel, a = -K_r/I_tm, b = -D_r/I_tm, c = 1/I_tm,               (44)
       x2' has -u_2/J_ii too: u has + u_2/J_ii, and + W_2^T h_2 with `consistent_feedforward`
V = 1/2 lambda x1^2 + 1/2 z^2 + 1/2 Gamma |W* - W|^2 has V' = -lambda k1 x1^2 - k2 z^2 for f = W*^T h         (46)
and the closed loop without network is
    s^2 + (k1 + k2) s + lambda + k1 k2: stable where both coefficients are positive               (47)

Frames: S satellite, R reference, T test mass, N inertial; angles 3-2-1 as (roll, pitch, yaw).
Source: J. Li, H. Fan, Design of adaptive neural network controllers for LEO drag-free satellite, Computing Technology
and Automation 33(2), 2014, equations (10)-(45). Changed: a and b of loop 3 have the sign of (5), with `printed_signs`
the printed one; lambda, printed 1, has a unit; the centres are a fixed grid, of which the print says only that they
learn; f_feedforward is added.
Invariants: V along the loop with f = W*^T h; with network = 0 the weights stay.
Limits: angles singular at a pitch of +-90 deg, which `gimbal_lock` reports. Near zero error h is constant and the
network is an integrator of gain |h(0)|^2/Gamma. The printed feed-forward hands the satellite's disturbance to loop 3.
Nothing limits the commands.
"""

from typing import Any

import casadi as ca

from .. import drag_free, vehicle
from ..framework import (
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
from ..framework.ports import NO_ROTATION
from ..mathematics import euler, quaternion
from ..vehicle import DEGREE, inertia_conditions, quaternion_condition


class DragFreeBackstepping(Component):
    role = "controller"
    ports = (drag_free.FreeMass, drag_free.Networks)
    nodes: int = 25  # structural: nodes of each network

    J = vehicle.J
    printed_signs = drag_free.printed_signs
    stiffness = Parameter(unit="1/s2", shape=(3,), start=0.01, doc="lambda of the loops r_rel, satellite, test mass")
    k_1 = Parameter(unit="1/s", shape=(3,), start=0.1, doc="k1 of the three loops")
    k_2 = Parameter(unit="1/s", shape=(3,), start=0.1, doc="k2 of the three loops")
    Gamma = Parameter(unit="s2", shape=(3,), start=1.0, doc="weight of the networks' errors, of the three loops")
    network = Parameter(unit="1", start=1.0, doc="1: the networks learn, 0: their weights stay as they start")
    consistent_feedforward = Parameter(unit="1", start=0.0, doc="1: loop 3 gets W_2^T h_2 too, 0: the paper's law")
    f_feedforward_S = Parameter(unit="N", shape=(3,), nominal=1e-2, doc="force added to the command: known mean drag")

    r_rel = Input(unit="m", shape=(3,), nominal=1e-3, doc="test mass in its cage, S axes")
    v_rel = Input(unit="m/s", shape=(3,), nominal=1e-4, doc="rate of r_rel in S axes")
    q_SN = Input(unit="1", shape=(4,), start=NO_ROTATION, doc="attitude of the satellite, scalar first")
    omega_SN_S = Input(unit="rad/s", shape=(3,), nominal=1e-3, doc="rate of the satellite")
    q_TS = Input(unit="1", shape=(4,), start=NO_ROTATION, doc="attitude of the test mass to the satellite")
    omega_TS_T = Input(unit="rad/s", shape=(3,), nominal=1e-3, doc="rate of the test mass to the satellite")
    q_RN = Input(unit="1", shape=(4,), start=NO_ROTATION, doc="attitude of the reference, scalar first")
    omega_RN_R = Input(unit="rad/s", shape=(3,), nominal=1e-3, doc="rate of the reference")

    W_1 = State(unit="m/s2", shape=(3, "nodes"), nominal=1e-4, doc="weights of loop 1, a row an axis")
    W_2 = State(unit="rad/s2", shape=(3, "nodes"), nominal=1e-4, doc="weights of loop 2")
    W_3 = State(unit="rad/s2", shape=(3, "nodes"), nominal=1e-4, doc="weights of loop 3")

    f_command_S = Output(unit="N", shape=(3,), nominal=1e-2, doc="force wanted on the satellite")
    tau_command_S = Output(unit="N.m", shape=(3,), nominal=1e-3, doc="torque wanted on the satellite")
    tau_command_T = Output(unit="N.m", shape=(3,), nominal=1e-8, doc="torque wanted on the test mass")
    attitude_error = Output(
        unit="rad",
        shape=(3,),
        display_unit="deg",
        nominal=1e-2,
        doc="rotation vector of q_RN* (x) q_SN, short way, S axes",
    )
    phi_SR = Output(unit="rad", shape=(3,), display_unit="deg", nominal=1e-2, doc="roll, pitch, yaw of S to R")
    phi_TS = Output(unit="rad", shape=(3,), display_unit="deg", nominal=1e-2, doc="roll, pitch, yaw of T to S")
    learned_force_S = Output(unit="N", shape=(3,), nominal=1e-2, doc="force by which the network answers")
    gimbal_lock = Output(unit="1", doc="1 where a pitch is within 0.06 deg of +-90 deg, else 0")

    def derivatives(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        rates = {}
        for i, (x1, x2, nodes) in enumerate(self._loops(u, p)):
            z = x2 + p.k_1[i] * x1
            rows = [z[axis] * nodes[axis].T for axis in range(3)]
            rates[f"W_{i + 1}"] = p.network / p.Gamma[i] * ca.vertcat(*rows)  # (22)
        return rates

    def outputs(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        first, second, third = self._loops(u, p)
        learned_1, learned_2, learned_3 = (
            ca.vertcat(*(W[axis, :] @ nodes[axis] for axis in range(3)))
            for W, (_, _, nodes) in zip((x.W_1, x.W_2, x.W_3), (first, second, third), strict=True)
        )
        a_1, b_1 = -p.K / p.m_tm, -p.D / p.m_tm
        u_1 = -p.m_sc * (self._law(0, first, p) - a_1 * first[0] - b_1 * first[1] - learned_1)  # (21)
        moved = self._law(1, second, p) - learned_2  # u_2 / J_ii
        sign = 2 * p.printed_signs - 1
        a_3, b_3 = sign * p.K_r / p.I_tm, sign * p.D_r / p.I_tm
        forward = moved + ca.if_else(p.consistent_feedforward > 0.5, learned_2, 0)
        held = self._law(2, third, p) - a_3 * third[0] - b_3 * third[1] + forward - learned_3
        error = quaternion.error(u.q_SN, u.q_RN)
        return {
            "f_command_S": u_1 + p.f_feedforward_S,
            "tau_command_S": ca.diag(p.J) * moved,  # (33)
            "tau_command_T": p.I_tm * held,  # (44)
            "attitude_error": quaternion.rotation_vector(error),
            "phi_SR": second[0],
            "phi_TS": third[0],
            "learned_force_S": p.m_sc * learned_1,
            "gimbal_lock": ca.logic_or(euler.locked(second[0]), euler.locked(third[0])),
        }

    def check(self, t: Any, x: Any, u: Any, p: Any) -> list[Condition]:
        conditions = [
            *inertia_conditions(p.J),
            *positive(self, p, "m_sc", "m_tm", "I_tm", "Gamma"),
            *drag_free.network_conditions(self, p),
            *not_negative(self, p, "D", "D_r"),
            *flag_conditions(self, p, "network", "consistent_feedforward", "printed_signs"),
            *(quaternion_condition(name, vars(u)[name]) for name in ("q_SN", "q_TS", "q_RN")),
        ]
        for i in range(3):
            k_1, k_2, stiffness = f"k_1[{i + 1}]", f"k_2[{i + 1}]", f"stiffness[{i + 1}]"
            damping, spring = p.k_1[i] + p.k_2[i], p.stiffness[i] + p.k_1[i] * p.k_2[i]
            text = f"{k_1} + {k_2} = {{}} 1/s: it must be positive, or the loop is unstable."
            conditions.append(Condition(damping, text, (damping,)))  # (47)
            text = f"{stiffness} + {k_1} {k_2} = {{}} 1/s2: it must be positive, or the loop is unstable."
            conditions.append(Condition(spring, text, (spring,)))  # (47)
            for name, gain in ((k_1, p.k_1[i]), (k_2, p.k_2[i])):
                text = f"{name} = {{}} 1/s: it must not be negative where the network learns (network = 1)."
                conditions.append(Condition(ca.logic_or(p.network < 0.5, gain >= 0), text, (gain,)))  # (46)
        for name, q in (("q_SN", quaternion.error(u.q_SN, u.q_RN)), ("q_TS", u.q_TS)):
            angles = euler.angles_321(q)
            text = f"pitch of {name} is {{}} deg at the start: the law has Euler angles 3-2-1, singular at +-90 deg."
            conditions.append(Condition(1 - euler.locked(angles), text, (angles[1] / DEGREE,)))
        return conditions

    def _loops(self, u: Any, p: Any) -> list[tuple[Any, Any, list[Any]]]:
        """Return x1, x2 and the node values of each axis, loop by loop."""
        error = quaternion.error(u.q_SN, u.q_RN)
        rate = u.omega_SN_S - quaternion.dcm(error) @ u.omega_RN_R  # (33)
        loops = (
            (u.r_rel, u.v_rel),  # (21)
            (euler.angles_321(error), rate),
            (euler.angles_321(u.q_TS), u.omega_TS_T),  # (44)
        )
        return [(x1, x2, drag_free.node_values(p, i, x1, x2)) for i, (x1, x2) in enumerate(loops)]

    def _law(self, i: int, loop: tuple[Any, Any, list[Any]], p: Any) -> Any:
        x1, x2, _ = loop
        return -p.stiffness[i] * x1 - p.k_1[i] * x2 - p.k_2[i] * (x2 + p.k_1[i] * x1)  # (10)
