"""The explicit loop in Python, as one reads it; the kernel is its twin in C."""

from collections.abc import Mapping

from cosim.errors import StepFailed
from cosim.masters.between import Between
from cosim.masters.culprit import blame
from cosim.masters.master import Outcome
from cosim.masters.point import Point
from cosim.masters.refreshing import Refreshing
from cosim.masters.slots import Slots
from cosim.masters.steps import Step, make
from cosim.masters.turns import Turns
from cosim.masters.watch import Clock, Watch
from cosim.slaves import breadcrumb
from cosim.slaves.ready import Span
from cosim.slaves.slave import Slave


class Stepping:
    """Each component takes one step per communication step, in its turn.

    While components step, the values of a point and the newest ones differ; they also do where a slow component is
    ahead of the others. Whatever interrupts a step, the slots show the last communication point reached.
    """

    records = True

    def __init__(self, turns: Turns, slaves: Mapping[str, Slave], watch: Watch) -> None:
        self.turns, self.layout, self.schedule, self.watch = turns, turns.layout, turns.schedule, watch
        self._named, self._slots = slaves, Slots(turns.layout)
        self._together = all(turn.period == 1 for turn in turns.all)
        self._span = span = Span()
        self._between = [Between(turn, turns, self._slots) for turn in turns.all]
        self._steps = [
            Step(turn, slaves[turn.component.name], self._slots, span, b.ends if turn.apart else None)
            for turn, b in zip(turns.all, self._between, strict=True)
        ]
        self._calls = [call for step in self._steps for call in step.calls]
        self._again = Refreshing(turns, slaves, self._slots)
        self._failure: BaseException | None = None

    def advance(self, point: Point, until: int) -> Outcome:
        """Go towards `until` and write rows; see `Algorithm`. Raises `StepFailed`, `ValueRefused`."""
        if self._failure is not None:
            raise self._failure
        self._slots.put(point)
        try:
            self._go(until)
        except BaseException as error:
            if isinstance(error, StepFailed):
                blame(error, self._named)
            if self._slots.index == point.index:
                raise
            self._failure = error  # raised by the next call: what was reached before counts
        self._slots.show_inputs()
        return Outcome(self._slots.reached(), None, self._slots.index - point.index)

    def _go(self, until: int) -> None:
        """Step until then, the block is full, a look is due, or the run is to end; the slots stand at a point."""
        slots, watch, schedule = self._slots, self.watch, self.schedule
        clock, here, stop = Clock(), breadcrumb.here(), watch.stop
        take = self._take_all if self._together else self._take_due
        k = slots.index
        t, next_row = schedule.time(k), schedule.next_recorded(k)
        while k < until and not stop.value and not watch.is_up(slots.point):
            end = schedule.time(k + 1)
            take(k, t, end - t)
            self._again.refresh(k, end)
            k, t = k + 1, end
            slots.arrive(k, t)
            here.time = t
            if k == next_row:
                watch.write(k, slots.row())
                next_row = schedule.next_recorded(k)
                if watch.block.full:
                    return
            if clock.is_due:
                return

    def _take_all(self, k: int, t: float, h: float) -> None:
        """Take the steps of components that all step from each point to the next: one list of calls."""
        self._span.begin(k, t, h)
        make(self._calls, self._span)
        self._slots.come()

    def _take_due(self, k: int, _t: float, _h: float) -> None:
        """Take the steps that are due in communication step k, each over its own period."""
        slots, schedule = self._slots, self.schedule
        for turn, between in zip(self.turns.all, self._between, strict=True):
            if turn.at_end and k == turn.start(k):
                slots.begun[:, turn.begun] = between.at_start(k)
        for step in self._steps:
            if step.turn.due(k, schedule):
                t = schedule.time(step.turn.start(k))
                step.take(k, t, schedule.time(step.turn.end(k, schedule)) - t)
        slots.coming[:] = slots.point
        for turn in self.turns.all:
            if turn.end(k, schedule) == k + 1:
                own = turn.component.outputs.slots
                slots.coming[own] = slots.newest[own]
