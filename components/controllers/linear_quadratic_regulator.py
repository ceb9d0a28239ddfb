"""Linear-quadratic regulator of a rigid vehicle, designed for its inertia at initialization.

    feedback = -k e - K_d w_e,  e rotation vector of q_BR, w_e of (1) in rigid_tracking.py        (6)
minimises, for e' = w_e, J w_e' = feedback, the integral of
    |e|^2/E^2 + |w_e|^2/W^2 + |feedback|^2/T^2                                                    (7)
Its Riccati equation A^T P + P A - P B R^-1 B^T P + Q = 0 has for these weights a solution in which all blocks are
functions of J, so that they commute; block by block
    k = T/E                                                                                       (8)
    K_d = sqrt((T/W)^2 1 + 2 k J), the square root of a matrix                                    (9)
    P = [k K_d, k J; k J, J K_d] / T^2                                                            (10)
    e . P e etc. is the cost from there on                                                        (11)

Symbols: E acceptable_error, W acceptable_rate, T acceptable_torque: by Bryson's rule what is as bad as each other. With
W = 1e9 the damping ratio is sqrt(1/2) about every principal axis, of inertia j, at the natural frequency sqrt(k/j).
Frames: B body, R reference, N inertial.
Source: textbook (algebraic Riccati equation; A. Bryson, Y.-C. Ho, Applied Optimal Control, 1975, for the weights); (8)-
(10) solve it for a full J and are numbers of this file.
Invariants: V = k |e|^2/2 + w_e . J w_e/2, V' = -w_e . K_d w_e at any error, gyroscopic = 0 too. From any state of the
linear vehicle the cost (7) is (11).
Limits: those of rigid_tracking.py. One weight for all axes: with others P does not commute with J. Optimal for the
vehicle without modes; k and K_d are of no use below its own delays.
"""

from typing import Any

import casadi as ca

from ..framework import CalculatedParameter, Condition, Parameter, positive
from ..mathematics import quaternion
from ..mathematics.vectors import square_root
from .rigid_tracking import RigidTracking


class LinearQuadraticRegulator(RigidTracking):
    acceptable_error = Parameter(
        unit="rad", start=0.1, display_unit="deg", tunable=True, doc="attitude error as bad as the acceptable torque"
    )
    acceptable_rate = Parameter(
        unit="rad/s",
        start=0.02,
        display_unit="deg/s",
        tunable=True,
        doc="rate error as bad as the acceptable torque; 1e9: any",
    )
    acceptable_torque = Parameter(unit="N.m", start=1.0, tunable=True, doc="torque that the errors are weighed against")

    attitude_gain = CalculatedParameter(unit="N.m/rad", doc="gain of the rotation vector, k")
    rate_gain = CalculatedParameter(unit="N.m.s/rad", shape=(3, 3), doc="gain of the rate, K_d")

    def calculate(self, p: Any) -> dict[str, Any]:
        k = p.acceptable_torque / p.acceptable_error  # (8)
        square = (p.acceptable_torque / p.acceptable_rate) ** 2 * ca.DM.eye(3) + 2 * k * p.J
        return {"attitude_gain": k, "rate_gain": square_root(square)}  # (9)

    def feedback(self, q_BR: Any, rate: Any, p: Any) -> Any:
        return -p.attitude_gain * quaternion.rotation_vector(q_BR) - p.rate_gain @ rate  # (6)

    def check(self, t: Any, x: Any, u: Any, p: Any) -> list[Condition]:
        acceptable = positive(self, p, "acceptable_error", "acceptable_rate", "acceptable_torque")
        return [*super().check(t, x, u, p), *acceptable]
