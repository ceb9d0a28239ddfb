"""One step of one component: what its inputs are over it, what is read at its end. The same in every master."""

from collections.abc import Sequence

import numpy as np

from cosim.arrays import FloatArray
from cosim.errors import CallFailed, StepFailed
from cosim.masters.given import EndsOf, Given
from cosim.masters.layout import Group
from cosim.masters.slots import NEWEST, Slots, conversion, finiteness
from cosim.masters.transfer import readers, slope_reader, slope_writer, stepper, writers
from cosim.masters.turns import Turn
from cosim.slaves.ready import Ready
from cosim.slaves.slave import Slave


class Step:
    """The steps of one component over a run, all calls of which are made ready here.

    `ends` as in `Given`. `fresh`: inputs that were held between both ends are set to those of the end before outputs
    are read.
    """

    def __init__(
        self, turn: Turn, slave: Slave, slots: Slots, ends: EndsOf | None = None, *, fresh: bool = False
    ) -> None:
        self.turn, self._slave, self._slots = turn, slave, slots
        inputs, outputs, told = turn.component.inputs, turn.component.outputs, turn.derivatives
        values = np.zeros(len(inputs.links))
        self._given = given = Given(turn, slots, values, ends)
        self._before, self._after = list[Ready](), readers(slave, outputs.groups, slots)
        if inputs.links:
            self._before = [given.find, *writers(slave, inputs, values, slots, lambda: given.t)]
        if told.references:
            self._before += given.find_slopes, slope_writer(slave, told.references, told.orders, given.slopes)
        if fresh and turn.halfway:
            at_end = conversion(inputs, slots, slots.places(NEWEST, inputs.source), values)
            self._after[:0] = at_end, *writers(slave, inputs, values, slots, lambda: given.t + given.h)
        if outputs.derivative_references:
            self._after.append(slope_reader(slave, outputs, slots))
        self._step, self._are_finite = stepper(slave), finiteness(slots.newest, outputs.finite)
        self._differences, self._outputs = outputs.differences, outputs
        self._may_freeze = outputs.freeze >= 0

    def take(self, k: int, t: float, h: float) -> None:
        """Step from t to t + h, the component's period in communication step k; `newest` takes what it returns.

        Raises `StepFailed`, `ValueRefused`.
        """
        given, own = self._given, t
        if self._may_freeze:
            if self._outputs.frozen(self._slots.newest):
                self._slots.newest[self._outputs.slots] = self._slots.point[self._outputs.slots]
                self._outputs.pass_on(self._slots.point, self._slots.newest, t + h)
                return
            own = t - self._outputs.lag(self._slots.newest)
        given.k, given.t, given.h = k, t, h
        try:
            for call in self._before:
                call()
            self._step(own, h)
            for call in self._after:
                call()
        except CallFailed as error:
            raise failed_step(error, t, h) from error
        if not self._are_finite():
            refuse_not_finite(self.turn, self._slave, t, h, self.turn.component.outputs.groups, self._slots.newest)
        if self._differences is not None:
            self._differences.take(self._slots.point, self._slots.newest, h)
        if self._outputs.passages:
            self._outputs.pass_on(self._slots.point, self._slots.newest, t + h)


def failed_step(error: CallFailed, t: float, h: float) -> StepFailed:
    """Return a failed call as the failed step that it is; t, h: start and size of the component's step, s."""
    status = error.status if error.in_step else f"{error.status} from {error.function}"
    last, terminated = error.last_successful_time, error.terminated and error.in_step
    lost = error.what if error.lost else ""
    return StepFailed(
        error.component, status, t, h, last, error.messages, terminated=terminated, waited=error.waited, lost=lost
    )


def not_finite(turn: Turn, slave: Slave, t: float, h: float, slot: int, value: float) -> StepFailed:
    """Return the failure of a step after which an output is not finite."""
    variable = turn.component.outputs.names[slot - turn.component.outputs.offset]
    return StepFailed(turn.component.name, "fmi2OK", t, h, None, tuple(slave.messages), variable, value)


def refuse_not_finite(
    turn: Turn, slave: Slave, t: float, h: float, groups: Sequence[Group], newest: FloatArray
) -> None:
    """Raise the `StepFailed` of an output that is not finite and must be."""
    for group in groups:
        bad = np.flatnonzero(~np.isfinite(newest[group.finite]))
        if bad.size:
            slot = int(group.finite[bad[0]])
            raise not_finite(turn, slave, t, h, slot, float(newest[slot]))
