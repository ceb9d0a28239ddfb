"""The explicit algorithm in Python: the readable reference of the kernel, the same arithmetic in the same order."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from cosim.arrays import FloatArray
from cosim.errors import CallFailed, StepFailed
from cosim.masters.calls import read_groups, refuse_values, write_inputs
from cosim.masters.culprit import blame
from cosim.masters.layout import Group, Reading
from cosim.masters.master import Outcome
from cosim.masters.point import Point
from cosim.masters.turns import AFTER_STEP, AT_POINT, CENTRED, MIDPOINT, RAMP, STEP_MEAN, Turn, Turns
from cosim.slaves import breadcrumb
from cosim.slaves.slave import Slave


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
        self._again = [(turns.turn_of(reading), reading) for reading in turns.refresh]

    def advance(self, point: Point, until: int) -> Outcome:
        """Take communication steps up to `until`; see `Algorithm`."""
        try:
            while point.index < until:
                point = self._step(point)
        except StepFailed as error:
            blame(error, self._named)
            raise
        return Outcome(point)

    def _step(self, at: Point) -> Point:
        k = at.index
        point = replace(at, newest=at.newest.copy(), begun=at.begun.copy())
        for turn in self.turns.all:
            if turn.at_end and k == turn.start(k):
                point.begun[turn.begun] = self._sources_at_start(point, turn, k)
        for turn, slave in zip(self.turns.all, self.slaves, strict=True):
            if turn.due(k, self.schedule):
                self._take(point, turn, slave, k)
        values = at.values.copy()
        for turn in self.turns.all:
            if turn.end(k, self.schedule) == k + 1:
                values[turn.component.outputs.slots] = point.newest[turn.component.outputs.slots]
        for place, reading in self._again:
            if self.turns.all[place].end(k, self.schedule) == k + 1:
                self._refresh(self.turns.all[place], self.slaves[place], reading, values, point, k)
        self.layout.show_inputs(values)
        breadcrumb.here().time = self.schedule.time(k + 1)
        return replace(point, index=k + 1, values=values)

    def _take(self, point: Point, turn: Turn, slave: Slave, k: int) -> None:
        t = self.schedule.time(turn.start(k))
        h = self.schedule.time(turn.end(k, self.schedule)) - t
        outputs = turn.component.outputs
        try:
            ends = self._set_inputs(point, turn, slave, k, t, h)
            slave.do_step(t, h)
            self._set_centred(turn, slave, ends)
            read_groups(slave, outputs.groups, point.newest, point.texts)
            if outputs.derivative_references:
                point.newest[outputs.derivatives] = slave.get_output_derivatives(
                    outputs.derivative_references, outputs.derivative_orders
                )
        except CallFailed as error:
            raise failed_step(error, t, h) from error
        _refuse_not_finite(turn, slave, t, h, outputs.groups, point.newest)

    def _set_inputs(self, point: Point, turn: Turn, slave: Slave, k: int, t: float, h: float) -> FloatArray:
        """Set what the step takes; return b, the sources' values at its end."""
        inputs, derivatives = turn.component.inputs, turn.derivatives
        if not inputs.links:
            return np.zeros(0)
        a = point.begun[turn.begun] if turn.at_end else self._sources_at_start(point, turn, k)
        b = self._sources_at_end(point, turn, k)
        value = a.copy()
        held = (turn.timing == AFTER_STEP) | (turn.timing == STEP_MEAN)
        value[held] = b[held]
        middle = (turn.timing == MIDPOINT) | (turn.timing == CENTRED)
        value[middle] = 0.5 * (a[middle] + b[middle])
        given = inputs.factor * value + inputs.addend
        refuse_values(inputs, given, t)
        write_inputs(slave, inputs, given, point.texts)
        if derivatives.references:
            slope = (b[derivatives.position] - a[derivatives.position]) / h
            slope = np.where(derivatives.slot < 0, slope, point.values[derivatives.slot])
            slave.set_input_derivatives(
                derivatives.references, derivatives.orders, inputs.factor[derivatives.position] * slope
            )
        return b

    @staticmethod
    def _set_centred(turn: Turn, slave: Slave, ends: FloatArray) -> None:
        """Set the centred inputs to their values at the end of the step, for the outputs that are read next."""
        inputs, at = turn.component.inputs, turn.centred
        if turn.centred_references:
            slave.set_real(turn.centred_references, inputs.factor[at] * ends[at] + inputs.addend[at])

    def _sources_at_start(self, point: Point, turn: Turn, k: int) -> FloatArray:
        """Return a: the sources' values where the target's period begins, shape (n_in,)."""
        source = turn.component.inputs.source
        a = point.values[source]
        for i in np.flatnonzero(turn.ahead & ((turn.timing == MIDPOINT) | (turn.timing == RAMP))):
            a[i] = self._between(point, source[i], self.turns.all[turn.source_turn[i]], k, turn.start(k))
        return a

    def _sources_at_end(self, point: Point, turn: Turn, k: int) -> FloatArray:
        """Return b: the sources' values where the target's period ends, shape (n_in,)."""
        source = turn.component.inputs.source
        b = point.newest[source]
        for i in np.flatnonzero(turn.ahead & (turn.timing != STEP_MEAN)):
            slow, end = self.turns.all[turn.source_turn[i]], turn.end(k, self.schedule)
            if slow.end(k, self.schedule) > end:
                if turn.timing[i] in (AT_POINT, AFTER_STEP, CENTRED):
                    b[i] = point.values[source[i]]
                else:
                    b[i] = self._between(point, source[i], slow, k, end)
        return b

    def _between(self, point: Point, slot: int, source: Turn, k: int, at: int) -> float:
        """Return a slow source's value at communication point `at`, on the line over its own step."""
        begin, end = self.schedule.count(source.start(k)), self.schedule.count(source.end(k, self.schedule))
        fraction = (self.schedule.count(at) - begin) / (end - begin)
        return point.values[slot] + (point.newest[slot] - point.values[slot]) * fraction

    def _refresh(self, turn: Turn, slave: Slave, reading: Reading, values: FloatArray, point: Point, k: int) -> None:
        """Read outputs again with the inputs of the communication point, whose `values` are in the making."""
        t = self.schedule.time(turn.start(k))
        h = self.schedule.time(k + 1) - t
        inputs = turn.component.inputs
        value = np.where(turn.timing == STEP_MEAN, point.newest[inputs.source], values[inputs.source])
        given = inputs.factor * value + inputs.addend
        refuse_values(inputs, given, t + h)
        try:
            write_inputs(slave, inputs, given, point.texts)
            read_groups(slave, reading.groups, point.newest, point.texts)
        except CallFailed as error:
            raise failed_step(error, t, h) from error
        _refuse_not_finite(turn, slave, t, h, reading.groups, point.newest)
        for group in reading.groups:
            values[group.slots] = point.newest[group.slots]


def failed_step(error: CallFailed, t: float, h: float) -> StepFailed:
    """Return a failed call as the failed step that it is; t, h: start and size of the component's step, s."""
    status = error.status if error.function == "fmi2DoStep" else f"{error.status} from {error.function}"
    last, terminated = error.last_successful_time, error.terminated and error.function == "fmi2DoStep"
    return StepFailed(error.component, status, t, h, last, error.messages, terminated=terminated)


def not_finite(turn: Turn, slave: Slave, t: float, h: float, slot: int, value: float) -> StepFailed:
    """Return the failure of a step after which an output is not finite."""
    variable = turn.component.outputs.names[slot - turn.component.outputs.offset]
    return StepFailed(turn.component.name, "fmi2OK", t, h, None, tuple(slave.messages), variable, value)


def _refuse_not_finite(
    turn: Turn, slave: Slave, t: float, h: float, groups: Sequence[Group], newest: FloatArray
) -> None:
    for group in groups:
        bad = np.flatnonzero(~np.isfinite(newest[group.finite]))
        if bad.size:
            slot = int(group.finite[bad[0]])
            raise not_finite(turn, slave, t, h, slot, float(newest[slot]))
