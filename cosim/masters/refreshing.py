"""Outputs that are evaluated again once all components stand at a communication point, without a step.

An output that follows directly from an input that a step has left behind its source is read again with the source's
value of that instant, after those that it follows. Outputs that follow each other are a loop, which is solved
(algebraic_loop.py). Where slopes are told, those of a loop are solved after its values: the output derivative is
dy/dt + dy/dx x' + dy/du u', so they are a loop that is linear.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from cosim.arrays import FloatArray
from cosim.errors import AlgebraicLoop, CallFailed
from cosim.masters.algebraic_loop import Loop, solve_linear
from cosim.masters.calls import read, refuse_values, write_inputs
from cosim.masters.layout import ComponentLayout, Reading
from cosim.masters.point import Point
from cosim.masters.steps import failed_step, refuse_not_finite, slope_or_none
from cosim.masters.turns import RAMP, STEP_MEAN, Turn, Turns
from cosim.slaves.slave import Slave
from cosim.time import Schedule


class Refreshing:
    """What is evaluated again in each communication step, over some instances."""

    def __init__(self, turns: Turns, slaves: Mapping[str, Slave]) -> None:
        by_name = {turn.component.name: turn for turn in turns.all}
        self.components = turns.layout.components
        self.turns = [by_name[c.name] for c in self.components]
        self.slaves = [slaves[c.name] for c in self.components]
        self._parts, self._schedule = turns.refresh, turns.schedule

    def refresh(self, point: Point, values: FloatArray) -> None:
        """Evaluate again what stands at the communication point after `point`.

        `point`: values of all slots at its index, `newest` what the components have returned since; `values` of the
        next one in the making, like `newest` brought up to date. Raises `StepFailed`, `ValueRefused`, `AlgebraicLoop`.
        """
        if not self._parts:
            return
        k, there = point.index, _There(self, self._schedule, point, values)
        standing = [place for place, turn in enumerate(self.turns) if turn.end(k, self._schedule) == k + 1]
        for part in self._parts:
            if isinstance(part, Loop):
                loop = part.part(standing)
                if loop.readings:
                    there.solve(loop)
            elif part.component in standing:
                there.evaluate(part)


class _There:
    """A communication point in the making; what an algebraic loop is solved in (`Around`)."""

    def __init__(self, here: Refreshing, schedule: Schedule, point: Point, values: FloatArray) -> None:
        self.components: Sequence[ComponentLayout] = here.components
        self.slaves: Sequence[Slave] = here.slaves
        self.values = values
        self._turns, self._schedule, self._k = here.turns, schedule, point.index
        self._begun, self._newest, self._texts = point.values, point.newest, point.texts
        self._now = schedule.time(point.index + 1)

    def set_inputs(self, place: int) -> None:
        """Set the inputs of a component to what they are at the point; raises `CallFailed`, `ValueRefused`."""
        turn, inputs = self._turns[place], self.components[place].inputs
        value = np.where(turn.timing == STEP_MEAN, self._newest[inputs.source], self.values[inputs.source])
        given = inputs.factor * value + inputs.addend
        refuse_values(inputs, given, self._now)
        write_inputs(self.slaves[place], inputs, given, self._texts)

    def read(self, reading: Reading) -> list[FloatArray]:
        """Return outputs of a component as its inputs are now, an array for each group."""
        slave = self.slaves[reading.component]
        return [read(slave, group.kind, group.references, self._texts) for group in reading.groups]

    def evaluate(self, reading: Reading) -> None:
        """Read outputs of one component again, and its slopes where they are told."""
        t, h = self._step(reading)
        try:
            self.set_inputs(reading.component)
            self._set_slopes(reading)
            for group, values in zip(reading.groups, self.read(reading), strict=True):
                self._newest[group.slots] = values
            self._read_slopes(reading)
        except CallFailed as error:
            raise failed_step(error, t, h) from error
        self._finish(reading)

    def solve(self, loop: Loop) -> None:
        """Solve a loop, and then its slopes where they are told."""
        try:
            loop.solve(self)
            self._newest[loop.slots] = self.values[loop.slots]
            self._solve_slopes(loop)
        except AlgebraicLoop as error:
            error.time = self._now
            raise
        except CallFailed as error:
            problem = f"the loop could not be solved ({error})"
            raise AlgebraicLoop(loop.path, problem, time=self._now, component=error.component) from error
        for reading in loop.readings:
            self._finish(reading)

    def _solve_slopes(self, loop: Loop) -> None:
        told = [reading for reading in loop.readings if reading.slopes]
        if not told:
            return
        slots = np.concatenate([self.components[reading.component].outputs.slopes for reading in told])

        def evaluate(slopes: FloatArray) -> FloatArray:
            self.values[slots] = slopes
            for reading in told:
                self._set_slopes(reading)
            for reading in told:
                self._read_slopes(reading)
            return self._newest[slots]

        try:
            solve_linear(evaluate, len(slots))
        except np.linalg.LinAlgError as error:
            raise AlgebraicLoop(loop.path, f"the slopes of the loop could not be solved ({error})") from error

    def _step(self, reading: Reading) -> tuple[float, float]:
        """Return start and size of the step that a component has taken to the point, s."""
        t = self._schedule.time(self._turns[reading.component].start(self._k))
        return t, self._now - t

    def _set_slopes(self, reading: Reading) -> None:
        turn = self._turns[reading.component]
        if reading.slopes and turn.moving_references:
            slopes = self._slopes_now(turn, self._step(reading)[1])
            self.slaves[reading.component].set_input_derivatives(
                turn.moving_references, (1,) * len(turn.moving), slopes
            )

    def _slopes_now(self, turn: Turn, h: float) -> FloatArray:
        """Return the slopes of the moving inputs at the point: the sources', or those of the lines to it."""
        inputs, at = turn.component.inputs, turn.moving
        source = inputs.source[at]
        line = (self.values[source] - self._begun[source]) / h
        slope = np.where(turn.timing[at] == RAMP, line, slope_or_none(self.values[inputs.slope[at]]))
        return inputs.factor[at] * slope

    def _read_slopes(self, reading: Reading) -> None:
        if reading.slopes:
            outputs = self.components[reading.component].outputs
            slopes = self.slaves[reading.component].get_output_derivatives(
                outputs.derivative_references, outputs.derivative_orders
            )
            self._newest[outputs.derivatives] = slopes
            self.values[outputs.derivatives] = slopes

    def _finish(self, reading: Reading) -> None:
        """Refuse values that are not finite, make the others those of the point, take differences."""
        turn, slave = self._turns[reading.component], self.slaves[reading.component]
        t, h = self._step(reading)
        refuse_not_finite(turn, slave, t, h, reading.groups, self._newest)
        for group in reading.groups:
            self.values[group.slots] = self._newest[group.slots]
        differences = turn.component.outputs.differences
        if differences is not None:
            differences.take(self._begun, self._newest, h)
            self.values[differences.slope] = self._newest[differences.slope]
