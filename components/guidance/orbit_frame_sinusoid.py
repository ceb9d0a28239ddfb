"""Reference attitude whose Euler angles 3-2-1 from the orbit frame of a circular orbit are sinusoids of time.

    O: x along the velocity, y opposite to the orbit normal, z to nadir; q_ON = q_y(-(n t + orbit_phase))       (1)
    omega_ON_O = (0, -n, 0)                                                                                     (2)
    y_d,i = bias_i + amplitude_i sin(frequency_i t + phase_i)                                                   (3)
    q_RN = q_ON (x) q_RO(y_d)                                                                                   (4)
    omega_RN_R = R y_d' + dcm_RO omega_ON_O,  R(y_d) as in mathematics/euler.py                                 (5)
    omega_RN_R' = R y_d'' + R' y_d' - R y_d' x dcm_RO omega_ON_O                                                (6)

Frames: O orbit frame, R reference, N inertial: O at the orbit phase 0. Symbols: n orbit_rate. (6) is omega_dot_RN_R:
the derivatives of omega_RN in N and in R are one vector.
Source: B. Xiao, Q. Hu, G. Ma, Adaptive L2-gain controller for flexible spacecraft attitude tracking, Control Theory &
Applications 28(1), 2011, section 2: its orbit frame and angles; their motion is a choice, the paper has y_d = 0.
Invariants: |q_RN| = 1, and its sign is continuous in time; without amplitude and bias R is O.
Limits: t is the simulation's time. A circular orbit.
"""

from typing import Any

import casadi as ca

from ..framework import Component, Condition, Guidance, Output, Parameter
from ..mathematics import euler, gravity, quaternion
from ..numbers import neutral


class OrbitFrameSinusoid(Component):
    ports = Guidance

    orbit_rate = Parameter(
        unit="rad/s", start=neutral.ORBIT_RATE, nominal=1e-3, doc="rate of the orbit, about -y of its frame"
    )
    orbit_phase = Parameter(unit="rad", display_unit="deg", doc="angle along the orbit at t = 0")
    amplitude = Parameter(unit="rad", shape=(3,), display_unit="deg", doc="amplitude of roll, pitch, yaw")
    frequency = Parameter(unit="rad/s", shape=(3,), start=0.01, doc="angular frequency of roll, pitch, yaw")
    phase = Parameter(unit="rad", shape=(3,), display_unit="deg", doc="phase at t = 0 of roll, pitch, yaw")
    bias = Parameter(unit="rad", shape=(3,), display_unit="deg", doc="mean of roll, pitch, yaw")

    q_ON = Output(unit="1", shape=(4,), doc="attitude of the orbit frame, scalar first")
    omega_ON_O = Output(unit="rad/s", shape=(3,), display_unit="deg/s", nominal=1e-3, doc="rate of the orbit frame")
    y_d = Output(unit="rad", shape=(3,), display_unit="deg", nominal=1e-2, doc="roll, pitch, yaw from the orbit frame")
    y_d_dot = Output(unit="rad/s", shape=(3,), display_unit="deg/s", nominal=1e-3, doc="derivative of y_d")
    y_d_ddot = Output(unit="rad/s2", shape=(3,), nominal=1e-4, doc="derivative of y_d'")

    def outputs(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        half = (p.orbit_rate * t + p.orbit_phase) / 2
        q_ON = ca.vertcat(ca.cos(half), 0, -ca.sin(half), 0)  # (1)
        omega_ON_O = ca.vertcat(0, -p.orbit_rate, 0)  # (2)
        angle = p.frequency * t + p.phase
        y_d = p.bias + p.amplitude * ca.sin(angle)  # (3)
        y_d_dot = p.amplitude * p.frequency * ca.cos(angle)
        y_d_ddot = -p.amplitude * p.frequency**2 * ca.sin(angle)
        q_RO = euler.quaternion_from_321(y_d)
        R, R_dot = euler.R_321(y_d), euler.R_dot_321(y_d, y_d_dot)
        carried = quaternion.dcm(q_RO) @ omega_ON_O
        turning = R @ y_d_dot
        return {
            "q_RN": quaternion.product(q_ON, q_RO),  # (4)
            "omega_RN_R": turning + carried,  # (5)
            "omega_dot_RN_R": R @ y_d_ddot + R_dot @ y_d_dot - ca.cross(turning, carried),  # (6)
            "q_ON": q_ON,
            "omega_ON_O": omega_ON_O,
            "y_d": y_d,
            "y_d_dot": y_d_dot,
            "y_d_ddot": y_d_ddot,
        }

    def check(self, t: Any, x: Any, u: Any, p: Any) -> list[Condition]:
        return gravity.orbit_conditions(self, p)
