"""Saturation: a signal within its limits, element by element or with its direction kept.

    y = min(max(u, -limit), limit)                                                                (1)
    keep_direction = 1: y = u min(1, min_i limit_i / |u_i|)                                       (2)

Symbols: i elements.
Source: none needed; (1), (2) are numbers of this file.
Invariants: |y_i| <= limit_i; what is within its limits passes unchanged; by (2) y is parallel to u.
Limits: symmetric limits.
"""

from typing import Any

import casadi as ca

from ..framework import Condition, Output, Parameter, flag_conditions, positive
from ..mathematics.allocation import limited
from ..mathematics.limits import saturated
from ..numbers import neutral
from .filter import Filter


class Saturation(Filter):
    limit = Parameter(
        unit="unit", shape=("width",), start=neutral.NO_LIMIT, tunable=True, doc="largest size of an element; 1e9: none"
    )
    keep_direction = Parameter(unit="1", tunable=True, doc="1: all elements are shortened alike, 0: each by itself")

    saturated = Output(unit="1", doc="number of elements of u beyond their limits")

    def outputs(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        y = ca.if_else(p.keep_direction > 0.5, limited(u.u, p.limit), saturated(u.u, p.limit))  # (1), (2)
        return {"y": y, "saturated": ca.sum1(ca.fabs(u.u) > p.limit)}

    def check(self, t: Any, x: Any, u: Any, p: Any) -> list[Condition]:
        return [*positive(self, p, "limit"), *flag_conditions(self, p, "keep_direction")]
