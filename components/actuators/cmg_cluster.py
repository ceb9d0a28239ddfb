"""Single-gimbal control moment gyros of constant rotor speed, with reaction wheels beside them; rates are commands.

    s_i0, t_i0, a_j as they are installed: (3) of vehicle.py                                      (1)
    h_B = sum_i h_i s_i(gamma_i) + sum_j I_j Om_j a_j                                             (2)
    tau_B = -h_B' = -sum_i h_i gamma_i' t_i(gamma_i) - sum_j I_j Om_j' a_j                        (3)
    r_c = dead zone(limited(gimbal_rate_command))                                                 (4)
    gamma' = r,  T r' = r_c - r;  T = 0: r = r_c                                                  (5)
    Om_j' = wheel_acceleration_command_j within the motor's torque limit / I_j                    (6)
s and t at gamma, nominal t_i0: mathematics/cmg.py; limited (the direction is kept), dead zone and singularity (of the
columns t): mathematics/allocation.py.

Symbols: gamma gimbal_angle, s rotor axis, t transverse axis, h rotor_momentum; Om wheel_speed, a spin axis, I
wheel_inertia; T gimbal_lag. All axes in B. tau_B is the mean of (3) over the communication step.
Source: D. Ye, Z. Sun, Y. Liu, An adaptive control algorithm for hybrid actuator with installation deviation, J. Harbin
Inst. Tech. 48(11), 2016, equations (3), (5) and the deviations after (18).
Invariants: the total momentum of body and cluster, for any deviation: tau_B is what h_B loses.
Limits: no inertia of the gimbals, no friction; J of the vehicle contains the rotors and does not move with gamma; the
speed of a wheel has no limit. Deviations are element by element, as the paper has them: s_i0 need not stay a unit
vector, so that they can stand for an error of h too; what leaves a gyro or a wheel no momentum is refused.
"""

from typing import Any

import casadi as ca

from .. import vehicle
from ..framework import ActuatorCluster, Component, Condition, Input, Output, Parameter, State, lag_condition
from ..mathematics import allocation, cmg
from ..mathematics.limits import saturated


class CmgCluster(Component):
    role = "actuators"
    ports = vehicle.MomentumStorage
    gimbals: int = 4  # structural: control moment gyros
    wheels: int = 3  # structural: reaction wheels

    rotor_deviation = vehicle.Installation.rotor_deviation
    transverse_deviation = vehicle.Installation.transverse_deviation
    spin_deviation = vehicle.Installation.spin_deviation
    gimbal_rate_limit = vehicle.StorageLimits.gimbal_rate_limit
    gimbal_dead_zone = vehicle.StorageLimits.gimbal_dead_zone
    gimbal_lag = Parameter(unit="s", doc="T, time constant of the gimbal servos, 0: none")
    wheel_torque_limit = vehicle.StorageLimits.wheel_torque_limit

    gimbal_rate_command = Input(
        unit="rad/s", shape=("gimbals",), display_unit="deg/s", nominal=1e-2, doc="gimbal rates wanted"
    )
    wheel_acceleration_command = Input(unit="rad/s2", shape=("wheels",), doc="wheel accelerations wanted")

    gimbal_angle = State(unit="rad", shape=("gimbals",), output=True, display_unit="deg", doc="gamma, gimbal angles")
    servo_rate = State(unit="rad/s", shape=("gimbals",), nominal=1e-2, doc="rates of the gimbal servos, if they lag")
    wheel_speed = State(
        unit="rad/s", shape=("wheels",), output=True, nominal=100.0, doc="wheel speeds relative to the body"
    )

    tau_B = ActuatorCluster.tau_B
    h_B = ActuatorCluster.h_B
    gimbal_rate = Output(
        unit="rad/s", shape=("gimbals",), display_unit="deg/s", nominal=1e-2, doc="gimbal rates carried out"
    )
    wheel_momentum = Output(unit="N.m.s", shape=("wheels",), doc="momentum of a wheel relative to the body")
    saturated = Output(unit="1", doc="1 where a limit shortens a command, else 0")
    singularity = Output(unit="1", doc="det(A A^T), A the columns t; det(A^T A) of less than three gyros")

    def derivatives(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        lagging = p.gimbal_lag > 0
        wanted = self._rates_wanted(u, p)
        return {
            "gimbal_angle": ca.if_else(lagging, x.servo_rate, wanted),  # (5)
            "servo_rate": ca.if_else(lagging, wanted - x.servo_rate, 0) / ca.if_else(lagging, p.gimbal_lag, 1),  # (5)
            "wheel_speed": self._accelerations(u, p),  # (6)
        }

    def step_means(self, t: Any, x: Any, p: Any) -> dict[str, Any]:
        return {"tau_B": -self._momentum(x, p)}  # (3)

    def outputs(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        wanted, accelerations = self._rates_wanted(u, p), self._accelerations(u, p)
        limited = allocation.limited(u.gimbal_rate_command, p.gimbal_rate_limit)
        cut = ca.vertcat(limited - u.gimbal_rate_command, accelerations - u.wheel_acceleration_command)
        return {
            "h_B": self._momentum(x, p),
            "gimbal_rate": ca.if_else(p.gimbal_lag > 0, x.servo_rate, wanted),
            "wheel_momentum": p.wheel_inertia * x.wheel_speed,
            "saturated": ca.sumsqr(cut) > 0,
            "singularity": allocation.singularity(self._directions(x, p)[1]),
        }

    def check(self, t: Any, x: Any, u: Any, p: Any) -> list[Condition]:
        conditions = [
            *vehicle.storage_conditions(self, p),
            *vehicle.limit_conditions(self, p),
            *vehicle.installation_conditions(p),
        ]
        return [*conditions, lag_condition(p, "gimbal_lag")]

    def _rates_wanted(self, u: Any, p: Any) -> Any:
        limited = allocation.limited(u.gimbal_rate_command, p.gimbal_rate_limit)
        return allocation.dead_zone(limited, p.gimbal_dead_zone)  # (4)

    def _accelerations(self, u: Any, p: Any) -> Any:
        return saturated(u.wheel_acceleration_command, p.wheel_torque_limit / p.wheel_inertia)  # (6)

    def _directions(self, x: Any, p: Any) -> tuple[Any, Any]:
        s_0, t_0, _ = vehicle.true_axes(p)
        return cmg.rotated(s_0, t_0, x.gimbal_angle)

    def _momentum(self, x: Any, p: Any) -> Any:
        s, _ = self._directions(x, p)
        _, _, a = vehicle.true_axes(p)
        return s @ p.rotor_momentum + a @ (p.wheel_inertia * x.wheel_speed)  # (2)
