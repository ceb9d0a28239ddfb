"""The curve of an input over a step: the cubic through both ends with the source's slopes there (Hermite).

With a and b the values, a' and b' the slopes, h the length of the step, s the time since its start:

    u(s) = a + a' s + c s^2 / 2 + d s^3 / 6
    c = (6 (b - a) / h - 4 a' - 2 b') / h                                                                 (1)
    d = (12 (a - b) / h + 6 (a' + b')) / h^2                                                              (2)
    mean = (a + b) / 2 + h (a' - b') / 12                                                                 (3)

A ramp is the curve with a' = b' = (b - a) / h. The kernel has the same in C (curves.h), operation by operation.
"""

from math import isfinite
from typing import NamedTuple

import numpy as np

from cosim.arrays import FloatArray

_2, _4, _6, _12 = (np.array(float(n)) for n in (2, 4, 6, 12))  # by which NumPy multiplies twice as fast as by numbers

Number = float | FloatArray
"""A number, or an array of no dimension: what curves of arrays divide by faster."""


class Ends(NamedTuple):
    """Values and slopes of some inputs' sources at both ends of a step, each of shape (n,)."""

    a: FloatArray
    b: FloatArray
    da: FloatArray
    db: FloatArray

    def known(self, h: Number) -> "Ends":
        """Return the same with the line in place of slopes that are not known (NaN)."""
        if surely_known(self.da) and surely_known(self.db):
            return self
        line = (self.b - self.a) / h
        unknown = np.isnan(self.da) | np.isnan(self.db)
        return Ends(self.a, self.b, np.where(unknown, line, self.da), np.where(unknown, line, self.db))


def surely_known(slopes: FloatArray) -> bool:
    """Whether no slope is NaN, for their sum is finite; that of large ones may not be, where all are known."""
    return isfinite(sum(slopes.data))


def second(ends: Ends, h: Number) -> FloatArray:
    """Return the second derivative of the curves at the start."""
    return (_6 * (ends.b - ends.a) / h - _4 * ends.da - _2 * ends.db) / h  # (1)


def third(ends: Ends, h: Number) -> FloatArray:
    """Return the third derivative of the curves."""
    return (_12 * (ends.a - ends.b) / h + _6 * (ends.da + ends.db)) / (h * h)  # (2)


def mean(ends: Ends, h: Number) -> FloatArray:
    """Return the mean of the curves over the step."""
    return 0.5 * (ends.a + ends.b) + h * (ends.da - ends.db) / 12  # (3)


def at(ends: Ends, h: Number, s: float) -> tuple[FloatArray, FloatArray]:
    """Return values and slopes of the curves at s."""
    c, d = second(ends, h), third(ends, h)
    return ends.a + s * (ends.da + s * (c + s * d / 3) / 2), ends.da + s * (c + s * d / 2)
