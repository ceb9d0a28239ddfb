"""Rate limiter: a signal that moves by no more than its rate allows, sample by sample.

    y = min(max(u, y_0 - rate T), y_0 + rate T)                                                   (1)
    at the start: y = u                                                                           (2)

Symbols: y_0 what y was before the sample, T sample_time.
Source: none needed; (1), (2) are numbers of this file.
Invariants: |y - y_0| <= rate T; an input that is slower passes unchanged; a step of size d takes d/rate.
Limits: one rate for both ways; y is held between samples.
"""

from typing import Any

from ..framework import Condition, Parameter, State, positive
from ..mathematics.limits import within
from ..numbers import neutral
from .filter import Filter


class RateLimiter(Filter):
    sample_time = neutral.SAMPLE

    rate = Parameter(
        unit="unit/s", shape=("width",), start=neutral.NO_LIMIT, tunable=True, doc="fastest change; 1e9: no limit"
    )

    last = State(unit="unit", shape=("width",), calculated=True, doc="y since the last sample")

    def initial(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"last": u.u}  # (2)

    def update(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        farthest = p.rate * p.sample_time
        return {"last": within(u.u, x.last - farthest, x.last + farthest)}  # (1)

    def outputs(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"y": x.last}

    def check(self, t: Any, x: Any, u: Any, p: Any) -> list[Condition]:
        return positive(self, p, "rate")
