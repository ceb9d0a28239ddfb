"""What a loop in Python reads and sets in every step, between instances and slots: calls that are made ready once.

Of instances that offer ready calls it is those calls, on the slots themselves where they follow each other; of others
what every instance has (calls.py).
"""

from collections.abc import Callable, Sequence

import numpy as np

from cosim.arrays import FloatArray
from cosim.masters.calls import read, refuse_values, write
from cosim.masters.layout import Group, Inputs, Outputs
from cosim.masters.slots import Slots, place
from cosim.masters.types import Kind
from cosim.slaves.ready import Ready, Span, ready_calls
from cosim.slaves.slave import References, Slave


def writers(slave: Slave, inputs: Inputs, values: FloatArray, slots: Slots, time: Callable[[], float]) -> list[Ready]:
    """Return what sets all inputs of a component to `values`, shape (n,) in the order of its links, at a `time` in s.

    The calls raise `CallFailed`, and `ValueRefused` for an input that cannot take its value.
    """
    made: list[Ready] = [lambda: refuse_values(inputs, values, time())] if inputs.allowed else []
    at = 0
    for group in inputs.groups:
        made.append(_setter(slave, group, values[at : at + len(group.references)], slots))
        at += len(group.references)
    return made


def _setter(slave: Slave, group: Group, values: FloatArray, slots: Slots) -> Ready:
    calls = ready_calls(slave)
    if calls is not None and group.kind == Kind.REAL:
        return calls.set_real(group.references, values)
    return lambda: write(slave, group.kind, group.references, values, slots.texts)


def readers(slave: Slave, groups: Sequence[Group], slots: Slots) -> list[Ready]:
    """Return what reads groups of variables into their slots of `newest`; the calls raise `CallFailed`."""
    return [_reader(slave, group, slots) for group in groups]


def _reader(slave: Slave, group: Group, slots: Slots) -> Ready:
    calls, where, newest = ready_calls(slave), place(group.slots), slots.newest
    if calls is None or group.kind != Kind.REAL:

        def read_group() -> None:
            newest[where] = read(slave, group.kind, group.references, slots.texts)

        return read_group
    if isinstance(where, slice):
        return calls.get_real(group.references, newest[where])
    values = np.zeros(len(group.references))
    get = calls.get_real(group.references, values)

    def read_apart() -> None:
        get()
        newest[where] = values

    return read_apart


def slope_writer(slave: Slave, references: References, orders: References, slopes: FloatArray) -> Ready:
    """Return what sets derivatives of inputs to what is in `slopes` then."""
    calls = ready_calls(slave)
    if calls is not None:
        return calls.set_input_derivatives(references, orders, slopes)
    return lambda: slave.set_input_derivatives(references, orders, slopes)


def slope_reader(slave: Slave, outputs: Outputs, slots: Slots) -> Ready:
    """Return what reads all output derivatives of a component into their slots of `newest`."""
    calls, told, into = ready_calls(slave), outputs.derivative_references, slots.newest[outputs.derivatives]
    if calls is not None:
        return calls.get_output_derivatives(told, outputs.derivative_orders, into)

    def read_slopes() -> None:
        into[:] = slave.get_output_derivatives(told, outputs.derivative_orders)

    return read_slopes


def stepper(slave: Slave, span: Span) -> Ready:
    """Return what lets an instance take the step of a span."""
    calls = ready_calls(slave)
    if calls is not None:
        return calls.do_step(span)
    return lambda: slave.do_step(span.start.value, span.size.value)
