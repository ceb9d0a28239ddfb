"""Gravity of an oblate Earth, inertial axes with z along its axis, and its difference between two near points.

    g(r) = -mu r / r^3 - c [r (1/r^5 - 5 z^2/r^7) + 2 z e_z / r^5],  c = 3/2 mu J2 R_E^2                  (1)
    g(r + s) - g(r) for the point mass, without cancellation (Battin):                                    (2)
        -mu/r^3 [s (1 + F) + r F],  1 + F = (1 + q)^(-3/2),  q = s . (2 r + s) / r^2,
        F = -q (3 + 3 q + q^2) / ((1 + q)^(3/2) (1 + (1 + q)^(3/2)))
    the same for J2 by its gradient, (dg/dr) s:                                                           (3)
        -c [s (1/r^5 - 5 z^2/r^7) + r (-5 d/r^7 - 10 z s_z/r^7 + 35 z^2 d/r^9) + 2 s_z e_z/r^5 - 10 z d e_z/r^7],
        d = r . s
    torque on a body of inertia J about its mass centre: 3 mu/r^5 r x J r                                 (4)
    perigee of the Kepler orbit through r with velocity v: |h|^2 / (mu (1 + |e|)),                        (5)
        h = r x v,  e = v x h / mu - r / |r|

Symbols: r from the Earth's centre, s the small separation, z and s_z their third components.
Source: (1), (4), (5) textbook; (2) R. H. Battin, An Introduction to the Mathematics and Methods of Astrodynamics, 1999,
Encke's method.
Invariants: (2), (3) are exactly zero at s = 0; without them two orbits differ by rounding of 1.5e-9 m.
Limits: (3) neglects terms of c s^2/r^6, some 1e-8 of it at s = 0.1 m. At r = 0 all are zero. (5) is without J2, which
moves the perigee of a low orbit by some km.
"""

from dataclasses import dataclass
from typing import Any

import casadi as ca

from ..framework import Component, Condition, positive
from ..numbers.earth import EARTH_RADIUS, MU

SURFACE_RATE = (MU / EARTH_RADIUS**3) ** 0.5  # rad/s, of a circular orbit at the surface; no planet has a faster one

E_Z = ca.DM([0, 0, 1])


@dataclass(frozen=True)
class Earth:
    """mu in m^3/s^2, J2, radius R_E in m."""

    mu: Any
    J2: Any
    radius: Any

    @property
    def c(self) -> Any:
        """Factor of the oblateness."""
        return 1.5 * self.mu * self.J2 * self.radius**2


def acceleration(earth: Earth, r: Any) -> Any:
    """Return g(r)."""
    r1, z = _length(r), r[2]
    oblate = r * (1 / r1**5 - 5 * z**2 / r1**7) + 2 * z * E_Z / r1**5
    return -earth.mu * r / r1**3 - earth.c * oblate  # (1)


def difference(earth: Earth, r: Any, s: Any) -> Any:
    """Return g(r + s) - g(r) for |s| << |r|."""
    r1, z, s_z, d = _length(r), r[2], s[2], ca.dot(r, s)
    q = ca.dot(s, 2 * r + s) / r1**2
    root = ca.sqrt(1 + q) ** 3
    F = -q * (3 + 3 * q + q**2) / (root * (1 + root))
    point = -earth.mu / r1**3 * (s * (1 + F) + r * F)  # (2)
    turned = r * (-5 * d / r1**7 - 10 * z * s_z / r1**7 + 35 * z**2 * d / r1**9)
    oblate = s * (1 / r1**5 - 5 * z**2 / r1**7) + turned + (2 * s_z / r1**5 - 10 * z * d / r1**7) * E_Z
    return point - earth.c * oblate  # (3)


def torque(mu: Any, r_B: Any, J: Any) -> Any:
    """Return the gravity gradient torque; r_B is the position in the axes of J."""
    return 3 * mu / _length(r_B) ** 5 * ca.cross(r_B, J @ r_B)  # (4)


def perigee(mu: Any, r: Any, v: Any) -> Any:
    """Return the distance of the perigee from the Earth's centre."""
    h = ca.cross(r, v)
    e = ca.cross(v, h) / mu - r / _length(r)
    return ca.sumsqr(h) / (mu * (1 + ca.norm_2(e)))  # (5)


def orbit_conditions(component: Component, p: Any) -> list[Condition]:
    """Return the conditions that a circular orbit of the rate `orbit_rate` is one, above the surface."""
    text = "orbit_rate = {} rad/s: the orbit is below the surface of the Earth, where a circle has {} rad/s."
    above = Condition(SURFACE_RATE - p.orbit_rate, text, (p.orbit_rate, SURFACE_RATE))
    return [*positive(component, p, "orbit_rate"), above]


def surface_condition(r_N: Any, earth_radius: Any, mu: Any = 1) -> Condition:
    """Return the condition that the position at the start is above the surface; none where mu = 0: no Earth."""
    text = "r_N is {} km from the Earth's centre at the start, earth_radius is {} km: the orbit is below the surface."
    r = ca.norm_2(r_N)
    return Condition(ca.if_else(mu > 0, r - earth_radius, 1), text, (r / 1e3, earth_radius / 1e3))


def perigee_condition(earth: Earth, r_N: Any, v_N: Any) -> Condition:
    """Return the condition that an orbit which starts above the surface stays there; none where mu = 0: no Earth."""
    text = (
        "perigee of r_N and v_N at the start is {} km from the Earth's centre, earth_radius is {} km: "
        "the orbit leads into the ground. Check v_N."
    )
    lowest = perigee(earth.mu, r_N, v_N)
    asked = ca.logic_and(earth.mu > 0, ca.norm_2(r_N) > earth.radius)
    margin = ca.if_else(asked, lowest - earth.radius, 1)
    return Condition(margin, text, (lowest / 1e3, earth.radius / 1e3))


def plane_condition(r_N: Any, v_N: Any) -> Condition:
    """Return the condition that position and velocity at the start span the plane of an orbit."""
    text = "r_N and v_N are parallel or zero at the start (|r_N| = {} m, |v_N| = {} m/s): they span no orbit plane."
    r, v = ca.norm_2(r_N), ca.norm_2(v_N)
    return Condition(ca.norm_2(ca.cross(r_N, v_N)) - 1e-6 * r * v, text, (r, v))


def _length(r: Any) -> Any:
    square = ca.dot(r, r)
    return ca.sqrt(ca.if_else(square > 0, square, 1))
