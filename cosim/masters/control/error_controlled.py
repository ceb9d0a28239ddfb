"""Steps as long as their errors allow, by a PI control of them (Gustafsson).

With r the largest part that an error has of what is allowed, r_- that of the step before, h the length of the step:

    h+ = h (S / r)^(0.3 / k) (r_- / r)^(0.4 / k)    after a step that counts                              (1)
    h+ = h (S / r)^(1 / k)                          after one that does not, and after the first          (2)

The error goes as h^k: k = 3 for every estimate that there is (implicit/estimating.py), since the weaker of the two
solutions that it compares is of order 2. h+ / h is kept within `LEAST` and `MOST`. A step counts where r <= 1.

Source: K. Gustafsson, Control theoretic techniques for stepsize selection in explicit Runge-Kutta methods, ACM
Transactions on Mathematical Software 17 (1991) 533-554; gains and (2) as in E. Hairer, G. Wanner, Solving Ordinary
Differential Equations II (1996), section IV.2.
Limits: lengths are whole numbers of the schedule's points.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from cosim.arrays import FloatArray
from cosim.errors import StepFailed, ToleranceMissed
from cosim.masters.master import Outcome
from cosim.masters.point import Point
from cosim.time import Schedule

ORDER = 3
"""k, the power of the step with which the estimated error goes."""

INTEGRAL, PROPORTIONAL = 0.3 / ORDER, 0.4 / ORDER
SAFETY = 0.7
"""S: the part of the allowed error that is aimed at."""

LEAST, MOST = 0.2, 5.0
"""How much longer a step may be than the one before."""

SMALLEST = 1e-4
"""r, at least: of an error near zero nothing is to be concluded but that the step may grow."""


@dataclass(frozen=True)
class Pace:
    """What the next step is judged by, the first numbers of `Point.memory`: a view of them.

    Length of the last step, in points; r of it; r of the one before it. Zeros: there was none.
    """

    array: FloatArray

    SIZE = 3

    def next(self, step: int, error: float) -> tuple[float, float, float]:
        """Return these numbers after one more step."""
        return float(step), max(error, SMALLEST), float(self.array[1])

    def wish(self) -> float | None:
        """Return the length of the next step, in points; None where there was none before."""
        step, error, before = self.array.tolist() if len(self.array) else (0.0, 0.0, 0.0)
        if not step:
            return None
        if not before:
            return step * limited((SAFETY / error) ** (1 / ORDER))  # (2)
        return step * limited((SAFETY / error) ** INTEGRAL * (before / error) ** PROPORTIONAL)  # (1)


def limited(factor: float) -> float:
    """Return a factor within its limits."""
    return min(max(factor, LEAST), MOST)


class ErrorControlled:
    """Chooses each step by the errors of those before; see the module's equations.

    `least`, `largest`, `first`: lengths in points. No step passes a multiple of one of `landings`, points.
    """

    def __init__(self, schedule: Schedule, least: int, largest: int, first: int, landings: tuple[int, ...]) -> None:
        self.schedule, self.least, self.largest, self.first = schedule, least, largest, first
        self.landings = landings
        self._at = self._tried = 0
        self._shorter: int | None = None
        self._accepted = self._rejected = 0
        self._taken: list[float] = []

    def until(self, point: Point, last: int, *, far: bool) -> int:
        """Return the end of the next step; the last two before a landing are of one size."""
        wish = self._shorter or Pace(point.memory[: Pace.SIZE]).wish() or self.first
        step = int(min(max(wish, self.least), self.largest))
        room = min(last - point.index, *(n - point.index % n for n in self.landings))
        if step < room < 2 * step and room >= 2 * self.least:
            step = -(-room // 2)
        self._at, self._tried = point.index, min(step, room)
        return self._at + self._tried

    def accepts(self, outcome: Outcome) -> bool:
        """Whether a step counts. Raises `StepFailed` where the least step does not."""
        size = outcome.deviation.size if outcome.deviation else 0.0
        if outcome.failure is None and size <= 1:
            self._accepted += 1
            self._shorter = None
            seconds = self.schedule.time(self._at + self._tried) - self.schedule.time(self._at)
            self._taken = [min([seconds, *self._taken]), max([seconds, *self._taken])]
            return True
        if self._tried <= self.least:
            raise outcome.failure or self._missed(outcome)
        factor = LEAST if outcome.failure else limited((SAFETY / size) ** (1 / ORDER))  # (2)
        self._shorter = max(self.least, int(self._tried * factor))
        self._rejected += 1
        return False

    def told(self) -> Mapping[str, Any]:
        """Return how many steps there were, and the shortest and the longest that counted, s."""
        smallest, largest = self._taken or (None, None)
        steps = {"accepted": self._accepted, "rejected": self._rejected, "smallest": smallest, "largest": largest}
        return {"steps": steps}

    def memory(self) -> Any:
        """Return what `told` tells of the steps; what the next one is judged by is in the point's memory (`Pace`)."""
        return [self._accepted, self._rejected, self._taken, self._shorter]

    def recall(self, memory: Any) -> None:
        """Count on from there."""
        self._accepted, self._rejected, self._taken, self._shorter = memory

    def _missed(self, outcome: Outcome) -> StepFailed:
        t = self.schedule.time(self._at)
        h = self.schedule.time(self._at + self._tried) - t
        assert outcome.deviation is not None  # what counts for nothing is no deviation
        worst = outcome.deviation
        component, _, variable = worst.variable.partition(".")
        return ToleranceMissed(component, "fmi2OK", t, h, variable=variable, error=worst.error, allowed=worst.allowed)
