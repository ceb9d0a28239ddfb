"""Rest-to-rest turn of the reference about a fixed axis, within a rate and an acceleration.

Bang-bang: full acceleration, coasting at the largest rate where it is reached, full deceleration, with
    v = min(max_rate, sqrt(angle max_acceleration)),  t_a = v / max_acceleration,  T = angle / v + t_a      (1)
    a = max_acceleration tau^2 / 2;  v (tau - t_a / 2);  angle - max_acceleration (T - tau)^2 / 2           (2)
for tau, the time since start_time, up to t_a, up to T - t_a, up to T. Smooth: acceleration a sine, zero at both ends,
    T = max(2 angle / max_rate, sqrt(2 pi angle / max_acceleration))                                        (3)
    a = angle (tau / T - sin(2 pi tau / T) / (2 pi))                                                        (4)
    q_RN = q_start (x) [cos(a/2); sin(a/2) axis],  omega_RN_R = a' axis,  omega_RN_R' = a'' axis            (5)

Frames: R reference, N inertial; the axis in R, where it is fixed as in N.
Source: none needed: the time-optimal turn of a double integrator with bounded rate, and a versine of the rate.
Invariants: |q_RN| = 1; at rest before start_time and from start_time + T on; rate and acceleration within their limits.
Limits: bang-bang excites what is elastic. t is the simulation's time. A negative turn has the opposite axis.
"""

from typing import Any

import casadi as ca

from ..framework import Component, Condition, Guidance, Output, Parameter, flag_conditions
from ..framework.ports import NO_ROTATION
from ..mathematics import quaternion
from ..vehicle import DEGREE

LEAST = 1e-12  # rad: an angle below it takes the time of this one, so that T and its derivative are finite


class Slew(Component):
    ports = Guidance

    q_start = Parameter(
        unit="1", shape=(4,), start=NO_ROTATION, unit_length=True, doc="attitude before the turn, scalar first"
    )
    axis = Parameter(unit="1", shape=(3,), start=(0, 1, 0), unit_length=True, doc="axis of the turn, unit vector in R")
    angle = Parameter(unit="rad", display_unit="deg", doc="angle of the turn")
    start_time = Parameter(unit="s", doc="time at which the turn begins")
    max_rate = Parameter(unit="rad/s", start=DEGREE, display_unit="deg/s", doc="largest rate")
    max_acceleration = Parameter(unit="rad/s2", start=0.1 * DEGREE, display_unit="deg/s2", doc="largest acceleration")
    smooth = Parameter(unit="1", start=1.0, doc="1: acceleration a sine, 0: bang-bang")

    remaining = Output(unit="s", doc="time until the reference is at rest for good")

    def outputs(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        bang, soft = self._bang_bang(t - p.start_time, p), self._smooth(t - p.start_time, p)
        duration, a, a_dot, a_ddot = (ca.if_else(p.smooth > 0.5, s, b) for s, b in zip(soft, bang, strict=True))
        return {
            "q_RN": quaternion.product(p.q_start, quaternion.about(p.axis, a)),  # (5)
            "omega_RN_R": a_dot * p.axis,  # (5)
            "omega_dot_RN_R": a_ddot * p.axis,  # (5)
            "remaining": ca.fmax(p.start_time + duration - t, 0),
        }

    def check(self, t: Any, x: Any, u: Any, p: Any) -> list[Condition]:
        conditions = flag_conditions(self, p, "smooth")
        for name, unit in (("max_rate", "deg/s"), ("max_acceleration", "deg/s2")):
            value = vars(p)[name]
            conditions.append(Condition(value, f"{name} = {{}} {unit}: it must be positive.", (value / DEGREE,)))
        text = "angle = {} deg: it must not be negative. Turn about the opposite axis."
        return [*conditions, Condition(p.angle >= 0, text, (p.angle / DEGREE,))]

    def _bang_bang(self, since: Any, p: Any) -> tuple[Any, Any, Any, Any]:
        """Return T, and a with its two derivatives."""
        limit = p.max_acceleration
        turn = ca.fmax(p.angle, LEAST)
        v = ca.fmin(p.max_rate, ca.sqrt(turn * limit))
        t_a, T = v / limit, turn / v + v / limit  # (1)
        tau = ca.fmax(0, ca.fmin(since, T))
        first, last = tau < t_a, tau > T - t_a
        a = ca.if_else(
            first, limit * tau**2 / 2, ca.if_else(last, p.angle - limit * (T - tau) ** 2 / 2, v * (tau - t_a / 2))
        )  # (2)
        a_dot = ca.if_else(first, limit * tau, ca.if_else(last, limit * (T - tau), v))
        moving = ca.logic_and(since >= 0, since < T)
        return T, a, a_dot, ca.if_else(moving, ca.if_else(first, limit, ca.if_else(last, -limit, 0)), 0)

    def _smooth(self, since: Any, p: Any) -> tuple[Any, Any, Any, Any]:
        """Return T, and a with its two derivatives."""
        turn = ca.fmax(p.angle, LEAST)
        T = ca.fmax(2 * turn / p.max_rate, ca.sqrt(2 * ca.pi * turn / p.max_acceleration))  # (3)
        phase = 2 * ca.pi * ca.fmax(0, ca.fmin(since / T, 1))
        a = p.angle * (phase - ca.sin(phase)) / (2 * ca.pi)  # (4)
        return T, a, p.angle / T * (1 - ca.cos(phase)), 2 * ca.pi * p.angle / T**2 * ca.sin(phase)
