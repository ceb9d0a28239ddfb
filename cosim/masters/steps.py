"""One step of one component: what its inputs are over it, what is read at its end. The same in every master."""

from collections.abc import Sequence
from functools import partial

import numpy as np

from cosim.arrays import FloatArray
from cosim.errors import CallFailed, StepFailed
from cosim.masters.given import EndsOf, Given
from cosim.masters.layout import Group, Outputs
from cosim.masters.motion import Motion
from cosim.masters.slopes import Differences
from cosim.masters.slots import NEWEST, Slots, conversion, finiteness
from cosim.masters.transfer import readers, slope_reader, slope_writer, stepper, writers
from cosim.masters.turns import Turn
from cosim.slaves.ready import Ready, Span
from cosim.slaves.slave import Slave


class Step:
    """The steps of one component over a run: `calls` are all that one takes, in their order, made ready here.

    None of them refers back to the step, so that instances that have flown are let go of at once.

    `span`: the step that is being taken. `ends` as in `Given`. `fresh`: inputs that were held between both ends are set
    to those of the end before outputs are read.
    """

    def __init__(
        self, turn: Turn, slave: Slave, slots: Slots, span: Span, ends: EndsOf | None = None, *, fresh: bool = False
    ) -> None:
        self.turn, self._span = turn, span
        inputs, outputs, told = turn.component.inputs, turn.component.outputs, turn.derivatives
        values = np.zeros(len(inputs.links))
        given, motion = Given(turn, slots, span, values, ends), Motion(turn, slots, span, ends)
        calls = list[Ready]()
        if inputs.links:
            calls += given.find, *writers(slave, inputs, values, slots, lambda: span.t)
        if told.references:
            calls += *motion.calls, slope_writer(slave, told.references, told.orders, motion.derivatives)
        calls.append(stepper(slave, span))
        if fresh and turn.halfway:
            at_end = conversion(inputs, slots, slots.places(NEWEST, inputs.source), values)
            calls += at_end, *writers(slave, inputs, values, slots, lambda: span.t + span.h)
        calls += readers(slave, outputs.groups, slots)
        if outputs.derivative_references:
            calls.append(slope_reader(slave, outputs, slots))
        if outputs.finite.size:
            calls.append(_checking(turn, slave, slots, span))
        if outputs.differences is not None:
            calls.append(partial(_take_differences, outputs.differences, slots, span))
        if outputs.passages:
            calls.append(partial(_pass_on, outputs, slots, span))
        self.calls = calls if outputs.freeze < 0 else [partial(_unless_frozen, calls, outputs, slots, span)]

    def take(self, k: int, t: float, h: float) -> None:
        """Step from t to t + h, the component's period in communication step k; `newest` takes what it returns.

        Raises `StepFailed`, `ValueRefused`.
        """
        self._span.begin(k, t, h)
        make(self.calls, self._span)


def _checking(turn: Turn, slave: Slave, slots: Slots, span: Span) -> Ready:
    """Return what refuses outputs that are not finite and must be."""
    outputs, newest = turn.component.outputs, slots.newest
    are_finite = finiteness(newest, outputs.finite)

    def check() -> None:
        if not are_finite():
            refuse_not_finite(turn, slave, span.t, span.h, outputs.groups, newest)

    return check


def _take_differences(differences: Differences, slots: Slots, span: Span) -> None:
    differences.take(slots.point, slots.newest, span.h)


def _pass_on(outputs: Outputs, slots: Slots, span: Span) -> None:
    outputs.pass_on(slots.point, slots.newest, span.t + span.h)


def _unless_frozen(calls: Sequence[Ready], outputs: Outputs, slots: Slots, span: Span) -> None:
    """Make the calls of a step, by the component's own clock; one that is frozen has what it had at the point."""
    if outputs.frozen(slots.newest):
        slots.newest[outputs.slots] = slots.point[outputs.slots]
        _pass_on(outputs, slots, span)
        return
    span.start.value = span.t - outputs.lag(slots.newest)
    for call in calls:
        call()
    span.start.value = span.t


def make(calls: Sequence[Ready], span: Span) -> None:
    """Make the calls of the step of a span; raises `StepFailed` for one that fails."""
    try:
        for call in calls:
            call()
    except CallFailed as error:
        raise failed_step(error, span.t, span.h) from error


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
