"""Reference attitude of a spacecraft that points to the Earth: the orbit frame (LVLH) of a circular orbit.

    R: x along the velocity, y opposite to the orbit normal, z to nadir
    q_RN = q_y(-(n t + phase))                                                                    (1)
    omega_RN_R = (0, -n, 0),  omega_RN_R' = 0                                                     (2)

Frames: R reference, the orbit frame; N inertial, the orbit frame at the phase 0, so that y_N is opposite to the orbit
normal. Symbols: n orbit_rate.
Source: B. Xiao, Q. Hu, G. Ma, Adaptive L2-gain controller for flexible spacecraft attitude tracking, Control Theory &
Applications 28(1), 2011, section 2.
Invariants: |q_RN| = 1, and its sign is continuous in time.
Limits: t is the simulation's time. For an orbit in other axes, or one that is no circle, see orbit_frame_from_state.py.
"""

from typing import Any

import casadi as ca

from ..framework import Component, Condition, Guidance, Parameter
from ..mathematics import gravity
from ..numbers import neutral


class OrbitFrame(Component):
    ports = Guidance

    orbit_rate = Parameter(
        unit="rad/s", start=neutral.ORBIT_RATE, nominal=1e-3, doc="rate of the orbit, about -y of the frame"
    )
    phase = Parameter(unit="rad", display_unit="deg", doc="angle along the orbit at t = 0")

    def outputs(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        half = (p.orbit_rate * t + p.phase) / 2
        return {
            "q_RN": ca.vertcat(ca.cos(half), 0, -ca.sin(half), 0),  # (1)
            "omega_RN_R": ca.vertcat(0, -p.orbit_rate, 0),  # (2)
            "omega_dot_RN_R": ca.SX.zeros(3),  # (2)
        }

    def check(self, t: Any, x: Any, u: Any, p: Any) -> list[Condition]:
        return gravity.orbit_conditions(self, p)
