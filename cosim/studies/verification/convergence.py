"""The order of an exchange and the error of a flight, from the same flight at three steps, each half the one before.

With y_1, y_2, y_3 the flights at h, h/2, h/4, on the rows that all have, |.| the largest over rows and elements:
    D_1 = |y_1 - y_2|,   D_2 = |y_2 - y_3|                                                         (1)
    p = log2(D_1 / D_2)                                                                            (2)
    |y_1 - y| = D_1 / (1 - 2^-p),   y the flight at vanishing steps                                (3)
(2) and (3) follow from an error c h^p. An attitude quaternion is compared as an angle, q and -q are one attitude:
    angle = 2 atan2(|v|, |w|),   (w, v) = q_1* (x) q_2                                             (4)

Limits: (3) sees the error of the exchange and of what shrinks with the communication step, not that of an internal
step that stays (`solver.step`). Where the flight is not smooth (a switch, a limit, an event), p is what it is.
"""

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce
from itertools import pairwise

import numpy as np

from cosim.arrays import FloatArray
from cosim.results.result import Result
from fmus.description.names import element, split_port

LEAST_ORDER = 0.5
"""Differences that shrink by less, 2^0.5, at half the step tell neither an order nor an error."""

_QUATERNION = re.compile(r"q_[A-Z]{2}")
"""Names of attitude quaternions: of one frame in another, scalar first."""


@dataclass(frozen=True)
class Convergence:
    """One variable: the largest differences (1), the order (2), the error (3) of the coarsest flight, in `unit`.

    `largest`: of its values, the finest flight's. `where`: the element with the largest difference, "" of a scalar or
    an attitude. `fine` is None where two flights are there, `order` and `error` where they cannot be told: `remark`.
    """

    variable: str
    unit: str
    largest: float
    where: str
    coarse: float
    fine: float | None
    order: float | None
    error: float | None
    remark: str = ""


def converge(runs: Sequence[Result], names: Sequence[str], steps: int, tolerance: float = 0.0) -> list[Convergence]:
    """Compare two or three flights, the coarsest first, variable by variable.

    `steps`: how many the finest flight took, for the rounding. `tolerance`: relative, of what is iterated.
    """
    shared = reduce(np.intersect1d, [run.time for run in runs])
    rows = [np.searchsorted(run.time, shared) for run in runs]
    rounding = np.finfo(float).eps * math.sqrt(steps)  # of a value of 1 in every step, at random
    found: list[Convergence] = []
    for name in names:
        values = [np.asarray(run[name][at], dtype=np.float64) for run, at in zip(runs, rows, strict=True)]
        found.append(_of(name, runs[-1].units.get(name) or "", values, rounding, tolerance))
    return found


def _of(name: str, unit: str, values: Sequence[FloatArray], rounding: float, tolerance: float) -> Convergence:
    if is_attitude(name, values[0].shape):
        differences = [np.degrees(angle(a, b)) for a, b in pairwise(values)]
        unit, largest, scale = "deg", math.nan, math.degrees(2.0)
    else:
        differences = [np.abs(a - b) for a, b in pairwise(values)]
        largest = scale = float(np.max(np.abs(values[-1]), initial=0.0))
    coarse, fine = float(np.max(differences[0], initial=0.0)), None
    if len(differences) > 1:
        fine = float(np.max(differences[1], initial=0.0))
    order, remark = _order(coarse, fine, scale * rounding, scale * tolerance)
    error = coarse / (1 - 2**-order) if order is not None else None  # (3)
    return Convergence(name, unit, largest, _where(name, differences[0]), coarse, fine, order, error, remark)


def _order(coarse: float, fine: float | None, rounding: float, tolerance: float) -> tuple[float | None, str]:
    """Return the order (2), or why there is none or a doubtful one."""
    if fine is None:
        return None, "two flights tell a difference, no order"
    if not (math.isfinite(coarse) and math.isfinite(fine)):
        return None, "not finite"
    if max(coarse, fine) == 0.0:
        return None, "the same to the last bit"
    if fine <= rounding:
        return None, "at rounding"
    order = math.log2(coarse / fine) if coarse > 0.0 else -math.inf  # (2)
    iterated = fine <= tolerance  # of what is exchanged, which a plant may feel less
    if order < LEAST_ORDER:
        return None, "at the tolerance of the iteration" if iterated else "the differences hardly shrink with the step"
    return order, "below the tolerance of the iteration" if iterated else ""


def is_attitude(name: str, shape: tuple[int, ...]) -> bool:
    """Whether rows of a variable, shape (n, ...), are attitude quaternions."""
    return shape[1:] == (4,) and _QUATERNION.fullmatch(split_port(name)[1]) is not None


def angle(q: FloatArray, r: FloatArray) -> FloatArray:
    """Return the angles (4) between two attitudes, rad, shape (n,); q, r: scalar first, shape (n, 4)."""
    w = np.sum(q * r, axis=1)
    v = q[:, :1] * r[:, 1:] - r[:, :1] * q[:, 1:] - np.cross(q[:, 1:], r[:, 1:])
    return 2 * np.arctan2(np.linalg.norm(v, axis=1), np.abs(w))


def _where(name: str, difference: FloatArray) -> str:
    """Return the element with the largest difference, "" of a scalar or an attitude."""
    if difference.ndim < 2 or not difference.size:
        return ""
    at = np.unravel_index(int(np.argmax(difference)), difference.shape)[1:]
    return element(name, [int(i) + 1 for i in at])
