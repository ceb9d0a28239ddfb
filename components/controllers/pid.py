"""PID attitude control with a hard limit, for any attitude plant.

    z = rotation vector of q_BR,  w_e = omega_BN_B - dcm_BR omega_RN_R                            (1)
    u = -(K_p z + K_i I + K_d w_e)                                                                (2)
    tau_command = min(max(u, -torque_limit), torque_limit)                                        (3)
    I' = z; with conditional integration 0 where |u| > torque_limit and -z u > 0, axis by axis    (4)

Symbols: I integral of the error; z, w_e, u per body axis. Frames: B body, R reference.
Source: B. Xiao, Q. Hu, G. Ma, Adaptive L2-gain controller for flexible spacecraft attitude tracking, Control Theory &
Applications 28(1), 2011, section 4: the start values are its gains [2500, 50, 4000], read as K_p, K_i, K_d, and its
limit. Changed: rotation vector and rate error where it has Euler angles to the orbit frame and their rates: the same to
first order, without a singularity. (4)'s condition is a number of this file.
Invariants: at z = w_e = I = 0 no torque; with (4) an axis at its limit does not wind up further.
Limits: no feedforward of the reference's acceleration or of the gyroscopic torque. Half a turn off, either way is the
short one. Without conditional integration it winds up: the paper's gains diverge where J |z(0)| > 20 kg m^2.
"""

from typing import Any

import casadi as ca

from ..attitude import quaternion
from ..attitude.limits import saturated
from ..framework import AttitudeController, Component, Condition, Output, Parameter, State


class PID(Component):
    ports = AttitudeController

    K_p = Parameter(unit="N.m/rad", shape=(3,), start=2500.0, doc="proportional gain")
    K_i = Parameter(unit="N.m/(rad.s)", shape=(3,), start=50.0, doc="integral gain")
    K_d = Parameter(unit="N.m.s/rad", shape=(3,), start=4000.0, doc="gain of the rate")
    torque_limit = Parameter(unit="N.m", shape=(3,), start=0.2, doc="largest torque per body axis; 1e9: none")
    conditional = Parameter(unit="1", start=0.0, doc="1: conditional integration, 0: the error is always integrated")

    integral = State(unit="rad.s", shape=(3,), output=True, nominal=1e-2, doc="integrated error")

    u = Output(unit="N.m", shape=(3,), doc="torque before the limit")
    saturated = Output(unit="1", doc="number of axes at their limit")

    def derivatives(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        z, raw = self._law(x, u, p)
        winding = ca.logic_and(abs(raw) > p.torque_limit, -z * raw > 0)
        return {"integral": ca.if_else(ca.logic_and(p.conditional > 0.5, winding), 0, z)}  # (4)

    def outputs(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        z, raw = self._law(x, u, p)
        return {
            "tau_command_B": saturated(raw, p.torque_limit),  # (3)
            "attitude_error": z,
            "u": raw,
            "saturated": ca.sum1(abs(raw) > p.torque_limit),
        }

    def check(self, t: Any, x: Any, u: Any, p: Any) -> list[Condition]:
        conditions = []
        for i in range(3):
            value = p.torque_limit[i]
            text = f"torque_limit[{i + 1}] = {{}} N.m: it must be positive."
            conditions.append(Condition(value, text, (value,)))
            for name, gain, unit in (("K_p", p.K_p, "N.m/rad"), ("K_i", p.K_i, "N.m/(rad.s)")):
                text = f"{name}[{i + 1}] = {{}} {unit}: it must not be negative."
                conditions.append(Condition(gain[i] >= 0, text, (gain[i],)))
        return conditions

    def _law(self, x: Any, u: Any, p: Any) -> tuple[Any, Any]:
        """Return error and unlimited torque."""
        q_BR = quaternion.error(u.q_BN, u.q_RN)
        z, rate = quaternion.rotation_vector(q_BR), u.omega_BN_B - quaternion.dcm(q_BR) @ u.omega_RN_R  # (1)
        return z, -(p.K_p * z + p.K_i * x.integral + p.K_d * rate)  # (2)
