"""Reference attitude that jumps once, by an angle about an axis.

    q_RN = q_start (x) [cos(a/2); sin(a/2) axis],  a = 0 before step_time, angle from then on     (1)
    omega_RN_R = 0,  omega_RN_R' = 0                                                              (2)

Frames: R reference, N inertial; the axis in R (or B at the start, where q_start is its attitude: both are one).
Source: made for the 60 deg about pitch of Y. Geng, W. Wu, Y. Ma, Neural network compensation of flexible
satellite rapid maneuver, J. Harbin Inst. Tech. 44(5), 2012, section 4.
Invariants: |q_RN| = 1.
Limits: no body can follow the jump; its rate is not in omega_RN_R. t is the simulation's time.
"""

from typing import Any

import casadi as ca

from ..framework import Component, Guidance, Parameter
from ..framework.ports import NO_ROTATION
from ..mathematics import quaternion


class AttitudeStep(Component):
    ports = Guidance

    q_start = Parameter(
        unit="1", shape=(4,), start=NO_ROTATION, unit_length=True, doc="attitude before the step, scalar first"
    )
    axis = Parameter(unit="1", shape=(3,), start=(0, 1, 0), unit_length=True, doc="axis of the turn, unit vector in R")
    angle = Parameter(unit="rad", display_unit="deg", doc="angle of the turn")
    step_time = Parameter(unit="s", doc="time of the step")

    def outputs(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        angle = ca.if_else(t >= p.step_time, p.angle, 0)
        return {
            "q_RN": quaternion.product(p.q_start, quaternion.about(p.axis, angle)),  # (1)
            "omega_RN_R": ca.SX.zeros(3),  # (2)
            "omega_dot_RN_R": ca.SX.zeros(3),  # (2)
        }
