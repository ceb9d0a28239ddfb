"""Gravity gradient torque on a rigid body on a circular orbit.

    c = dcm_BN (-sin a, 0, cos a),  a = n t + phase: direction to nadir, in B                     (1)
    d = 3 n^2 c x J c                                                                             (2)

Symbols: n orbit_rate, d tau_dist_B. Frames: B body; N inertial, y_N opposite to the orbit normal, z_N to nadir at the
phase 0, as in guidance/orbit_frame.py: give both the same rate and phase.
Source: textbook (e.g. P. C. Hughes, Spacecraft Attitude Dynamics, 1986, chapter 8); n^2 = mu / r^3 on a circle.
Invariants: none about nadir, c . d = 0; zero where a principal axis points to nadir.
Limits: inertia of the undeformed body, spherical Earth; t is the simulation's time.
"""

from typing import Any

import casadi as ca

from .. import vehicle
from ..framework import Component, Condition, Environment, Input, Parameter
from ..mathematics import gravity, quaternion
from ..numbers import neutral


class GravityGradient(Component):
    ports = Environment

    J = vehicle.J
    orbit_rate = Parameter(unit="rad/s", start=neutral.ORBIT_RATE, nominal=1e-3, doc="rate of the orbit, about -y_N")
    phase = Parameter(unit="rad", display_unit="deg", doc="angle along the orbit at t = 0")

    q_BN = Input(unit="1", shape=(4,), start=(1.0, 0.0, 0.0, 0.0), doc="attitude of the body, scalar first")

    def outputs(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        angle = p.orbit_rate * t + p.phase
        c = quaternion.dcm(u.q_BN) @ ca.vertcat(-ca.sin(angle), 0, ca.cos(angle))  # (1)
        return {"tau_dist_B": 3 * p.orbit_rate**2 * ca.cross(c, p.J @ c)}  # (2)

    def check(self, t: Any, x: Any, u: Any, p: Any) -> list[Condition]:
        return [
            *vehicle.inertia_conditions(p.J),
            *gravity.orbit_conditions(self, p),
            vehicle.quaternion_condition("q_BN", u.q_BN),
        ]
