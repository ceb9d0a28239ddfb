"""One step of one component: what its inputs are over it, what is read at its end. The same in every master."""

from collections.abc import Sequence

import numpy as np

from cosim.arrays import FloatArray
from cosim.errors import CallFailed, StepFailed
from cosim.masters import curves
from cosim.masters.calls import read_groups, refuse_values, write_inputs
from cosim.masters.curves import Ends
from cosim.masters.layout import Group
from cosim.masters.turns import (
    AFTER_STEP,
    CURVE,
    EXTRAPOLATED_MEAN,
    LINE,
    MEAN,
    MIDPOINT,
    SIGNAL,
    SIGNAL_MEAN,
    SIGNAL_SLOT,
    STEP_MEAN,
    Turn,
)
from cosim.masters.types import Texts
from cosim.slaves.slave import Slave


def take(
    turn: Turn,
    slave: Slave,
    ends: Ends,
    begun: FloatArray,
    newest: FloatArray,
    texts: Texts,
    t: float,
    h: float,
    *,
    fresh: bool = False,
) -> None:
    """Step a component from t to t + h, its sources' values and slopes at both `ends` given.

    `begun`: all slots at t; `newest`: all slots, takes what the component returns. `fresh`: inputs that were held
    between both ends are set to those of the end before outputs are read. Raises `StepFailed`, `ValueRefused`.
    """
    outputs = turn.component.outputs
    try:
        _set_inputs(turn, slave, ends, begun, newest, texts, t, h)
        slave.do_step(t, h)
        if fresh and turn.halfway:
            write_inputs(slave, turn.component.inputs, _at_end(turn, ends), texts)
        read_groups(slave, outputs.groups, newest, texts)
        if outputs.derivative_references:
            newest[outputs.derivatives] = slave.get_output_derivatives(
                outputs.derivative_references, outputs.derivative_orders
            )
    except CallFailed as error:
        raise failed_step(error, t, h) from error
    refuse_not_finite(turn, slave, t, h, outputs.groups, newest)
    if outputs.differences is not None:
        outputs.differences.take(begun, newest, h)


def _at_end(turn: Turn, ends: Ends) -> FloatArray:
    return turn.component.inputs.factor * ends.b + turn.component.inputs.addend


def _set_inputs(
    turn: Turn, slave: Slave, ends: Ends, begun: FloatArray, newest: FloatArray, texts: Texts, t: float, h: float
) -> None:
    inputs, derivatives, timing = turn.component.inputs, turn.derivatives, turn.timing
    if not inputs.links:
        return
    if turn.has_curves:
        ends = ends.known(h)
    value = ends.a.copy()
    held = (timing == AFTER_STEP) | (timing == STEP_MEAN)
    value[held] = ends.b[held]
    middle = timing == MIDPOINT
    value[middle] = 0.5 * (ends.a[middle] + ends.b[middle])
    mean = timing == MEAN
    value[mean] = curves.mean(ends, h)[mean]
    for i in np.flatnonzero(timing == EXTRAPOLATED_MEAN):
        value[i] += 0.5 * h * slope_or_none(begun[inputs.slope[i]])
    signal = (timing == SIGNAL) | (timing == SIGNAL_MEAN)
    value[signal] = newest[inputs.signal[signal]]
    given = inputs.factor * value + inputs.addend
    refuse_values(inputs, given, t)
    write_inputs(slave, inputs, given, texts)
    if derivatives.references:
        at = derivatives.position
        here = Ends(*(part[at] for part in ends))
        order, form = derivatives.order, derivatives.form
        slope = np.where(form == LINE, (here.b - here.a) / h, slope_or_none(begun[derivatives.slot]))
        curve = np.where(order == 1, here.da, np.where(order == 2, curves.second(here, h), curves.third(here, h)))
        slope = np.where(form == CURVE, curve, np.where(form == SIGNAL_SLOT, newest[derivatives.slot], slope))
        slave.set_input_derivatives(derivatives.references, derivatives.orders, inputs.factor[at] * slope)


def slope_or_none(slope: FloatArray) -> FloatArray:
    """Return slopes that are known; an input whose source's slope is not is held."""
    return np.where(np.isnan(slope), 0.0, slope)


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
