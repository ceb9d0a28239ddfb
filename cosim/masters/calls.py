"""Reading and writing groups of variables of any kind, as doubles in a vector of slots."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

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


@dataclass(frozen=True)
class Assignment:
    """Variables of one component and kind, each with its value."""

    kind: Kind
    references: References
    values: tuple[Scalar, ...]


def assignments(values: Iterable[tuple[ScalarVariable, Scalar]]) -> tuple[Assignment, ...]:
    """Return values of variables of one component, in groups that are set in one call."""
    given = [(kind_of(variable), variable.value_reference, value) for variable, value in values]
    return tuple(
        Assignment(kind, tuple(r for k, r, _ in given if k == kind), tuple(v for k, _, v in given if k == kind))
        for kind in sorted({k for k, _, _ in given})
    )


def assign(slave: Slave, groups: Sequence[Assignment]) -> None:
    """Set variables of any type; raises `CallFailed`."""
    for group in groups:
        if group.kind == Kind.REAL:
            slave.set_real(group.references, np.array(group.values, dtype=np.float64))
        elif group.kind == Kind.INTEGER:
            slave.set_integer(group.references, [int(value) for value in group.values])
        elif group.kind == Kind.BOOLEAN:
            slave.set_boolean(group.references, [bool(value) for value in group.values])
        else:
            slave.set_string(group.references, [str(value).encode() for value in group.values])


def read_groups(slave: Slave, groups: Sequence[Group], values: FloatArray, texts: Texts) -> None:
    """Read groups of variables into their slots of a vector; raises `CallFailed`."""
    for group in groups:
        values[group.slots] = read(slave, group.kind, group.references, texts)


def refuse_values(inputs: Inputs, given: FloatArray, t: float, known: BoolArray | None = None) -> None:
    """Raise `ValueRefused` for an input that cannot take what it is given at `t` s; `known`: which are given at all."""
    for i, values in inputs.allowed.items():
        if given[i] not in values and (known is None or known[i]):
            raise refusal(inputs, i, float(given[i]), t)


def refusal(inputs: Inputs, place: int, value: float, t: float) -> ValueRefused:
    """Return why an input, by its place, does not take a value."""
    link = inputs.links[place]
    return ValueRefused(str(link.target), str(link.source), value, inputs.allowed[place], t)
