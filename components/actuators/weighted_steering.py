"""Steering of gyros in any arrangement and wheels beside them, by a weighted pseudo-inverse: from a torque to rates.

    Q x = -tau_command,  x = [gamma'; Om'],  Q = [h_i t_i(gamma_i), I_j a_j]                      (1)
    x = W Q^T (Q W Q^T)^-1 (-tau_command):  of all such x that with the least x . W^-1 x          (2)
    singular measure: det(A A^T), A the columns t_i; det(A^T A) of less than three gyros          (3)

Symbols: gamma gimbal_angle, t transverse axis at gamma (attitude/cmg.py), h rotor_momentum; Om wheel speed, a spin
axis, I wheel_inertia; all axes nominal, in B. W diagonal: gimbal_weight, wheel_weight.
Source: D. Ye, Z. Sun, Y. Liu, An adaptive control algorithm for hybrid actuator with installation deviation, J. Harbin
Inst. Tech. 48(11), 2016, equations (5), (11), and (24) with its lost inverse; apart from its law, so that any
torque-commanding controller can fly its cluster. The weights are not in the paper, which has W = I.
Invariants: the commands amount to the torque wanted, to rounding.
Limits: no limit of rates or torques, the cluster has those. W has units: with weights of 1 and small wheels nearly all
is asked of the gyros, whose rates grow near their singular angles, 1e4 for the wheels keeps them small there. Without
wheels that span all axes Q loses rank at the singular angles, and no rates give the torque. No null motion.
"""

from typing import Any

import casadi as ca

from .. import vehicle
from ..attitude import allocation, cmg
from ..attitude.vectors import smallest_eigenvalue
from ..framework import Component, Condition, Input, Output, Parameter, positive


class WeightedSteering(Component):
    ports = vehicle.MomentumStorage
    gimbals: int = 4  # structural: control moment gyros
    wheels: int = 3  # structural: reaction wheels

    gimbal_weight = Parameter(unit="1", shape=("gimbals",), start=1.0, doc="weight of each gyro")
    wheel_weight = Parameter(unit="1/s2", shape=("wheels",), start=1.0, doc="weight of each wheel")

    tau_command_B = Input(unit="N.m", shape=(3,), doc="torque wanted on the hub")
    gimbal_angle = Input(unit="rad", shape=("gimbals",), display_unit="deg", doc="gimbal angles")

    gimbal_rate_command = Output(
        unit="rad/s", shape=("gimbals",), display_unit="deg/s", nominal=1e-2, doc="gimbal rates wanted"
    )
    wheel_acceleration_command = Output(unit="rad/s2", shape=("wheels",), doc="wheel accelerations wanted")
    tau_planned_B = Output(unit="N.m", shape=(3,), doc="torque on the hub that the commands amount to")
    singularity = Output(unit="1", doc="det(A A^T) of the nominal axes, 0: the gyros lack a direction")

    def outputs(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        axes, Q = self._axes(u, p)
        weights = ca.vertcat(p.gimbal_weight, p.wheel_weight)
        commands = allocation.weighted_inverse(Q, weights) @ -u.tau_command_B  # (2)
        return {
            "gimbal_rate_command": commands[: self.gimbals],
            "wheel_acceleration_command": commands[self.gimbals :],
            "tau_planned_B": -Q @ commands,  # (1)
            "singularity": allocation.singularity(axes),  # (3)
        }

    def check(self, t: Any, x: Any, u: Any, p: Any) -> list[Condition]:
        conditions = [
            *vehicle.storage_conditions(self, p),
            *positive(self, p, "gimbal_weight", "wheel_weight"),
        ]
        axes, _ = self._axes(u, p)
        every = ca.horzcat(axes, p.spin_axes_B)
        least = smallest_eigenvalue(every @ every.T)
        text = (
            "gimbal_angle is singular at the start: transverse axes of the gyros and spin_axes_B do not span three "
            "dimensions (smallest eigenvalue of A A^T {}). Start from other angles or add wheels."
        )
        return [*conditions, Condition(least - 1e-6, text, (least,))]

    def _axes(self, u: Any, p: Any) -> tuple[Any, Any]:
        """Return the transverse axes at the gimbal angles, and Q."""
        _, axes = cmg.rotated(p.rotor_axes_B, cmg.transverse(p.gimbal_axes_B, p.rotor_axes_B), u.gimbal_angle)
        return axes, cmg.momentum_rates(axes, p.rotor_momentum, p.spin_axes_B, p.wheel_inertia)  # (1)
