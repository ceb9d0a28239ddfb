"""PID attitude control with a hard limit, for any attitude plant.

    z = rotation vector of q_BR,  z' = w_e = omega_BN_B - dcm_BR omega_RN_R                       (1)
    or, euler = 1: z = Euler angles 3-2-1 of q_BR,  z' = R^-1 w_e                                 (2)
    u = -(K_p z + K_i I + K_d z')                                                                 (3)
    tau_command = min(max(u, -torque_limit), torque_limit)                                        (4)
    I' = z; with conditional integration 0 where |u| > torque_limit and -z u > 0, axis by axis    (5)

Symbols: I integral of the error; z, u per body axis. Frames: B body, R reference.
Source: B. Xiao, Q. Hu, G. Ma, Adaptive L2-gain controller for flexible spacecraft attitude tracking, Control Theory &
Applications 28(1), 2011, section 4, which prints [2500, 50, 4000], read as K_p, K_i, K_d; (2) is the paper's error, (1)
the same to first order and without a singularity. Equation numbers are those of this file.
Invariants: at z = w_e = I = 0 no torque; with (5) an axis at its limit does not wind up further.
Limits: no feedforward of the reference's acceleration or of the gyroscopic torque. Half a turn off, either way is the
short one. Without conditional integration it winds up: the paper's gains diverge where J |z(0)| > 20 to 25 kg m^2. With
(2) a pitch within 0.06 deg of 90 deg is reported by `gimbal_lock`; |cos| counts as 1e-3 there.
"""

from typing import Any

import casadi as ca
import numpy as np

from .. import vehicle
from ..framework import (
    AttitudeController,
    Component,
    Condition,
    Output,
    Parameter,
    State,
    flag_conditions,
    not_negative,
    positive,
)
from ..mathematics import euler, quaternion
from ..mathematics.limits import saturated
from ..numbers import neutral
from ..vehicle import DEGREE

INERTIA = np.diag(neutral.J)


class PID(Component):
    ports = AttitudeController

    K_p = Parameter(unit="N.m/rad", shape=(3,), start=neutral.BANDWIDTH**2 * INERTIA, doc="proportional gain")
    K_i = Parameter(unit="N.m/(rad.s)", shape=(3,), start=neutral.BANDWIDTH**3 / 10 * INERTIA, doc="integral gain")
    K_d = Parameter(
        unit="N.m.s/rad", shape=(3,), start=2 * neutral.DAMPING * neutral.BANDWIDTH * INERTIA, doc="gain of the rate"
    )
    torque_limit = Parameter(
        unit="N.m", shape=(3,), start=neutral.NO_LIMIT, shared=True, doc="largest torque per body axis; 1e9: none"
    )
    conditional = Parameter(unit="1", start=0.0, doc="1: conditional integration, 0: the error is always integrated")

    euler = Parameter(unit="1", start=0.0, doc="1: error in Euler angles 3-2-1, as the paper, 0: rotation vector")

    integral = State(unit="rad.s", shape=(3,), output=True, nominal=1e-2, doc="integrated error")

    u = Output(unit="N.m", shape=(3,), doc="torque before the limit")
    saturated = Output(unit="1", doc="number of axes at their limit")
    gimbal_lock = Output(unit="1", doc="1 where the pitch of Euler angles is within 0.06 deg of +-90 deg, else 0")

    def derivatives(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        z, raw = self._law(x, u, p)
        winding = ca.logic_and(abs(raw) > p.torque_limit, -z * raw > 0)
        return {"integral": ca.if_else(ca.logic_and(p.conditional > 0.5, winding), 0, z)}  # (5)

    def outputs(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        _, raw = self._law(x, u, p)
        q_BR = quaternion.error(u.q_BN, u.q_RN)
        return {
            "tau_command_B": saturated(raw, p.torque_limit),  # (4)
            "attitude_error": quaternion.rotation_vector(q_BR),
            "u": raw,
            "saturated": ca.sum1(abs(raw) > p.torque_limit),
            "gimbal_lock": self._locked(q_BR, p),
        }

    def check(self, t: Any, x: Any, u: Any, p: Any) -> list[Condition]:
        conditions = [
            *vehicle.attitude_conditions(u),
            *positive(self, p, "torque_limit"),
            *not_negative(self, p, "K_p", "K_i", "K_d"),
            *flag_conditions(self, p, "conditional", "euler"),
        ]
        q_BR = quaternion.error(u.q_BN, u.q_RN)
        text = "pitch is {} deg from the reference at the start: Euler angles (euler = 1) are singular at +-90 deg."
        pitch = euler.angles_321(q_BR)[1] / DEGREE
        return [*conditions, Condition(1 - self._locked(q_BR, p), text, (pitch,))]

    def _locked(self, q_BR: Any, p: Any) -> Any:
        return ca.logic_and(p.euler > 0.5, euler.locked(euler.angles_321(q_BR)))

    def _law(self, x: Any, u: Any, p: Any) -> tuple[Any, Any]:
        """Return error and unlimited torque."""
        q_BR = quaternion.error(u.q_BN, u.q_RN)
        rate = u.omega_BN_B - quaternion.dcm(q_BR) @ u.omega_RN_R  # (1)
        theta = euler.angles_321(q_BR)
        z = ca.if_else(p.euler > 0.5, theta, quaternion.rotation_vector(q_BR))
        z_dot = ca.if_else(p.euler > 0.5, euler.rates_321(theta, rate, euler.LOCK), rate)  # (2)
        return z, -(p.K_p * z + p.K_i * x.integral + p.K_d * z_dot)  # (3)
