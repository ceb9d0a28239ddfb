"""Reference that turns with a sinusoidal rate in its own axes; its attitude is integrated.

    omega_RN_R,i = bias_i + amplitude_i sin(frequency_i t + phase_i)                              (1)
    omega_RN_R,i' = amplitude_i frequency_i cos(frequency_i t + phase_i)                          (2)
    q_RN' = 1/2 q_RN (x) [0; omega_RN_R]                                                          (3)

Frames: R reference, N inertial. (2) is omega_dot_RN_R: the derivatives of omega_RN in N and in R are one vector.
Source: D. Ye, Z. Sun, Y. Liu, An adaptive control algorithm for hybrid actuator with installation deviation, J. Harbin
Inst. Tech. 48(11), 2016, section 4. Without amplitude and bias it is at rest in N.
Invariants: |q_RN| = 1, and its sign is continuous in time.
Limits: t is the simulation's time, so that a later start begins later in the sinusoid.
"""

from typing import Any

import casadi as ca

from ..framework import Component, Guidance, Parameter, State
from ..framework.ports import NO_ROTATION
from ..mathematics import quaternion


class BodyRateSinusoid(Component):
    ports = Guidance

    amplitude = Parameter(
        unit="rad/s",
        shape=(3,),
        display_unit="deg/s",
        doc="amplitude of the rate about x, y, z",
    )
    frequency = Parameter(
        unit="rad/s",
        shape=(3,),
        start=0.01,
        doc="angular frequency of the rate about x, y, z",
    )
    phase = Parameter(unit="rad", shape=(3,), display_unit="deg", doc="phase at t = 0 of the rate about x, y, z")
    bias = Parameter(unit="rad/s", shape=(3,), display_unit="deg/s", doc="mean rate about x, y, z")

    q_RN = State(
        unit="1",
        shape=(4,),
        start=NO_ROTATION,
        output=True,
        unit_length=True,
        doc="attitude of the reference, scalar first",
    )

    def derivatives(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"q_RN": quaternion.rate(x.q_RN, self._rate(t, p))}  # (3)

    def project(self, x: Any, p: Any) -> dict[str, Any]:
        return {"q_RN": quaternion.normalised(x.q_RN)}

    def outputs(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {
            "omega_RN_R": self._rate(t, p),
            "omega_dot_RN_R": p.amplitude * p.frequency * ca.cos(p.frequency * t + p.phase),  # (2)
        }

    def _rate(self, t: Any, p: Any) -> Any:
        return p.bias + p.amplitude * ca.sin(p.frequency * t + p.phase)  # (1)
