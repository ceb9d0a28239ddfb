"""The iterated loop in Python, as one reads it; the kernel is its twin in C for steps that take no more than Newton."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from cosim.arrays import FloatArray
from cosim.errors import NotConverged, StepFailed
from cosim.masters.culprit import blame
from cosim.masters.implicit import differences, newton, sensitivity
from cosim.masters.implicit.plan import Loop, Memory, Plan
from cosim.masters.master import Outcome
from cosim.masters.point import Point
from cosim.masters.slots import Slots
from cosim.masters.steps import Step
from cosim.slaves import breadcrumb
from cosim.slaves.ready import Span
from cosim.slaves.slave import Slave

HALVINGS = 8
"""How often a step that does not converge is halved at most."""


class Iterating:
    """Repeats a step until what the components exchange agrees at its end; one that does not converge is halved.

    The point that `advance` was given stays as it was. `evaluations` counts how often loops have stepped.
    """

    records = False

    def __init__(self, plan: Plan, slaves: Mapping[str, Slave], tolerance: float) -> None:
        self.plan, self.turns, self.tolerance = plan, plan.turns, tolerance
        self.layout, self.schedule = plan.turns.layout, plan.turns.schedule
        self._named, self.slaves = slaves, [slaves[turn.component.name] for turn in plan.turns.all]
        self._slots = Slots(self.layout)
        span, turns = Span(), zip(self.turns.all, self.slaves, strict=True)
        self._steps = [Step(turn, slave, self._slots, span, fresh=True) for turn, slave in turns]
        self.evaluations = 0

    def advance(self, point: Point, until: int) -> Outcome:
        """Take communication steps up to `until`; see `Algorithm`."""
        before = self.evaluations
        while point.index < until:
            point = self.step(point, point.index + 1)
        return Outcome(point, None, self.evaluations - before)

    def step(self, point: Point, until: int) -> Point:
        """Take one step from a point to communication point `until`; raises `StepFailed`, `ValueRefused`."""
        if not len(point.memory):
            point = replace(point, memory=np.zeros(self.plan.memory))
        t, end = self.schedule.time(point.index), self.schedule.time(until)
        try:
            reached = self._leap(point, t, end, 0)
        except StepFailed as error:
            blame(error, self._named)
            raise
        breadcrumb.here().time = end
        return replace(reached, index=until)

    def _leap(self, point: Point, t: float, end: float, halvings: int) -> Point:
        """Go from t to `end` in one step, or in two halves of it, and so on."""
        with Saved(self.slaves) as saved:
            try:
                return self.attempt(point, t, end - t, saved)
            except StepFailed as failure:
                if isinstance(failure, NotConverged):
                    failure.halvings = halvings
                if failure.is_final or not self.plan.loops or halvings == HALVINGS:
                    raise
                if obstacle := self._cannot_halve(saved):
                    if isinstance(failure, NotConverged):
                        failure.why = obstacle
                    raise
                saved.restore()
        middle = t + 0.5 * (end - t)
        return self._leap(self._leap(point, t, middle, halvings + 1), middle, end, halvings + 1)

    def _cannot_halve(self, saved: "Saved") -> str:
        for slave in self.slaves:
            if not slave.description.can_handle_variable_step:
                return f"{slave.name} needs a constant step"
        return f"{saved.missing} cannot save its state" if saved.missing else ""

    def attempt(self, point: Point, t: float, h: float, saved: "Saved") -> Point:
        """Take one step of length h from t, s, without more ado; `saved`: the instances as they stand at the point.

        Raises `StepFailed`, `ValueRefused`. The point returned has the index of the one given.
        """
        memory, slots = point.memory.copy(), self._slots
        slots.put(replace(point, newest=point.values))
        for stage in self.plan.stages:
            if isinstance(stage, Loop):
                self._solve(stage, memory, t, h, saved)
            else:
                self._steps[stage].take(point.index, t, h)
        newest = slots.newest.copy()
        self.layout.show_inputs(newest)
        return replace(point, values=newest, newest=newest, memory=memory)

    def _solve(self, loop: Loop, memory: FloatArray, t: float, h: float, saved: "Saved") -> None:
        """Find the unknowns of a loop; raises `NotConverged`."""
        slots, stepped = self._slots, False

        def evaluate(x: FloatArray) -> FloatArray:
            nonlocal stepped
            if stepped:
                saved.restore(loop.turns)
            stepped = True
            self.evaluations += 1
            slots.newest[loop.slots] = x
            for place in loop.turns:
                self.turns.all[place].component.outputs.pass_on(slots.point, slots.newest, t + h)
            for place in loop.turns:
                self._steps[place].take(slots.index, t, h)
            return slots.newest[loop.slots]

        def derived(_x: FloatArray, _result: FloatArray) -> FloatArray:
            return sensitivity.jacobian(loop.members, loop.slots, self.layout.size, self._named, h)

        def differenced(x: FloatArray, result: FloatArray) -> FloatArray:
            return differences.jacobian(loop, x, result, h, evaluate)

        renewals = [derived, differenced] if loop.members else [differenced]
        learned = Memory(memory[loop.memory], loop.size)
        found = newton.find(loop, learned, slots.point[loop.slots], h, self.tolerance, evaluate, renewals)
        if not found.known:
            worst = loop.names[found.worst]
            component, _, variable = worst.partition(".")
            raise NotConverged(
                component,
                "no agreement",
                t,
                h,
                variable=variable,
                loop=tuple(dict.fromkeys(loop.names)),
                change=found.size,
                tolerance=self.tolerance,
            )


class Saved:
    """The FMU states of instances at the start of a step, to go back to; a context manager that frees them.

    `missing`: the first instance that cannot save its state, "" for none.
    """

    def __init__(self, slaves: list[Slave]) -> None:
        self._slaves = slaves
        self._states: dict[int, Any] = {}
        self.missing = next((s.name for s in slaves if not s.description.can_get_and_set_state), "")

    def __enter__(self) -> "Saved":
        for place, slave in enumerate(self._slaves):
            if slave.description.can_get_and_set_state:
                self._states[place] = slave.get_state()
        return self

    def __exit__(self, *_: object) -> None:
        for place, state in self._states.items():
            self._slaves[place].free_state(state)
        self._states.clear()

    def restore(self, places: tuple[int, ...] | None = None) -> None:
        """Go back with all instances that can, or those at some places."""
        for place in self._states if places is None else places:
            self._slaves[place].set_state(self._states[place])
