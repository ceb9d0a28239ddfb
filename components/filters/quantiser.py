"""Quantiser: a signal in whole numbers of a quantum, as a converter of finitely many bits has it.

    y = q floor(u/q + 1/2)                                                                        (1)
    q = 0: y = u                                                                                  (2)

Symbols: q quantum; a converter of n bits over -r..r has q = 2 r / 2^n.
Source: none needed; (1), (2) are numbers of this file.
Invariants: |y - u| <= q/2, and y is a whole number of q.
Limits: no range (put `Saturation` before it), no samples of its own (`Delay:samples=0`), halves go up. y jumps where u
passes from one quantum to the next; what reads it is told so at communication points.
"""

from typing import Any

import casadi as ca

from ..framework import Condition, Parameter, not_negative
from ..mathematics.slewing import quanta
from .filter import Filter


class Quantiser(Filter):
    quantum = Parameter(unit="unit", shape=("width",), tunable=True, doc="step of the values that y can have; 0: any")

    def outputs(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        some = p.quantum > 0
        y = p.quantum * quanta(u.u, ca.if_else(some, p.quantum, 1))  # (1)
        return {"y": ca.if_else(some, y, u.u)}  # (2)

    def check(self, t: Any, x: Any, u: Any, p: Any) -> list[Condition]:
        return not_negative(self, p, "quantum")
