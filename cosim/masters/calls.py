"""Reading and writing groups of variables of any kind, as doubles in a vector of slots."""

from collections.abc import Sequence

import numpy as np

from cosim.arrays import BoolArray, FloatArray
from cosim.errors import ValueRefused
from cosim.masters.layout import Group, Inputs
from cosim.masters.types import Kind, Texts, kind_of
from cosim.slaves.slave import References, Slave
from fmus.description.description import Scalar, ScalarVariable


def read(slave: Slave, kind: Kind, references: References, texts: Texts) -> FloatArray:
    """Return the values of variables of one kind, shape (n,); raises `CallFailed`."""
    if kind == Kind.REAL:
        return slave.get_real(references)
    if kind == Kind.INTEGER:
        return np.array(slave.get_integer(references), dtype=np.float64)
    if kind == Kind.BOOLEAN:
        return np.array(slave.get_boolean(references), dtype=np.float64)
    return np.array([texts.number(text) for text in slave.get_string(references)], dtype=np.float64)


def write(slave: Slave, kind: Kind, references: References, values: FloatArray, texts: Texts) -> None:
    """Set variables of one kind from an array of shape (n,); raises `CallFailed`."""
    if kind == Kind.REAL:
        slave.set_real(references, values)
    elif kind == Kind.INTEGER:
        slave.set_integer(references, [int(v) for v in values])
    elif kind == Kind.BOOLEAN:
        slave.set_boolean(references, [bool(v) for v in values])
    else:
        slave.set_string(references, [texts.text(v) for v in values])


def write_variables(slave: Slave, values: Sequence[tuple[ScalarVariable, Scalar]]) -> None:
    """Set variables of any type, one call a kind; raises `CallFailed`."""
    for kind in Kind:
        mine = [(v.value_reference, value) for v, value in values if kind_of(v) == kind]
        references = tuple(reference for reference, _ in mine)
        if not mine:
            continue
        if kind == Kind.REAL:
            slave.set_real(references, np.array([float(value) for _, value in mine]))
        elif kind == Kind.INTEGER:
            slave.set_integer(references, [int(value) for _, value in mine])
        elif kind == Kind.BOOLEAN:
            slave.set_boolean(references, [bool(value) for _, value in mine])
        else:
            slave.set_string(references, [str(value).encode() for _, value in mine])


def read_groups(slave: Slave, groups: Sequence[Group], values: FloatArray, texts: Texts) -> None:
    """Read groups of variables into their slots of a vector; raises `CallFailed`."""
    for group in groups:
        values[group.slots] = read(slave, group.kind, group.references, texts)


def write_inputs(slave: Slave, inputs: Inputs, given: FloatArray, texts: Texts) -> None:
    """Set all inputs of a component; `given` has shape (n,) in the order of its links. Raises `CallFailed`."""
    at = 0
    for group in inputs.groups:
        n = len(group.references)
        write(slave, group.kind, group.references, given[at : at + n], texts)
        at += n


def refuse_values(inputs: Inputs, given: FloatArray, t: float, known: BoolArray | None = None) -> None:
    """Raise `ValueRefused` for an input that cannot take what it is given at `t` s; `known`: which are given at all."""
    for i, values in inputs.allowed.items():
        if given[i] not in values and (known is None or known[i]):
            raise refusal(inputs, i, float(given[i]), t)


def refusal(inputs: Inputs, place: int, value: float, t: float) -> ValueRefused:
    """Return why an input, by its place, does not take a value."""
    link = inputs.links[place]
    return ValueRefused(str(link.target), str(link.source), value, inputs.allowed[place], t)
