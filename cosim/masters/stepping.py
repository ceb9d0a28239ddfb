"""The explicit loop in Python, as one reads it; the kernel is its twin in C."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from cosim.arrays import FloatArray
from cosim.errors import StepFailed
from cosim.masters import curves, steps
from cosim.masters.culprit import blame
from cosim.masters.curves import Ends
from cosim.masters.master import Outcome
from cosim.masters.point import Point
from cosim.masters.refreshing import Refreshing
from cosim.masters.turns import MEAN, MIDPOINT, RAMP, SMOOTH, STEP_MEAN, Turn, Turns
from cosim.slaves import breadcrumb
from cosim.slaves.slave import Slave

BETWEEN = (MIDPOINT, RAMP, SMOOTH, MEAN)
"""Timings whose inputs are between the values at both ends of a step."""


class Stepping:
    """Each component takes one step per communication step, in its turn.

    While components step, the values of a point and the newest ones differ; they also do where a slow component is
    ahead of the others. The point that `advance` was given stays as it was: whatever interrupts the step, it is the
    last communication point reached.
    """

    records = False

    def __init__(self, turns: Turns, slaves: Mapping[str, Slave]) -> None:
        self.turns, self.layout, self.schedule = turns, turns.layout, turns.schedule
        self._named, self.slaves = slaves, [slaves[turn.component.name] for turn in turns.all]
        self._again = Refreshing(turns, slaves)

    def advance(self, point: Point, until: int) -> Outcome:
        """Take communication steps up to `until`; see `Algorithm`."""
        begun = point.index
        try:
            while point.index < until:
                point = self._step(point)
        except StepFailed as error:
            blame(error, self._named)
            raise
        return Outcome(point, None, point.index - begun)

    def _step(self, at: Point) -> Point:
        k = at.index
        point = replace(at, newest=at.newest.copy(), begun=at.begun.copy())
        for turn in self.turns.all:
            if turn.at_end and k == turn.start(k):
                point.begun[:, turn.begun] = self._sources_at_start(point, turn, k)
        for turn, slave in zip(self.turns.all, self.slaves, strict=True):
            if turn.due(k, self.schedule):
                self._take(point, turn, slave, k)
        values = at.values.copy()
        for turn in self.turns.all:
            if turn.end(k, self.schedule) == k + 1:
                values[turn.component.outputs.slots] = point.newest[turn.component.outputs.slots]
        self._again.refresh(point, values)
        self.layout.show_inputs(values)
        breadcrumb.here().time = self.schedule.time(k + 1)
        return replace(point, index=k + 1, values=values)

    def _take(self, point: Point, turn: Turn, slave: Slave, k: int) -> None:
        t = self.schedule.time(turn.start(k))
        h = self.schedule.time(turn.end(k, self.schedule)) - t
        a, da = point.begun[:, turn.begun] if turn.at_end else self._sources_at_start(point, turn, k)
        b, db = self._sources_at_end(point, turn, k)
        steps.take(turn, slave, Ends(a, b, da, db), point.values, point.newest, point.texts, t, h)

    def _sources_at_start(self, point: Point, turn: Turn, k: int) -> FloatArray:
        """Return a, a': the sources' values and slopes where the target's period begins, shape (2, n_in)."""
        found = _values_and_slopes(turn, point.values)
        for i in np.flatnonzero(turn.ahead & np.isin(turn.timing, BETWEEN)):
            found[:, i] = self._between(point, turn, int(i), k, turn.start(k))
        return found

    def _sources_at_end(self, point: Point, turn: Turn, k: int) -> FloatArray:
        """Return b, b': the sources' values and slopes where the target's period ends, shape (2, n_in)."""
        found = _values_and_slopes(turn, point.newest)
        for i in np.flatnonzero(turn.ahead & (turn.timing != STEP_MEAN)):
            slow, end = self.turns.all[turn.source_turn[i]], turn.end(k, self.schedule)
            if slow.end(k, self.schedule) > end:
                if turn.timing[i] in BETWEEN:
                    found[:, i] = self._between(point, turn, int(i), k, end)
                else:
                    found[0, i] = point.values[turn.component.inputs.source[i]]
        return found

    def _between(self, point: Point, turn: Turn, i: int, k: int, at: int) -> tuple[float, float]:
        """Return a slow source's value and slope at communication point `at`, on the line or curve over its step."""
        source, slot = self.turns.all[turn.source_turn[i]], turn.component.inputs.source[i]
        begin, end = self.schedule.count(source.start(k)), self.schedule.count(source.end(k, self.schedule))
        since, whole = self.schedule.count(at) - begin, end - begin
        a, b = float(point.values[slot]), float(point.newest[slot])
        if not turn.curved[i]:
            return a + (b - a) * (since / whole), 0.0
        slope = turn.component.inputs.slope[i]
        h, s = whole / self.schedule.denominator, since / self.schedule.denominator
        ends = Ends(*(np.array([x]) for x in (a, b, point.values[slope], point.newest[slope])))
        value, rate = curves.at(ends.known(h), h, s)
        return float(value[0]), float(rate[0])


def _values_and_slopes(turn: Turn, slots: FloatArray) -> FloatArray:
    """Return the sources' values, and slopes where inputs follow curves, shape (2, n_in)."""
    inputs = turn.component.inputs
    found = np.zeros((2, len(inputs.links)))
    found[0] = slots[inputs.source]
    if turn.has_curves:
        found[1] = np.where(turn.curved, slots[inputs.slope], 0.0)
    return found
