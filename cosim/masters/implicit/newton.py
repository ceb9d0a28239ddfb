"""The unknowns of a loop by Newton's method, with the Jacobian of an earlier step where it serves.

Sought is x with F(x) = x, where F steps the members of the loop with the unknowns x and returns what they then are.
With f = F(x) - x and J its Jacobian:

    J dx = -f,  x+ = x + dx                                                                               (1)
    J+ = J + f(x+) dx^T / dx^T dx                                                                         (2)

(2) is Broyden's update. |dx| is an estimate of the error of x, so x is accepted where it is below the tolerance, and
the components stand at the end of the step already. The size of a change is measured by the value it changes, of a
slope by what it changes over the step: |dx_i| / w_i and h |dx'_i| / w_i, w_i = nominal_i + |x_i|.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from cosim.arrays import FloatArray
from cosim.masters import curves
from cosim.masters.curves import Ends
from cosim.masters.implicit.linear import broyden, solve
from cosim.masters.implicit.plan import Loop, Memory

SLOW = 0.5
"""A change that is above this part of the one before it is a slow one."""
PATIENCE = 2
"""How many slow changes are taken before the Jacobian is made anew."""
MOST = 24
"""How many times a step is repeated at most, beside what a new Jacobian takes."""

Evaluate = Callable[[FloatArray], FloatArray]
"""F: from the unknowns to what they are after the members have stepped with them, from where the step began."""


@dataclass(frozen=True)
class Solved:
    """How a loop was solved: `size` of the last change; `known`: whether that is small enough."""

    known: bool
    size: float
    worst: int


def predict(loop: Loop, memory: Memory, now: FloatArray, h: float) -> FloatArray:
    """Return a guess of the unknowns at the end of a step of length h, from what they are `now` and were before.

    Values with slopes go on along the cubic through both points, others on the line through them.
    """
    x = now.copy()
    before = memory.step
    for i, j in enumerate(loop.partner.tolist()):
        slope = 0.0 if j < 0 or np.isnan(now[j]) else float(now[j])
        if j < 0:
            x[i] = now[i] + (now[i] - memory.before[i]) * h / before if before else now[i]
        elif not before or np.isnan(memory.before[j]) or np.isnan(now[j]):
            x[i], x[j] = now[i] + h * slope, slope
        else:
            ends = Ends(*(part[[k]] for part, k in ((memory.before, i), (now, i), (memory.before, j), (now, j))))
            value, rate = curves.at(ends, before, before + h)
            x[i], x[j] = value[0], rate[0]
    return x


def weight(loop: Loop, x: FloatArray) -> FloatArray:
    """Return by what the changes of unknowns are measured."""
    return loop.nominal + np.abs(x[loop.value])


def size(loop: Loop, change: FloatArray, x: FloatArray, h: float) -> tuple[float, int]:
    """Return the largest part of a change, and the place of its unknown; NaN is the largest of all."""
    parts = np.where(loop.slope, h, 1.0) * np.abs(change) / weight(loop, x)
    worst = int(np.argmax(parts))
    return float(parts[worst]), worst


def find(
    loop: Loop,
    memory: Memory,
    now: FloatArray,
    h: float,
    tolerance: float,
    evaluate: Evaluate,
    renewals: Sequence[Callable[[FloatArray, FloatArray], FloatArray]] = (),
) -> Solved:
    """Find the unknowns; on success the components stand at the end of the step, and the memory has learned from it.

    `now`: the unknowns at the start. Each of `renewals`, of x and F(x), returns a new Jacobian, and is called in its
    turn where the one at hand does not serve; after the last of them the step is given up.
    """
    jacobian = memory.jacobian.copy() if memory.known else None
    x, change, last, slow = predict(loop, memory, now, h), None, np.inf, 0
    found, worst, left = np.inf, 0, list(renewals)
    for _ in range(MOST):
        residual = evaluate(x) - x
        if not np.isfinite(residual).all():
            return Solved(False, np.inf, int(np.argmax(~np.isfinite(residual))))
        if jacobian is not None and change is not None:
            jacobian = broyden(jacobian, residual, change)  # (2)
        change = None if jacobian is None else solve(jacobian, -residual)  # (1)
        if change is not None:
            found, worst = size(loop, change, x, h)
            if jacobian is not None and found <= tolerance:
                memory.learn(h, now, jacobian)
                return Solved(True, found, worst)
            slow += found > SLOW * last
            last = found
        while change is None or slow >= PATIENCE:
            if not left:
                return Solved(False, found, worst)
            jacobian, slow, last = left.pop(0)(x, residual + x), 0, np.inf
            change = solve(jacobian, -residual)
        x = x + change
    return Solved(False, found, worst)
