"""Reference attitude of a spacecraft that points to the Earth: the orbit frame (LVLH) of its position and velocity.

    z_R = -r / |r|,  y_R = -h / |h|,  x_R = y_R x z_R,  h = r x v;  rows of dcm_RN                (1)
    omega_RN_R = dcm_RN [h / r^2 + r (g . h) / |h|^2], g the acceleration by gravity              (2)
    omega_RN_R' = (0, 2 |h| (r . v) / r^4, 0)                                                     (3)
    q_RN from dcm_RN: the scalar part not negative                                                (4)

Frames: R reference, the orbit frame: x along the velocity on a circle, y opposite to the orbit normal, z to nadir; N
inertial. Symbols: r r_N, v v_N.
Source: kinematics of a motion in a plane, textbook; (4) is J. Stuelpnagel's relation of elements, taken at the largest.
Invariants: |q_RN| = 1.
Limits: (2) has what gravity with J2 does to the plane of the orbit (J2 = 0: nothing), not what drag and thrust do; (3)
takes plane and h as constant, exact on any Kepler orbit, off by 1e-9 rad/s2 for J2. q_RN changes its sign at half a
turn: controllers take q and -q as one.
"""

from typing import Any

import casadi as ca

from ..framework import Component, Condition, Guidance, Input, Parameter, not_negative, positive
from ..mathematics import gravity, quaternion
from ..numbers import earth, neutral


class OrbitFrameFromState(Component):
    ports = Guidance

    mu = Parameter(unit="m3/s2", start=earth.MU, doc="gravitational parameter of the Earth")
    J2 = Parameter(unit="1", start=earth.J2, doc="oblateness of the Earth; 0: the plane of the orbit is fixed")
    earth_radius = Parameter(unit="m", start=earth.EARTH_RADIUS, doc="radius of the Earth")

    r_N = Input(unit="m", shape=(3,), start=(neutral.ORBIT_RADIUS, 0, 0), nominal=7e6, doc="position from the centre")
    v_N = Input(unit="m/s", shape=(3,), start=(0, neutral.ORBIT_SPEED, 0), nominal=7e3, doc="inertial velocity")

    def outputs(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        r2, h = ca.sumsqr(u.r_N), ca.cross(u.r_N, u.v_N)
        z, y = -u.r_N / ca.sqrt(r2), -h / ca.norm_2(h)
        dcm_RN = ca.vertcat(ca.cross(y, z).T, y.T, z.T)  # (1)
        rate = ca.norm_2(h) / r2
        g = gravity.acceleration(gravity.Earth(p.mu, p.J2, p.earth_radius), u.r_N)
        turn = -ca.sqrt(r2) * ca.dot(g, h) / ca.sumsqr(h)
        return {
            "q_RN": quaternion.from_dcm(dcm_RN),  # (4)
            "omega_RN_R": ca.vertcat(0, -rate, turn),  # (2)
            "omega_dot_RN_R": ca.vertcat(0, 2 * rate * ca.dot(u.r_N, u.v_N) / r2, 0),  # (3)
        }

    def check(self, t: Any, x: Any, u: Any, p: Any) -> list[Condition]:
        return [
            *positive(self, p, "earth_radius"),
            *not_negative(self, p, "mu"),
            gravity.plane_condition(u.r_N, u.v_N),
            gravity.surface_condition(u.r_N, p.earth_radius),
        ]
