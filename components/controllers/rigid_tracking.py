"""Rigid attitude tracking: what is added to a feedback so that the error moves by the feedback alone.

    w_e = w - C w_R,  C = dcm_BR of q_BR = q_RN* (x) q_BN, the short way                          (1)
    J w' + w x (J w + h) = tau                                                                    (2)
    tau = feedback + v x (J w + h) + J (C w_R' - w x C w_R)                                       (3)
    v = w, or, gyroscopic = 0, v = C w_R                                                          (4)
(3) in (2):
    J w_e' = feedback - (w - v) x (J w + h)                                                       (5)

Symbols: w omega_BN_B, w_R omega_RN_R, w_R' omega_dot_RN_R, h momentum of wheels and gyros relative to the body.
Frames: B body, R reference, N inertial.
Source: B. Wie, H. Weiss, A. Arapostathis, Quaternion feedback regulator for spacecraft eigenaxis rotations, J. Guidance
12(3), 1989, which cancels w x J w for a reference at rest; (1)-(5) are numbers of this file.
Invariants: by (5) what is not cancelled does no work on w_e, gyroscopic = 0 too: w_e . (w_e x anything) = 0.
Limits: the vehicle is rigid; h only with `:momentum=1`, which takes it from the cluster. Half a turn off, either way is
the short one. No limit of the torque: that is the actuators', or `Saturation` after it.
"""

from typing import Any

import casadi as ca

from .. import vehicle
from ..framework import (
    AttitudeController,
    Component,
    ComponentError,
    Condition,
    Input,
    Parameter,
    Variable,
    flag_conditions,
)
from ..mathematics import quaternion


class RigidTracking(Component):
    """Declares what a law of a rigid vehicle knows; a subclass gives the feedback."""

    ports = AttitudeController
    momentum: int = 0  # structural: 1: takes the cluster's momentum h_B too

    J = vehicle.J
    gyroscopic = Parameter(
        unit="1", start=1.0, tunable=True, doc="1: w x (J w + h) is cancelled, 0: only what the reference's rate needs"
    )

    def declare(self) -> dict[str, Variable]:
        if self.momentum > 1:
            raise ComponentError(self.name, f"momentum = {self.momentum}: it is 0, or 1 to take h_B.")
        doc = "angular momentum stored by the actuators, relative to the hub"
        return {"h_B": Input(unit="N.m.s", shape=(3,), doc=doc)} if self.momentum else {}

    def feedback(self, q_BR: Any, rate: Any, p: Any) -> Any:
        """Return the torque of an attitude error, the short way, and a rate error, rad/s, both in B."""
        raise NotImplementedError

    def outputs(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        q_BR = quaternion.error(u.q_BN, u.q_RN)
        C, w = quaternion.dcm(q_BR), u.omega_BN_B
        w_R, w_R_dot = C @ u.omega_RN_R, C @ u.omega_dot_RN_R
        momentum = p.J @ w + (u.h_B if self.momentum else 0)
        v = ca.if_else(p.gyroscopic > 0.5, w, w_R)  # (4)
        ahead = ca.cross(v, momentum) + p.J @ (w_R_dot - ca.cross(w, w_R))
        return {
            "tau_command_B": self.feedback(q_BR, w - w_R, p) + ahead,  # (1), (3)
            "attitude_error": quaternion.rotation_vector(q_BR),
        }

    def check(self, t: Any, x: Any, u: Any, p: Any) -> list[Condition]:
        return [
            *vehicle.attitude_conditions(u),
            *vehicle.inertia_conditions(p.J),
            *flag_conditions(self, p, "gyroscopic"),
        ]
