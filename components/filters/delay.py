"""Delay by whole samples, or by a time between them; sampled, as computers and buses delay.

    at a sample the ring moves on by one: r_n, ..., r_1 are r_j of before, j one less, and r_0 = u (1)
    y = sum_i r_i max(0, 1 - |d/T - i|), over i = 1 ... n: the line between samples               (2)
    d = delay, or n T where that is 0: y = r_n                                                    (3)
    at the start: r_i = u                                                                         (4)

Symbols: n samples, T sample_time. `Delay:samples=0` is sample and hold.
Source: none needed; (1)-(4) are numbers of this file.
Invariants: between samples y is held; at a sample it is u of n samples before. With n > 0 no output follows its input
directly: a delay opens an algebraic loop, but at the start, where (4) is solved with the loop.
Limits: a delay that is no whole number of samples is a straight line between two, which takes out what is fast; the
elements of a quaternion on it are not normalised. Before the first n samples u counts as what it was at the start.
"""

from typing import Any

import casadi as ca

from ..framework import Condition, Parameter, State, not_negative
from ..numbers import neutral
from .filter import Filter


class Delay(Filter):
    sample_time = neutral.SAMPLE
    samples: int = 1  # structural: how many samples the ring holds beside the newest

    delay = Parameter(
        unit="s", tunable=True, doc="time by which y is late, from one sample to all; 0: all samples of the ring"
    )

    newest = State(unit="unit", shape=("width",), calculated=True, doc="r_0, u at the last sample")
    ring = State(unit="unit", shape=("samples", "width"), calculated=True, doc="r_1 ... r_n, a row a sample")

    def initial(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"newest": u.u, "ring": ca.repmat(u.u.T, self.samples, 1)}  # (4)

    def update(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"newest": u.u, "ring": ca.vertcat(x.newest.T, x.ring)[: self.samples, :]}  # (1)

    def outputs(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        if not self.samples:
            return {"y": x.newest}
        late = ca.if_else(p.delay > 0, p.delay / p.sample_time, self.samples)  # (3)
        weights = ca.vertcat(*(ca.fmax(0, 1 - ca.fabs(late - i)) for i in range(1, self.samples + 1)))
        return {"y": x.ring.T @ weights}  # (2)

    def check(self, t: Any, x: Any, u: Any, p: Any) -> list[Condition]:
        longest = self.samples * p.sample_time
        text = (
            "delay = {} s: it must be 0, or from one to all samples, {} s to {} s. Take more, as in "
            f"Delay:samples={max(2 * self.samples, 1)}, or another sample_time."
        )
        rounding = 1e-9 * p.sample_time
        fits = ca.logic_and(p.delay >= p.sample_time - rounding, p.delay <= longest + rounding)
        within = ca.logic_or(p.delay == 0, fits)
        return [*not_negative(self, p, "delay"), Condition(within, text, (p.delay, p.sample_time, longest))]
