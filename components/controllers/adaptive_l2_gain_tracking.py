"""Adaptive L2-gain attitude tracking of angles that move in a frame of their own.

theta angles 3-2-1 from the frame O to the body, y_d those wanted, w_e = omega_BN_B - dcm_BO omega_ON_O:
    theta' = R^-1 w_e,  z1 = theta - y_d                                                          (6)
    z2 = theta' - f y_d' - alpha,  alpha' = -(k + 1/2) (theta' - f y_d') / T                      (7)
    u_adap = -f_hat + f y_d'' + alpha' - z1 / T^2 - p1 z2 / T                                     (18a)
f is `feedforward`, 1: the paper's law. Network, robust term, limit and adaptation are those of adaptive_l2_gain.py.

Frames: B body, R reference (wanted: dcm_RO has the angles y_d; it is for attitude_error only), O where the angles
start, in the paper the orbit frame; N inertial.
Source: B. Xiao, Q. Hu, G. Ma, Adaptive L2-gain controller for flexible spacecraft attitude tracking, Control Theory &
Applications 28(1), 2011, section 3, whose assumption 3 is that y_d' and y_d'' exist and are bounded. Its
own flight has y_d = 0.
Invariants: with f = 1 those of adaptive_l2_gain.py, z1 in place of theta.
Limits: those of adaptive_l2_gain.py; the network sees theta, not z1, so that its nodes must reach as far as y_d.
"""

from typing import Any

from ..framework import Condition, Input, Output, Parameter, flag_conditions
from ..framework.ports import NO_ROTATION
from ..vehicle import quaternion_condition
from .adaptive_l2_gain import AdaptiveL2Gain, Motion, angles_from


class AdaptiveL2GainTracking(AdaptiveL2Gain):
    feedforward = Parameter(unit="1", start=1.0, doc="1: y_d' and y_d'' in the law, 0: without them")

    q_ON = Input(unit="1", shape=(4,), start=NO_ROTATION, doc="attitude of the frame of the angles, scalar first")
    omega_ON_O = Input(unit="rad/s", shape=(3,), display_unit="deg/s", nominal=1e-3, doc="rate of that frame")
    y_d = Input(unit="rad", shape=(3,), display_unit="deg", nominal=1e-2, doc="roll, pitch, yaw wanted (Euler 3-2-1)")
    y_d_dot = Input(unit="rad/s", shape=(3,), display_unit="deg/s", nominal=1e-3, doc="derivative of y_d")
    y_d_ddot = Input(unit="rad/s2", shape=(3,), nominal=1e-4, doc="derivative of y_d'")

    z1 = Output(unit="rad", shape=(3,), display_unit="deg", nominal=1e-2, doc="error of roll, pitch, yaw")

    def motion(self, u: Any, p: Any) -> Motion:
        theta, theta_dot = angles_from(u.q_BN, u.omega_BN_B, u.q_ON, u.omega_ON_O)
        return Motion(theta, theta_dot, u.y_d, p.feedforward * u.y_d_dot, p.feedforward * u.y_d_ddot)  # (6), (7), (18a)

    def outputs(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return super().outputs(t, x, u, p) | {"z1": self._law(x, u, p).z1}

    def check(self, t: Any, x: Any, u: Any, p: Any) -> list[Condition]:
        return [
            *super().check(t, x, u, p),
            *flag_conditions(self, p, "feedforward"),
            quaternion_condition("q_ON", u.q_ON),
        ]
