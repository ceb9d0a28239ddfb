"""The iterated master in the kernel, with Python for the steps that take more than Newton's method."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from cosim.masters.implicit.iterating import Iterating, Saved
from cosim.masters.implicit.plan import Plan
from cosim.masters.kernel.kernel import Kernel
from cosim.masters.kernel.library import obstacle
from cosim.masters.master import Outcome
from cosim.masters.point import Point
from cosim.masters.watch import Watch
from cosim.slaves.slave import Slave


def iterated_obstacle(slaves: Mapping[str, Slave]) -> str:
    """Return why the kernel cannot repeat steps of these instances; "" where it can."""
    missing = [name for name, slave in slaves.items() if not slave.description.can_get_and_set_state]
    return f"{missing[0]} cannot save its state" if missing else obstacle(slaves)


class IteratedKernel:
    """`Iterating` bit for bit, over slaves that offer C interfaces and can save their states."""

    records = True

    def __init__(self, plan: Plan, slaves: Mapping[str, Slave], watch: Watch, tolerance: float) -> None:
        self.plan, self.watch = plan, watch
        self._kernel = Kernel(plan.turns, slaves, watch, plan, tolerance)
        self._python = Iterating(plan, slaves, tolerance)

    def advance(self, point: Point, until: int) -> Outcome:
        """Go towards `until` and write rows; see `Algorithm`. Raises `StepFailed`, `ValueRefused`."""
        if not len(point.memory):
            point = replace(point, memory=np.zeros(self.plan.memory))
        outcome = self._kernel.advance(point, until)
        if not self._kernel.stuck or outcome.point.index > point.index:
            return outcome  # where it is stuck it will be so at the next call: what was reached before counts
        outcome = self._python.advance(point, point.index + 1)
        self.watch.row(outcome.point)
        return outcome


class KernelSolver:
    """`Iterating.attempt` bit for bit, in the kernel; a step at which it is stuck is left to Python."""

    def __init__(self, plan: Plan, slaves: Mapping[str, Slave], watch: Watch, tolerance: float) -> None:
        self.plan, self.evaluations = plan, 0
        self._kernel = Kernel(plan.turns, slaves, watch, plan, tolerance)
        self._python = Iterating(plan, slaves, tolerance)

    def attempt(self, point: Point, t: float, h: float, saved: Saved) -> Point:
        """Take one step of length h from t, s; see `Solver`."""
        outcome = self._kernel.attempt(point, t, h)
        if not self._kernel.stuck:
            self.evaluations += outcome.evaluations
            return outcome.point
        before = self._python.evaluations
        try:
            return self._python.attempt(point, t, h, saved)
        finally:
            self.evaluations += self._python.evaluations - before
