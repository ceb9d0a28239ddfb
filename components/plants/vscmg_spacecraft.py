"""Rigid spacecraft with variable-speed control moment gyros that have inertia, and reaction wheels, all in one unit.

    h = J w + A_g I_cg gamma' + A_s I_ws Om + A_w I_w Om_w + h_B                                  (1)
    J = J_s + A_s I_cs A_s^T + A_t I_ct A_t^T + A_g I_cg A_g^T + wheels                           (2)
    A_s' = A_t [gamma'],  A_t' = -A_s [gamma'],
    J' = A_t [gamma'] (I_cs - I_ct) A_s^T + A_s [gamma'] (I_cs - I_ct) A_t^T                      (3)
    J w' + J' w + A_g I_cg gamma'' + A_t I_ws [Om] gamma' + A_s I_ws Om' + A_w I_w Om_w' + w x h = tau + d  (4)
    T gamma'' = gimbal_rate_command - gamma',  Om' and Om_w' are commands                         (5)
    q' = 1/2 q (x) (0, w)                                                                         (6)
The parameter J is (2) at gamma = 0, so that J(gamma) = J + moving(gamma) - moving(0),
    moving = A_s I_cs A_s^T + A_t I_ct A_t^T                                                      (7)
What the motors give, and the energy of body, gyros and wheels:
    gimbal i: I_cg (gamma'' + g . w') - (I_cs - I_ct)(s . w)(t . w) - I_ws Om t . w
    rotor i: I_ws (Om' + s . w' + t . w gamma'),  wheel j: I_w (Om_w' + a . w')                   (8)
    E = w . J w / 2 + w . (h - J w - h_B) + (I_cg gamma'^2 + I_ws Om^2 + I_w Om_w^2) / 2          (9)
    motor_work' = sum of (8) times gamma', Om, Om_w                                               (10)
Without the terms J' w, A_g I_cg gamma'' and w x A_g I_cg gamma' it is body and cluster as controllers know them,
equation (5) of the source; the three are outputs.

Symbols: w omega_BN_B, q q_BN, gamma gimbal_angle, Om rotor_speed and Om_w wheel_speed relative to gimbal and body, A_g,
A_s, A_t, A_w columns of gimbal, rotor, transverse and wheel axes, [x] the diagonal matrix; I_cg, I_cs, I_ct of gimbal
and rotor together, I_ws of the rotor; T gimbal_lag; tau tau_B and h_B of further actuators, d tau_dist_B. Axes in B.
Source: D. Ye, Z. Sun, Y. Liu, An adaptive control algorithm for hybrid actuator with installation deviation, J. Harbin
Inst. Tech. 48(11), 2016, section 1: its (1), (2), (3), and (4), of which the print has only the last line, from
h' + w x h = 0. Its wheels are gyros whose gimbals are locked; (8) to (10) follow from E as a Lagrangian.
Invariants: |q| = 1; H_N constant if tau = d = 0 and h_B constant; E' = w . (tau + d) + motor_work', for any axes.
Limits: rotors balanced and symmetric, no friction, no limit of rates, speeds or torques; a gimbal's rate has a servo,
for a rate that follows its command at once would have no acceleration. Deviations are element by element.
"""

from typing import Any

import casadi as ca

from .. import vehicle
from ..framework import AttitudePlant, Component, Condition, Input, Output, Parameter, State, positive
from ..framework.ports import NO_ROTATION
from ..mathematics import allocation, cmg, quaternion
from ..mathematics.vectors import smallest_eigenvalue
from ..numbers import neutral


class Motion:
    """What the equations share at a state: axes, momenta, inertia, accelerations."""

    def __init__(self, x: Any, u: Any, p: Any):
        s_0, t_0, self.a = vehicle.true_axes(p)
        self.g = p.gimbal_axes_B
        self.s, self.t = cmg.rotated(s_0, t_0, x.gimbal_angle)
        self.w, self.rate = x.omega_BN_B, x.gimbal_rate
        self.gimbal_momentum = self.g @ (p.I_cg * self.rate)  # (1)
        self.rotors, self.wheels = p.I_cws * x.rotor_speed, p.wheel_inertia * x.wheel_speed
        self.relative = self.gimbal_momentum + self.s @ self.rotors + self.a @ self.wheels  # (1)
        moved = _moving(self.s, self.t, p) - _moving(s_0, t_0, p)
        self.J = p.J + moved  # (2), (7)
        self.momentum = self.J @ self.w + self.relative + u.h_B  # (1)
        difference = self.t @ ca.diag(self.rate * (p.I_cs - p.I_ct)) @ self.s.T
        self.inertia_torque = (difference + difference.T) @ self.w  # (3)
        self.gimbal_acceleration = (u.gimbal_rate_command - self.rate) / p.gimbal_lag  # (5)
        self.acceleration_torque = self.g @ (p.I_cg * self.gimbal_acceleration)
        given = self.inertia_torque + self.acceleration_torque + self.t @ (self.rotors * self.rate)
        given += self.s @ (p.I_cws * u.rotor_acceleration_command)
        given += self.a @ (p.wheel_inertia * u.wheel_acceleration_command)
        torque = u.tau_B + u.tau_dist_B - given - ca.cross(self.w, self.momentum)
        self.w_dot = ca.inv(self.J) @ torque  # (4)


def _moving(s: Any, t: Any, p: Any) -> Any:
    return s @ ca.diag(p.I_cs) @ s.T + t @ ca.diag(p.I_ct) @ t.T  # (7)


class VscmgSpacecraft(Component):
    ports = (AttitudePlant, vehicle.MomentumStorage)
    gimbals: int = 4  # structural: variable-speed control moment gyros
    wheels: int = 3  # structural: reaction wheels

    J = vehicle.J
    rotor_deviation = vehicle.Installation.rotor_deviation
    transverse_deviation = vehicle.Installation.transverse_deviation
    spin_deviation = vehicle.Installation.spin_deviation
    I_cg = Parameter(
        unit="kg.m2", shape=("gimbals",), start=neutral.GYRO_INERTIA[0], doc="gimbal and rotor, about the gimbal axis"
    )
    I_cs = Parameter(
        unit="kg.m2", shape=("gimbals",), start=neutral.GYRO_INERTIA[1], doc="gimbal and rotor, about the rotor axis"
    )
    I_ct = Parameter(
        unit="kg.m2", shape=("gimbals",), start=neutral.GYRO_INERTIA[2], doc="gimbal and rotor, about the third axis"
    )
    I_cws = Parameter(unit="kg.m2", shape=("gimbals",), start=neutral.ROTOR_INERTIA, doc="a rotor about its axis")
    gimbal_lag = Parameter(unit="s", start=0.01, doc="T, time constant of the gimbal servos")

    gimbal_rate_command = Input(
        unit="rad/s", shape=("gimbals",), display_unit="deg/s", nominal=1e-2, doc="gimbal rates wanted"
    )
    rotor_acceleration_command = Input(unit="rad/s2", shape=("gimbals",), doc="accelerations of the gyros' rotors")
    wheel_acceleration_command = Input(unit="rad/s2", shape=("wheels",), doc="wheel accelerations wanted")

    q_BN = State(unit="1", shape=(4,), start=NO_ROTATION, output=True, doc="attitude of the body, scalar first")
    omega_BN_B = State(unit="rad/s", shape=(3,), output=True, display_unit="deg/s", nominal=1e-2, doc="body rate")
    gimbal_angle = State(unit="rad", shape=("gimbals",), output=True, display_unit="deg", doc="gamma, gimbal angles")
    gimbal_rate = State(unit="rad/s", shape=("gimbals",), output=True, nominal=1e-2, doc="gimbal rates")
    rotor_speed = State(
        unit="rad/s",
        shape=("gimbals",),
        output=True,
        calculated=True,
        nominal=100.0,
        doc="speeds of the gyros' rotors; at the start that of rotor_momentum",
    )
    wheel_speed = State(
        unit="rad/s", shape=("wheels",), output=True, nominal=100.0, doc="wheel speeds relative to the body"
    )
    motor_work = State(unit="J", output=True, doc="work of the motors of gimbals, rotors and wheels since the start")

    energy = Output(unit="J", doc="kinetic energy of body, gyros and wheels")
    singularity = Output(unit="1", doc="det(A A^T), A the columns t; det(A^T A) of less than three gyros")
    inertia_torque_B = Output(unit="N.m", shape=(3,), nominal=1e-5, doc="J' w, that the inertia moves with the gyros")
    acceleration_torque_B = Output(
        unit="N.m", shape=(3,), nominal=1e-5, doc="A_g I_cg gamma'', gimbals that are accelerated"
    )
    gyroscopic_torque_B = Output(unit="N.m", shape=(3,), nominal=1e-5, doc="w x A_g I_cg gamma', gimbals that turn")

    def initial(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"rotor_speed": p.rotor_momentum / p.I_cws}

    def derivatives(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        m = Motion(x, u, p)
        along_s, along_t = m.s.T @ m.w, m.t.T @ m.w
        turning = p.I_cg * (m.gimbal_acceleration + m.g.T @ m.w_dot)
        turning -= ((p.I_cs - p.I_ct) * along_s + m.rotors) * along_t  # (8)
        spinning = p.I_cws * (u.rotor_acceleration_command + m.s.T @ m.w_dot + along_t * m.rate)  # (8)
        wheeling = p.wheel_inertia * (u.wheel_acceleration_command + m.a.T @ m.w_dot)  # (8)
        power = ca.dot(turning, m.rate) + ca.dot(spinning, x.rotor_speed) + ca.dot(wheeling, x.wheel_speed)
        return {
            "q_BN": quaternion.rate(x.q_BN, m.w),  # (6)
            "omega_BN_B": m.w_dot,
            "gimbal_angle": m.rate,
            "gimbal_rate": m.gimbal_acceleration,
            "rotor_speed": u.rotor_acceleration_command,  # (5)
            "wheel_speed": u.wheel_acceleration_command,  # (5)
            "motor_work": power,  # (10)
        }

    def project(self, x: Any, p: Any) -> dict[str, Any]:
        return {"q_BN": quaternion.normalised(x.q_BN)}

    def outputs(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        m = Motion(x, u, p)
        turning = ca.dot(p.I_cg, m.rate**2) + ca.dot(m.rotors, x.rotor_speed) + ca.dot(m.wheels, x.wheel_speed)
        return {
            "H_N": quaternion.rotate(x.q_BN, m.momentum),
            "energy": ca.dot(m.w, m.J @ m.w) / 2 + ca.dot(m.w, m.relative) + turning / 2,  # (9)
            "singularity": allocation.singularity(m.t),
            "inertia_torque_B": m.inertia_torque,
            "acceleration_torque_B": m.acceleration_torque,
            "gyroscopic_torque_B": ca.cross(m.w, m.gimbal_momentum),
        }

    def check(self, t: Any, x: Any, u: Any, p: Any) -> list[Condition]:
        s_0, t_0, _ = vehicle.true_axes(p)
        body = p.J - _moving(s_0, t_0, p) - p.gimbal_axes_B @ ca.diag(p.I_cg) @ p.gimbal_axes_B.T
        least = smallest_eigenvalue(body)
        text = (
            "J without the gyros is not positive definite (smallest eigenvalue {} kg.m2). Gimbals and rotors hold more "
            "inertia than J."
        )
        conditions = [
            *vehicle.inertia_conditions(p.J),
            *vehicle.storage_conditions(self, p),
            *vehicle.installation_conditions(p),
            *positive(self, p, "I_cg", "I_cs", "I_ct", "I_cws", "gimbal_lag"),
            vehicle.quaternion_condition("q_BN", x.q_BN),
            Condition(least, text, (least,)),
        ]
        for i in range(self.gimbals):
            more = (
                f"I_cws[{i + 1}] = {{}} kg.m2 is above I_cs = {{}} kg.m2, which is that of gimbal and rotor together."
            )
            conditions.append(Condition(p.I_cs[i] >= p.I_cws[i], more, (p.I_cws[i], p.I_cs[i])))
        step = vars(p)["solver.step"]
        slow = "gimbal_lag = {} s: it must be at least half the internal step, solver.step = {} s."
        return [*conditions, Condition(p.gimbal_lag >= step / 2, slow, (p.gimbal_lag, step))]
