"""Steering of gyros in any arrangement and wheels beside them, by a weighted pseudo-inverse: from a torque to rates.

    Q x = -tau_command,  x = [gamma'; Om'],  Q = [h_i t_i(gamma_i), I_j a_j]                      (1)
    x = W Q^T (Q W Q^T)^-1 (-tau_command):  of all such x that with the least x . W^-1 x          (2)
    commanded rates: dead zone(limited(gamma')),  d = Q [gamma' - commanded; 0]                   (3)
    commanded accelerations: the wheels' share and what the gyros will not give, within the torque limits,
        sat(I Om' + A_w^+ d) / I                                                                  (4)
    singular measure: det(A A^T), A the columns t_i; det(A^T A) of less than three gyros          (5)

Symbols: gamma gimbal_angle, t transverse axis at gamma (mathematics/cmg.py), h rotor_momentum; Om wheel speed, a spin
axis, column of A_w, I wheel_inertia; all axes nominal, in B. W diagonal: gimbal_weight, wheel_weight. limited keeps the
direction, as the dead zone in mathematics/allocation.py.
Source: D. Ye, Z. Sun, Y. Liu, An adaptive control algorithm for hybrid actuator with installation deviation, J. Harbin
Inst. Tech. 48(11), 2016, equations (5), (11), and (24) with its lost inverse; apart from its law, so that any
torque-commanding controller can fly its cluster. The weights are not in the paper, which has W = I.
Invariants: the commands amount to the torque wanted, to rounding, where no limit acts, and where the wheels have the
torque for what the limits of the gyros leave over; `saturated` where they do not.
Limits: W has units: with weights of 1 and small wheels nearly all is asked of the gyros, whose rates grow near their
singular angles, 1e4 for the wheels keeps them small there. Wheels that do not span three dimensions, fewer than three
for one, give their share of (2) and nothing of d: A_w^+ = 0. What a wheel cannot give no other actuator takes over.
Without wheels that span all axes Q loses rank at the singular angles, and no rates give the torque. No null motion.
"""

from typing import Any

import casadi as ca

from .. import vehicle
from ..framework import CalculatedParameter, Component, Condition, Input, Output, Parameter, positive
from ..mathematics import allocation, axes, cmg
from ..mathematics.limits import saturated


class WeightedSteering(Component):
    role = "steering"
    ports = (vehicle.MomentumStorage, vehicle.StorageLimits)
    gimbals: int = 4  # structural: control moment gyros
    wheels: int = 3  # structural: reaction wheels

    gimbal_weight = Parameter(unit="1", shape=("gimbals",), start=1.0, doc="weight of each gyro")
    wheel_weight = Parameter(unit="1/s2", shape=("wheels",), start=1.0, doc="weight of each wheel")
    wheel_allocation = CalculatedParameter(
        unit="1", shape=("wheels", 3), doc="A_w^+, pseudo-inverse of the spin axes, 0 where they do not span"
    )

    tau_command_B = Input(unit="N.m", shape=(3,), doc="torque wanted on the hub")
    gimbal_angle = Input(unit="rad", shape=("gimbals",), display_unit="deg", doc="gimbal angles")

    gimbal_rate_command = Output(
        unit="rad/s", shape=("gimbals",), display_unit="deg/s", nominal=1e-2, doc="gimbal rates wanted"
    )
    wheel_acceleration_command = Output(unit="rad/s2", shape=("wheels",), doc="wheel accelerations wanted")
    tau_planned_B = Output(unit="N.m", shape=(3,), doc="torque on the hub that the commands amount to")
    singularity = Output(unit="1", doc="det(A A^T) of the nominal axes, 0: the gyros lack a direction")
    saturated = Output(unit="1", doc="1 where the command is not met, else 0")

    def calculate(self, p: Any) -> dict[str, Any]:
        return {"wheel_allocation": axes.pseudo_inverse_or_zero(p.spin_axes_B)}

    def outputs(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        transverse, Q = self._axes(u, p)
        weights = ca.vertcat(p.gimbal_weight, p.wheel_weight)
        wanted = allocation.weighted_inverse(Q, weights) @ -u.tau_command_B  # (2)
        rates = allocation.limited(wanted[: self.gimbals], p.gimbal_rate_limit)
        rates = allocation.dead_zone(rates, p.gimbal_dead_zone)  # (3)
        lacking = Q[:, : self.gimbals] @ (wanted[: self.gimbals] - rates)  # (3)
        trimmed = wanted[self.gimbals :] + p.wheel_allocation @ lacking / p.wheel_inertia
        accelerations = saturated(trimmed, p.wheel_torque_limit / p.wheel_inertia)  # (4)
        left = lacking + Q[:, self.gimbals :] @ (wanted[self.gimbals :] - accelerations)
        return {
            "gimbal_rate_command": rates,
            "wheel_acceleration_command": accelerations,
            "tau_planned_B": -Q @ ca.vertcat(rates, accelerations),  # (1)
            "singularity": allocation.singularity(transverse),  # (5)
            "saturated": ca.sumsqr(left) > 1e-18 * ca.sumsqr(u.tau_command_B),
        }

    def check(self, t: Any, x: Any, u: Any, p: Any) -> list[Condition]:
        conditions = [
            *vehicle.storage_conditions(self, p),
            *vehicle.limit_conditions(self, p),
            *positive(self, p, "gimbal_weight", "wheel_weight"),
        ]
        transverse, _ = self._axes(u, p)
        what = "gimbal_angle is singular at the start: transverse axes of the gyros and spin_axes_B"
        remedy = "Start from other angles or add wheels."
        every = ca.horzcat(transverse, p.spin_axes_B)
        return [*conditions, axes.spanning_condition(what, every, remedy)]

    def _axes(self, u: Any, p: Any) -> tuple[Any, Any]:
        """Return the transverse axes at the gimbal angles, and Q."""
        t_0 = cmg.transverse(p.gimbal_axes_B, p.rotor_axes_B)
        _, t = cmg.rotated(p.rotor_axes_B, t_0, u.gimbal_angle)
        return t, cmg.momentum_rates(t, p.rotor_momentum, p.spin_axes_B, p.wheel_inertia)  # (1)
