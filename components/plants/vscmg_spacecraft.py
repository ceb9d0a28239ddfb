"""Rigid spacecraft with variable-speed control moment gyros that have inertia, and reaction wheels, all in one unit.

    L = J w + k + h_B,  k = A_g I_cg gamma' + A_s I_ws Om + A_w I_w Om_w                          (1)
    J = J_s + A_s I_cs A_s^T + A_t I_ct A_t^T + A_g I_cg A_g^T + wheels                           (2)
    A_s' = A_t [gamma'],  A_t' = -A_s [gamma'],
    J' = A_t [gamma'] (I_cs - I_ct) A_s^T + A_s [gamma'] (I_cs - I_ct) A_t^T                      (3)
    L' = tau + d - w x L,  w = J^-1 (L - k - h_B)                                                 (4)
    T gamma'' = gimbal_rate_command - gamma',  Om' and Om_w' are commands                         (5)
    q' = 1/2 q (x) (0, w)                                                                         (6)
The parameter J is (2) at gamma = 0, so that J(gamma) = J + moving(gamma) - moving(0),
    moving = A_s I_cs A_s^T + A_t I_ct A_t^T                                                      (7)
The torque of further actuators that store momentum, -h_B', is in (4): tau is torque from outside.
What the motors give, and the energy of body, gyros and wheels:
    gimbal i: I_cg (gamma'' + g . w') - (I_cs - I_ct)(s . w)(t . w) - I_ws Om t . w
    rotor i: I_ws (Om' + s . w' + t . w gamma'),  wheel j: I_w (Om_w' + a . w')                   (8)
    E = w . J w / 2 + e,  e = w . k + (I_cg gamma'^2 + I_ws Om^2 + I_w Om_w^2) / 2                (9)
    motor_work' = sum of (8) times gamma', Om, Om_w
                = e' - w . (J' w / 2 + k')                                                        (10)
    k' = A_g I_cg gamma'' + A_t I_ws [Om] gamma' + A_s I_ws Om' + A_w I_w Om_w'                   (11)
With (4), J w' + J' w + k' + h_B' + w x L = tau + d. (10) has no w', so that it needs no h_B': what is integrated is
body_work, its second term, from -e at the start on, and motor_work = e + body_work.
Without the terms J' w, A_g I_cg gamma'' and w x A_g I_cg gamma' it is body and cluster as controllers know them,
equation (5) of the source; the three are outputs.

Symbols: w omega_BN_B, q q_BN, gamma gimbal_angle, Om rotor_speed and Om_w wheel_speed relative to gimbal and body, A_g,
A_s, A_t, A_w columns of gimbal, rotor, transverse and wheel axes, [x] the diagonal matrix; I_cg, I_cs, I_ct of gimbal
and rotor together, I_ws of the rotor; T gimbal_lag; tau tau_B, h_B that of further actuators, d tau_dist_B, L L_B. Axes
in B.
Source: D. Ye, Z. Sun, Y. Liu, An adaptive control algorithm for hybrid actuator with installation deviation, J. Harbin
Inst. Tech. 48(11), 2016, section 1: its (1), (2), (3), and (4), of which the print has only the last line, from
h' + w x h = 0. Its wheels are gyros whose gimbals are locked; (8) to (10) follow from E as a Lagrangian.
Invariants: |q| = 1; H_N constant if tau = d = 0; E' = w . (tau + d - h_B') + motor_work', for any axes.
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


class Cluster:
    """Gyros and wheels as they are: axes, momenta, the inertia of the whole."""

    def __init__(self, x: Any, p: Any, rotor_speed: Any):
        s_0, t_0, self.a = vehicle.true_axes(p)
        self.g, self.rate = p.gimbal_axes_B, x.gimbal_rate
        self.s, self.t = cmg.rotated(s_0, t_0, x.gimbal_angle)
        self.gimbal_momentum = self.g @ (p.I_cg * self.rate)  # (1)
        self.rotors, self.wheels = p.I_cws * rotor_speed, p.wheel_inertia * x.wheel_speed
        self.momentum = self.gimbal_momentum + self.s @ self.rotors + self.a @ self.wheels  # (1)
        self.J = p.J + _moving(self.s, self.t, p) - _moving(s_0, t_0, p)  # (2), (7)
        turning = ca.dot(p.I_cg, self.rate**2) + ca.dot(self.rotors, rotor_speed)
        self.relative_energy = (turning + ca.dot(self.wheels, x.wheel_speed)) / 2

    def energy(self, w: Any) -> Any:
        """Return what of the energy is not the body's."""
        return ca.dot(w, self.momentum) + self.relative_energy  # (9)


class Motion(Cluster):
    """The same, moving: body rate, accelerations, the torques that they take."""

    def __init__(self, x: Any, u: Any, p: Any):
        super().__init__(x, p, x.rotor_speed)
        self.w = ca.inv(self.J) @ (x.L_B - self.momentum - u.h_B)  # (4)
        difference = self.t @ ca.diag(self.rate * (p.I_cs - p.I_ct)) @ self.s.T
        self.inertia_torque = (difference + difference.T) @ self.w  # (3)
        self.gimbal_acceleration = (u.gimbal_rate_command - self.rate) / p.gimbal_lag  # (5)
        self.acceleration_torque = self.g @ (p.I_cg * self.gimbal_acceleration)
        given = self.acceleration_torque + self.t @ (self.rotors * self.rate)
        given += self.s @ (p.I_cws * u.rotor_acceleration_command)
        self.given = given + self.a @ (p.wheel_inertia * u.wheel_acceleration_command)  # (11)


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

    q_BN = State(
        unit="1", shape=(4,), start=NO_ROTATION, output=True, unit_length=True, doc="attitude of the body, scalar first"
    )
    L_B = State(unit="N.m.s", shape=(3,), calculated=True, doc="total angular momentum, that of all actuators included")
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
    body_work = State(unit="J", calculated=True, doc="motor_work without what gyros and wheels have")

    omega_BN_B = Output(unit="rad/s", shape=(3,), exact=True, display_unit="deg/s", nominal=1e-2, doc="body rate")
    motor_work = Output(unit="J", doc="work of the motors of gimbals, rotors and wheels since the start")
    energy = Output(unit="J", doc="kinetic energy of body, gyros and wheels")
    singularity = Output(unit="1", doc="det(A A^T), A the columns t; det(A^T A) of less than three gyros")
    inertia_torque_B = Output(unit="N.m", shape=(3,), nominal=1e-5, doc="J' w, that the inertia moves with the gyros")
    acceleration_torque_B = Output(
        unit="N.m", shape=(3,), nominal=1e-5, doc="A_g I_cg gamma'', gimbals that are accelerated"
    )
    gyroscopic_torque_B = Output(unit="N.m", shape=(3,), nominal=1e-5, doc="w x A_g I_cg gamma', gimbals that turn")

    def initial(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        rotor_speed = p.rotor_momentum / p.I_cws
        cluster = Cluster(x, p, rotor_speed)
        return {
            "rotor_speed": rotor_speed,
            "L_B": cluster.J @ x.omega_BN_B + cluster.momentum + u.h_B,  # (1)
            "body_work": -cluster.energy(x.omega_BN_B),  # (10)
        }

    def derivatives(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        m = Motion(x, u, p)
        return {
            "q_BN": quaternion.rate(x.q_BN, m.w),  # (6)
            "L_B": u.tau_B + u.tau_dist_B - ca.cross(m.w, x.L_B),  # (4)
            "gimbal_angle": m.rate,
            "gimbal_rate": m.gimbal_acceleration,
            "rotor_speed": u.rotor_acceleration_command,  # (5)
            "wheel_speed": u.wheel_acceleration_command,  # (5)
            "body_work": -ca.dot(m.w, m.inertia_torque / 2 + m.given),  # (10)
        }

    def project(self, x: Any, p: Any) -> dict[str, Any]:
        return {"q_BN": quaternion.normalised(x.q_BN)}

    def outputs(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        m = Motion(x, u, p)
        return {
            "omega_BN_B": m.w,
            "H_N": quaternion.rotate(x.q_BN, x.L_B),
            "motor_work": m.energy(m.w) + x.body_work,  # (10)
            "energy": ca.dot(m.w, m.J @ m.w) / 2 + m.energy(m.w),  # (9)
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
