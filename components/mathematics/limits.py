"""Limits: saturation of a command, and a quantity that stops at its limit.

    within(v) = min(max(v, lower), upper), sat(v) = within -limit, limit, element by element      (1)
    v' = 0 where v is at its limit and its rate points outward, else the rate                     (2)
    v' = 0 where v is at its floor and its rate points downward, else the rate                    (3)

Symbols: v a column, limit a scalar or a column of its size, not negative; lower <= upper likewise.
Source: none needed; (3) is the projection of an adaptive law onto v >= floor.
Limits: (2), (3) jump; an integrator passes the limit by at most one internal step's growth.
"""

from typing import Any

import casadi as ca


def within(v: Any, lower: Any, upper: Any) -> Any:
    """Return v, or the limit that it is beyond."""
    return ca.fmin(ca.fmax(v, lower), upper)  # (1)


def saturated(v: Any, limit: Any) -> Any:
    """Return v within -limit to limit."""
    return within(v, -limit, limit)  # (1)


def stopped(v: Any, rate: Any, limit: Any) -> Any:
    """Return the rate of v, none that leads out of -limit to limit."""
    outward = ca.logic_or(ca.logic_and(v >= limit, rate > 0), ca.logic_and(v <= -limit, rate < 0))
    return ca.if_else(outward, 0, rate)  # (2)


def floored(v: Any, rate: Any, floor: Any) -> Any:
    """Return the rate of v, none that leads below the floor."""
    return ca.if_else(ca.logic_and(v <= floor, rate < 0), 0, rate)  # (3)
