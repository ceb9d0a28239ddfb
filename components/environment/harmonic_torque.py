"""Disturbance torque of one frequency, in body axes.

    d = bias + sine sin(n t) + cosine cos(n t)                                                    (1)

Symbols: n frequency, e.g. the orbit rate; d tau_dist_B.
Source: C. Zhang, Y. Sun, G. Ma, C. Li, Prescribed performance adaptive attitude tracking control for flexible
spacecraft, J. Harbin Inst. Tech. 50(4), 2018, section 4. Without amplitudes there is none.
Limits: does not depend on the attitude; t is the simulation's time.
"""

from typing import Any

import casadi as ca

from ..framework import Component, Environment, Parameter
from ..numbers import neutral


class HarmonicTorque(Component):
    ports = Environment

    bias = Parameter(unit="N.m", shape=(3,), doc="constant part")
    sine = Parameter(unit="N.m", shape=(3,), doc="amplitude of the sine")
    cosine = Parameter(unit="N.m", shape=(3,), doc="amplitude of the cosine")
    frequency = Parameter(unit="rad/s", start=neutral.ORBIT_RATE, doc="angular frequency")

    def outputs(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        angle = p.frequency * t
        return {"tau_dist_B": p.bias + p.sine * ca.sin(angle) + p.cosine * ca.cos(angle)}  # (1)
