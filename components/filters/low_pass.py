"""First-order low-pass filter, a lag.

    y' = W (u - y)                                                                                (1)
    at the start: y = u                                                                           (2)

Symbols: W bandwidth, where the gain is 1/sqrt(2); 1/W is the lag's time constant.
Source: textbook; (1), (2) are numbers of this file.
Invariants: a constant passes unchanged; y stays between the extremes of u.
Limits: a single pole. Internal steps are to be short against 1/W.
"""

from typing import Any

from ..framework import Condition, Parameter, State, positive
from .filter import Filter


class LowPass(Filter):
    bandwidth = Parameter(
        unit="rad/s", shape=("width",), start=10.0, display_unit="Hz", tunable=True, doc="bandwidth; 1/time constant"
    )

    y = State(unit="unit", shape=("width",), output=True, calculated=True, doc="what goes out")

    def initial(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"y": u.u}  # (2)

    def derivatives(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"y": p.bandwidth * (u.u - x.y)}  # (1)

    def check(self, t: Any, x: Any, u: Any, p: Any) -> list[Condition]:
        return positive(self, p, "bandwidth")
