"""The plan of an explicit run: plain numbers that say what is set, stepped, read and recorded, in which order.

One vector has a slot for every variable that is read, every output derivative and every held input. A component owns
the slots from its `offset` on: its outputs, then its output derivatives. The Python loop and the C kernel run the
same plan with the same arithmetic.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from cosim.time import Schedule

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]

AT_POINT, AFTER_STEP, MIDPOINT, RAMP, STEP_MEAN, CENTRED = range(6)
"""Codes of `Inputs.timing`; a step mean is an after_step input that shows its source's newest mean, a centred one is an
after_step input that is the mean of both ends while the target steps (`Explicit.centred`)."""

TIMING_CODES = {"at_point": AT_POINT, "after_step": AFTER_STEP, "midpoint": MIDPOINT, "ramp": RAMP, "centred": CENTRED}

FLAG = 0.5
"""A flag is up where it is above this, half way between its values 0 and 1."""


@dataclass(frozen=True)
class Inputs:
    """The connected inputs of a component, all arrays of length n: input = factor * value + addend.

    With a and b the source's values at the start and the end of the target's step, value is a (at_point, ramp), b
    (after_step, step mean) or 0.5 * (a + b) (midpoint, centred). `ahead[i]`: source i steps more slowly and at the
    start of its period, so that its newest value may lie in the target's future.
    """

    references: tuple[int, ...]
    source: IntArray
    timing: IntArray
    factor: FloatArray
    addend: FloatArray
    ahead: BoolArray
    source_component: IntArray

    @cached_property
    def centred(self) -> IntArray:
        """Places of the centred inputs: set to b between the step and the reading of the outputs."""
        return np.flatnonzero(self.timing == CENTRED)

    @cached_property
    def centred_references(self) -> tuple[int, ...]:
        """Their value references."""
        return tuple(self.references[i] for i in self.centred)


@dataclass(frozen=True)
class InputDerivatives:
    """Input derivatives, arrays of length m: factor * ((b - a) / H) where `slot` is -1 (ramp), else factor * slot.

    `position` is the place of the input in `Inputs`, and gives the factor.
    """

    references: tuple[int, ...]
    orders: tuple[int, ...]
    position: IntArray
    slot: IntArray


@dataclass(frozen=True)
class Outputs:
    """What is read after each step, into consecutive slots from `offset` on: values, then output derivatives."""

    offset: int
    references: tuple[int, ...]
    names: tuple[str, ...]
    derivative_references: tuple[int, ...]
    derivative_orders: tuple[int, ...]

    @property
    def values(self) -> slice:
        """Slots of the values."""
        return slice(self.offset, self.offset + len(self.references))

    @property
    def derivatives(self) -> slice:
        """Slots of the output derivatives."""
        return slice(self.values.stop, self.values.stop + len(self.derivative_references))

    @property
    def slots(self) -> slice:
        """Slots of both."""
        return slice(self.offset, self.derivatives.stop)


@dataclass(frozen=True)
class ComponentPlan:
    """One component. `period` counts communication steps.

    It takes its step at the start of its period, or `at_end`, when its inputs come from faster components.
    """

    name: str
    period: int
    at_end: bool
    inputs: Inputs
    derivatives: InputDerivatives
    outputs: Outputs

    def start(self, k: int) -> int:
        """Return the communication point where the period around step k begins."""
        return k - k % self.period

    def end(self, k: int, schedule: Schedule) -> int:
        """Return the communication point where it ends; the last period may be shorter."""
        return min(self.start(k) + self.period, schedule.steps)

    def due(self, k: int, schedule: Schedule) -> bool:
        """Whether the component takes its step within communication step k."""
        return k + 1 == self.end(k, schedule) if self.at_end else k == self.start(k)


@dataclass(frozen=True)
class Reading:
    """Outputs of one component (its place in `Plan.components`) that are read together."""

    component: int
    references: tuple[int, ...]
    slots: IntArray


@dataclass(frozen=True)
class Evaluation:
    """One part of initialization: one reading, or with `loop` the readings of an algebraic loop and its text."""

    readings: tuple[Reading, ...]
    loop: tuple[str, ...] = ()


@dataclass(frozen=True)
class Columns:
    """What is recorded: column = factor * slot + addend; `units` are None where an FMU gives none."""

    names: tuple[str, ...]
    units: tuple[str | None, ...]
    source: IntArray
    factor: FloatArray
    addend: FloatArray


@dataclass(frozen=True)
class Plan:
    """The whole run, `components` in stepping order; `constants` (held inputs) fill the last of the `size` slots.

    `stop_slot`: the slot of the flag that ends the run where it is above FLAG; -1: none.
    """

    schedule: Schedule
    components: tuple[ComponentPlan, ...]
    size: int
    constants: FloatArray
    initialization: tuple[Evaluation, ...]
    refresh: tuple[Reading, ...]
    columns: Columns
    stop_slot: int = -1

    def ends(self, values: FloatArray) -> bool:
        """Whether the flag that ends the run is up, in a vector of slots."""
        return self.stop_slot >= 0 and bool(values[self.stop_slot] > FLAG)

    def row(self, values: FloatArray) -> FloatArray:
        """Return the recorded columns of a vector of slots."""
        columns = self.columns
        return columns.factor * values[columns.source] + columns.addend


def ints(values: Sequence[int]) -> IntArray:
    """Return an array of integers, also of none."""
    return np.array(values, dtype=np.int64)


def floats(values: Sequence[float]) -> FloatArray:
    """Return an array of floats, also of none."""
    return np.array(values, dtype=np.float64)
