"""Reference attitude whose Euler angles 1-2-3 are sinusoids of time.

    theta_i = bias_i + amplitude_i sin(frequency_i t + phase_i)                                   (1)
    q_RN = q_x(theta_1) (x) q_y(theta_2) (x) q_z(theta_3)                                         (2)
    omega_RN_R = G(theta) theta'                                                                  (3)
    omega_RN_R' = G theta'' + G' theta'                                                           (4)

Frames: R reference, N inertial; theta turn from N to R about x, y, z. (4) is omega_dot_RN_R: the derivatives of
omega_RN in N and in R are one vector.
Source: C. Zhang, Y. Sun, G. Ma, C. Li, Prescribed performance adaptive attitude tracking control for flexible
spacecraft, J. Harbin Inst. Tech. 50(4), 2018, section 4. Without amplitude and bias it is at rest in N.
Invariants: |q_RN| = 1, and its sign is continuous in time.
Limits: t is the simulation's time, so that a later start begins later in the sinusoid.
"""

from typing import Any

import casadi as ca

from ..framework import Component, Guidance, Parameter
from ..mathematics import euler


class EulerSinusoid(Component):
    ports = Guidance

    amplitude = Parameter(
        unit="rad",
        shape=(3,),
        display_unit="deg",
        doc="amplitude of roll, pitch, yaw",
    )
    frequency = Parameter(unit="rad/s", shape=(3,), start=0.1, doc="angular frequency of roll, pitch, yaw")
    phase = Parameter(unit="rad", shape=(3,), display_unit="deg", doc="phase at t = 0 of roll, pitch, yaw")
    bias = Parameter(unit="rad", shape=(3,), display_unit="deg", doc="mean of roll, pitch, yaw")

    def outputs(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        angle = p.frequency * t + p.phase
        theta = p.bias + p.amplitude * ca.sin(angle)  # (1)
        theta_dot = p.amplitude * p.frequency * ca.cos(angle)
        theta_ddot = -p.amplitude * p.frequency**2 * ca.sin(angle)
        G, G_dot = euler.G_123(theta), euler.G_dot_123(theta, theta_dot)
        return {
            "q_RN": euler.quaternion_from_123(theta),  # (2)
            "omega_RN_R": G @ theta_dot,  # (3)
            "omega_dot_RN_R": G @ theta_ddot + G_dot @ theta_dot,  # (4)
        }
