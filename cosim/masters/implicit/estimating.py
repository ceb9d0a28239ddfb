"""Iterated steps of any length, each with an estimate of its error: two solutions of one step are compared.

Where every input that moves is a smooth one with true slopes, the other solution is that with ramps; it is of order 2,
the smooth one of order 4, so that their difference is the error of the ramp's:

    e = |x_smooth - x_ramp|                                                                               (1)

It bounds the error of the smooth one, with which the run goes on. Else the other solution is one step of h against
two of h / 2 (Richardson); both are of order p = 2, for what is held or on a line decides it, and the run goes on with

    e = |x_two - x_one| / (2^p - 1)                                                                       (2)

x_two and this estimate. The FMUs stand at the solution with which the run goes on.
"""

from collections.abc import Callable, Mapping
from contextlib import ExitStack
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from cosim.errors import StepFailed
from cosim.masters.control.error_controlled import Pace
from cosim.masters.culprit import blame
from cosim.masters.implicit.iterating import Saved
from cosim.masters.implicit.norm import Norm
from cosim.masters.implicit.plan import Plan
from cosim.masters.master import Outcome
from cosim.masters.point import Point
from cosim.slaves import breadcrumb
from cosim.slaves.slave import Slave

ORDER = 2
"""p of (2)."""


@dataclass(frozen=True)
class Pair:
    """The two solutions of a step: the plans of what is only compared, and of what flies, in `steps` steps."""

    compared: Plan
    flown: Plan
    steps: int

    @property
    def divisor(self) -> float:
        """By what their difference is divided."""
        return 1.0 if self.steps == 1 else self.steps**ORDER - 1.0  # (1), (2)


class Solver(Protocol):
    """Takes single steps of a plan; `evaluations` counts how often loops have stepped."""

    evaluations: int

    def attempt(self, point: Point, t: float, h: float, saved: Saved) -> Point:
        """Take one step of length h from t, s, without more ado; `saved`: the instances as they stand at the point.

        Raises `StepFailed`, `ValueRefused`. The point returned has the index of the one given.
        """
        ...


class Estimating:
    """Solves each step in two ways; what fails is told in the outcome, for a shorter step may not.

    `Point.memory` has what the step control, the flown and the compared solution have learned, in that order.
    """

    records = False

    def __init__(self, pair: Pair, slaves: Mapping[str, Slave], norm: Norm, solver: Callable[[Plan], Solver]) -> None:
        self.pair, self.norm, self._named = pair, norm, slaves
        self.flown = solver(pair.flown)
        self.compared = self.flown if pair.compared is pair.flown else solver(pair.compared)
        self.slaves = [slaves[turn.component.name] for turn in pair.flown.turns.all]
        self.schedule = pair.flown.turns.schedule
        self._parts = np.cumsum([Pace.SIZE, pair.flown.memory])

    def advance(self, point: Point, until: int) -> Outcome:
        """Take one step to `until`; see `Algorithm`. A failure that may be one of this step's length is an outcome."""
        before = self._evaluations
        if not len(point.memory):
            point = replace(point, memory=np.zeros(self._parts[-1] + self.pair.compared.memory))
        t, end = self.schedule.time(point.index), self.schedule.time(until)
        with ExitStack() as stack:
            saved = stack.enter_context(Saved(self.slaves))
            try:
                outcome = self._solve(point, until, t, end, saved)
            except StepFailed as failure:
                blame(failure, self._named)
                if failure.is_final:
                    raise
                saved.restore()
                return Outcome(point, None, self._evaluations - before, failure)
            keeping = stack.pop_all()
        breadcrumb.here().time = end

        def settle(counts: bool) -> None:
            with keeping:
                if not counts:
                    saved.restore()

        return replace(outcome, evaluations=self._evaluations - before, settle=settle)

    @property
    def _evaluations(self) -> int:
        return sum(solver.evaluations for solver in {id(s): s for s in (self.flown, self.compared)}.values())

    def _solve(self, point: Point, until: int, t: float, end: float, saved: Saved) -> Outcome:
        pace, memory, other = np.split(point.memory, self._parts)
        compared = self.compared.attempt(replace(point, memory=other), t, end - t, saved)
        saved.restore()
        flown = self._fly(replace(point, memory=memory), t, end, saved)
        deviation = self.norm.between(point.values, flown.values, compared.values, self.pair.divisor)
        next_pace = Pace(pace).next(until - point.index, deviation.size if deviation else 0.0)
        learned = np.concatenate([next_pace, flown.memory, compared.memory])
        return Outcome(replace(flown, index=until, memory=learned), deviation)

    def _fly(self, point: Point, t: float, end: float, saved: Saved) -> Point:
        if self.pair.steps == 1:
            return self.flown.attempt(point, t, end - t, saved)
        middle = t + 0.5 * (end - t)
        half = self.flown.attempt(point, t, middle - t, saved)
        with Saved(self.slaves) as there:
            return self.flown.attempt(half, middle, end - middle, there)
