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
from cosim.masters.calls import read
from cosim.masters.given import slope_or_none
from cosim.masters.layout import ComponentLayout, Reading
from cosim.masters.slots import COMING, NEWEST, Slots, conversion, finiteness, place
from cosim.masters.steps import failed_step, refuse_not_finite
from cosim.masters.transfer import readers, slope_reader, slope_writer, writers
from cosim.masters.turns import RAMP, STEP_MEAN, Turns
from cosim.slaves.ready import Ready
from cosim.slaves.slave import Slave


class Refreshing:
    """What is evaluated again in each communication step, over some instances."""

    def __init__(self, turns: Turns, slaves: Mapping[str, Slave], slots: Slots) -> None:
        self._parts = [
            Solution(part, turns, slaves, slots) if isinstance(part, Loop) else Evaluation(part, turns, slaves, slots)
            for part in turns.refresh
        ]

    def refresh(self, k: int, now: float) -> None:
        """Evaluate again what stands at communication point k + 1, at `now` s.

        `Slots.coming` is that point in the making, which is brought up to date like `newest`. Raises `StepFailed`,
        `ValueRefused`, `AlgebraicLoop`.
        """
        for part in self._parts:
            part.evaluate(k, now)


class Evaluation:
    """Outputs of one component that are read again, all calls made ready."""

    def __init__(self, reading: Reading, turns: Turns, slaves: Mapping[str, Slave], slots: Slots) -> None:
        self.k, self.now = 0, 0.0
        self.reading, self._slots, self._schedule = reading, slots, turns.schedule
        self._turn = turn = turns.all[turns.turn_of(reading)]
        self._slave = slave = slaves[turn.component.name]
        inputs, references = turn.component.inputs, turn.moving_references
        values: FloatArray = np.zeros(len(inputs.links))
        means = turn.timing == STEP_MEAN
        sources = np.where(means, slots.places(NEWEST, inputs.source), slots.places(COMING, inputs.source))
        convert = conversion(inputs, slots, sources, values)
        self._set = [convert, *writers(slave, inputs, values, slots, lambda: self.now)]
        self._slopes: FloatArray = np.zeros(len(references))
        self._set_slopes, self._read_slopes = list[Ready](), list[Ready]()
        if reading.slopes:
            self._read_slopes = [slope_reader(slave, turn.component.outputs, slots), self._show_slopes]
        if reading.slopes and references:
            orders = (1,) * len(references)
            self._set_slopes = [self._find_slopes, slope_writer(slave, references, orders, self._slopes)]
        self._all = [*self._set, *self._set_slopes, *readers(slave, reading.groups, slots), *self._read_slopes]
        self._groups = [place(group.slots) for group in reading.groups]
        self._are_finite = finiteness(slots.newest, np.concatenate([group.finite for group in reading.groups]))

    def evaluate(self, k: int, now: float) -> None:
        """Read the outputs again, and slopes where they are told."""
        if not self.stands(k, now):
            return
        try:
            for call in self._all:
                call()
        except CallFailed as error:
            raise failed_step(error, *self._step()) from error
        self.finish()

    def stands(self, k: int, now: float) -> bool:
        """Whether the component stands at communication point k + 1, at `now` s, which is where it is evaluated."""
        self.k, self.now = k, now
        if self._turn.component.outputs.frozen(self._slots.newest):
            return False
        return self._turn.period == 1 or self._turn.end(k, self._schedule) == k + 1

    def set_inputs(self) -> None:
        """Set the inputs to what they are at the point; raises `CallFailed`, `ValueRefused`."""
        for call in self._set:
            call()

    def set_slopes(self) -> None:
        """Set the slopes that moving inputs have at the point."""
        for call in self._set_slopes:
            call()

    def read_slopes(self) -> None:
        """Read the slopes where they are told."""
        for call in self._read_slopes:
            call()

    def finish(self) -> None:
        """Refuse values that are not finite, make the others those of the point, take differences."""
        coming, newest = self._slots.coming, self._slots.newest
        if not self._are_finite():
            refuse_not_finite(self._turn, self._slave, *self._step(), self.reading.groups, newest)
        for group in self._groups:
            coming[group] = newest[group]
        differences = self._turn.component.outputs.differences
        if differences is not None:
            differences.take(self._slots.point, newest, self._step()[1])
            coming[differences.slope] = newest[differences.slope]
        outputs = self._turn.component.outputs
        outputs.pass_on(self._slots.point, newest, self.now)
        for passage in outputs.passages:
            coming[passage.slots] = newest[passage.slots]

    def _step(self) -> tuple[float, float]:
        """Return start and size of the step that the component has taken to the point, s."""
        t = self._schedule.time(self._turn.start(self.k))
        return t, self.now - t

    def _find_slopes(self) -> None:
        """Find the slopes of the moving inputs: the sources', or those of the lines to the point."""
        inputs, at = self._turn.component.inputs, self._turn.moving
        source, coming = inputs.source[at], self._slots.coming
        line = (coming[source] - self._slots.point[source]) / self._step()[1]
        line[np.isin(at, inputs.stepping(self._slots.newest))] = 0.0
        slope = np.where(self._turn.timing[at] == RAMP, line, slope_or_none(coming[inputs.slope[at]]))
        self._slopes[:] = inputs.factor[at] * slope

    def _show_slopes(self) -> None:
        told = self._turn.component.outputs.derivatives
        self._slots.coming[told] = self._slots.newest[told]


class Solution:
    """A loop that is solved at communication points; what it is solved in (`Around`)."""

    def __init__(self, loop: Loop, turns: Turns, slaves: Mapping[str, Slave], slots: Slots) -> None:
        self._loop, self._slots = loop, slots
        self._evaluations = {r.component: Evaluation(r, turns, slaves, slots) for r in loop.readings}
        self.components: Sequence[ComponentLayout] = turns.layout.components
        self.slaves: Sequence[Slave] = [slaves[c.name] for c in self.components]
        self.values: FloatArray = slots.coming
        self.time = 0.0

    def set_inputs(self, place: int) -> None:
        """Set the inputs of a component to what they are at the point; raises `CallFailed`, `ValueRefused`."""
        self._evaluations[place].set_inputs()

    def read(self, reading: Reading) -> list[FloatArray]:
        """Return outputs of a component as its inputs are now, an array for each group."""
        slave = self.slaves[reading.component]
        return [read(slave, group.kind, group.references, self._slots.texts) for group in reading.groups]

    def evaluate(self, k: int, now: float) -> None:
        """Solve what stands at communication point k + 1, and then its slopes where they are told."""
        loop = self._loop.part([p for p, evaluation in self._evaluations.items() if evaluation.stands(k, now)])
        if not loop.readings:
            return
        self.time = now
        members = [self._evaluations[reading.component] for reading in loop.readings]
        try:
            loop.solve(self)
            self._slots.newest[loop.slots] = self.values[loop.slots]
            self._solve_slopes(loop, members)
        except AlgebraicLoop as error:
            error.time = now
            raise
        except CallFailed as error:
            problem = f"the loop could not be solved ({error})"
            raise AlgebraicLoop(loop.path, problem, time=now, component=error.component) from error
        for member in members:
            member.finish()

    def _solve_slopes(self, loop: Loop, members: Sequence[Evaluation]) -> None:
        told = [member for member in members if member.reading.slopes]
        if not told:
            return
        slots = np.concatenate([self.components[member.reading.component].outputs.slopes for member in told])

        def evaluate(slopes: FloatArray) -> FloatArray:
            self.values[slots] = slopes
            loop.pass_on(self)
            for member in told:
                member.set_slopes()
            for member in told:
                member.read_slopes()
            return self._slots.newest[slots]

        try:
            solve_linear(evaluate, len(slots))
        except np.linalg.LinAlgError as error:
            raise AlgebraicLoop(loop.path, f"the slopes of the loop could not be solved ({error})") from error
