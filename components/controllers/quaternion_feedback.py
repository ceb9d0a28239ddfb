"""Quaternion feedback: proportional to the error's quaternion and rate, with gains that follow from the vehicle.

    feedback = -K_q qv - K_w w_e,  qv vector part of q_BR, w_e of (1) in rigid_tracking.py        (6)
    K_q = 2 b^2 J,  K_w = 2 c b J,  each unless it is given                                       (7)
so that for small errors e = 2 qv
    e'' + 2 c b e' + b^2 e = 0                                                                    (8)
and at any error, for gyroscopic = 1 and K_q^-1 J symmetric (K_q = 2 b^2 J, or a number times the identity), with
    V = 2 (1 - q0) + w_e . K_q^-1 J w_e / 2                                                       (9)
    V' = -w_e . K_q^-1 K_w w_e                                                                    (10)

Symbols: b bandwidth, the natural frequency of (8); c damping; q0 scalar part of q_BR, not negative.
Frames: B body, R reference, N inertial.
Source: B. Wie, H. Weiss, A. Arapostathis, Quaternion feedback regulator for spacecraft eigenaxis rotations, J. Guidance
12(3), 1989: u = w x J w - D w - K q with K = k J, D = d J, of which (9) is its Lyapunov function; the feedforward of a
moving reference is (3) of rigid_tracking.py. Equation numbers are those of this file.
Invariants: (10): V never grows. With (7) from rest to rest the body turns about one axis, of qv at the start, whatever
its inertia. At q_BR = 1, w_e = 0 the torque is that of the reference's motion.
Limits: those of rigid_tracking.py. At large errors |qv| = sin(angle/2) pulls less than the angle would: slews of more
than 90 deg take longer than (8) says. Modes below some ten b are excited.
"""

from typing import Any

import casadi as ca

from ..framework import CalculatedParameter, Condition, Parameter, positive
from ..mathematics.vectors import smallest_eigenvalue
from ..numbers import neutral
from .rigid_tracking import RigidTracking


class QuaternionFeedback(RigidTracking):
    bandwidth = Parameter(
        unit="rad/s",
        start=neutral.BANDWIDTH,
        display_unit="Hz",
        tunable=True,
        doc="natural frequency of the closed loop of a rigid vehicle",
    )
    damping = Parameter(unit="1", start=neutral.DAMPING, tunable=True, doc="damping ratio of the closed loop")
    K_q = Parameter(unit="N.m", shape=(3, 3), tunable=True, doc="gain of qv, if given; all 0: 2 bandwidth^2 J")
    K_w = Parameter(
        unit="N.m.s/rad", shape=(3, 3), tunable=True, doc="gain of the rate, if given; all 0: 2 damping bandwidth J"
    )

    attitude_gain = CalculatedParameter(unit="N.m", shape=(3, 3), doc="gain of qv that is used")
    rate_gain = CalculatedParameter(unit="N.m.s/rad", shape=(3, 3), doc="gain of the rate that is used")

    def calculate(self, p: Any) -> dict[str, Any]:
        return {
            "attitude_gain": _unless_given(p.K_q, 2 * p.bandwidth**2 * p.J),  # (7)
            "rate_gain": _unless_given(p.K_w, 2 * p.damping * p.bandwidth * p.J),  # (7)
        }

    def feedback(self, q_BR: Any, rate: Any, p: Any) -> Any:
        return -p.attitude_gain @ q_BR[1:4] - p.rate_gain @ rate  # (6)

    def check(self, t: Any, x: Any, u: Any, p: Any) -> list[Condition]:
        conditions = [*super().check(t, x, u, p), *positive(self, p, "bandwidth", "damping")]
        for name, unit, gain in (("K_q", "N.m", p.attitude_gain), ("K_w", "N.m.s/rad", p.rate_gain)):
            least = smallest_eigenvalue((gain + gain.T) / 2)
            text = f"{name} is not positive definite (smallest eigenvalue {{}} {unit}): it drives the body away. Give "
            text += "one that is, or 0 for one that follows from J."
            conditions.append(Condition(least, text, (least,)))
        return conditions


def _unless_given(given: Any, otherwise: Any) -> Any:
    """Return a matrix, or, where all of it is 0, another one."""
    return ca.if_else(ca.sumsqr(given) > 0, given, otherwise)
