"""What is recorded of a run: which variables, under which names, units and types, and from which slots."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from typing import Literal

import numpy as np

from cosim.arrays import FloatArray, IntArray
from cosim.errors import UnknownName
from cosim.system.wiring import Port, Wiring
from fmus.description.description import ScalarVariable, Type
from fmus.description.names import canonical, split_element

ColumnType = Type | Literal["Long"]
"""How a column is recorded; Long: an integer of FMI 3.0 that may have more than 32 bits with a sign."""

FLAG = 0.5
"""A flag is up where it is above this, half way between its values 0 and 1."""


@dataclass(frozen=True, eq=False)
class Columns:
    """The recorded columns; `units` are None where an FMU gives none, `items` of no enumeration are None."""

    names: tuple[str, ...]
    units: tuple[str | None, ...]
    types: tuple[ColumnType, ...]
    items: tuple[Mapping[str, int] | None, ...]
    slots: IntArray

    @classmethod
    def of(cls, wiring: Wiring, ports: Sequence[Port], slots: Mapping[Port, int]) -> "Columns":
        """Return the columns of some variables, which have slots."""
        variables = [wiring.variable(port) for port in ports]
        return cls(
            names=tuple(map(str, ports)),
            units=tuple(v.unit for v in variables),
            types=tuple(_type(v) for v in variables),
            items=tuple(v.items if v.type == "Enumeration" else None for v in variables),
            slots=np.array([slots[port] for port in ports], dtype=np.int64),
        )

    def row(self, values: FloatArray) -> FloatArray:
        """Return the recorded columns of a vector of slots, shape (n,)."""
        return values[self.slots]


def _type(variable: ScalarVariable) -> ColumnType:
    long = variable.element is not None and variable.element.type in ("UInt32", "Int64", "UInt64")
    return "Long" if long else variable.type


def recorded(wiring: Wiring, patterns: Sequence[str]) -> list[Port]:
    """Return the variables that the patterns choose, in the order of declaration.

    A pattern is matched with whole arrays and elements of inputs and outputs; any other variable must be named in
    full. Raises `UnknownName` for a pattern without match.
    """
    unmatched = {p for p in patterns if p != "*"}
    ports: list[Port] = []
    known: list[str] = []
    for component, description in wiring.fmus.items():
        known += [f"{component}.{base}" for base in description.groups]
        for variable in description.variables.values():
            names = {f"{component}.{variable.name}", f"{component}.{split_element(variable.name)[0]}"}
            exchanged = variable.causality in ("input", "output")
            matching = {p for p in patterns if any(matches(p, name, exchanged) for name in names)}
            unmatched -= matching
            if matching:
                ports.append(Port(component, variable.name))
    for pattern in sorted(unmatched):
        raise UnknownName("variable", pattern, "record", known)
    return ports


def matches(pattern: str, name: str, exchanged: bool) -> bool:
    """Whether a pattern chooses a variable by a name of it; one that is not `exchanged` must be named in full."""
    if canonical(pattern) == name:
        return True
    return exchanged and fnmatchcase(name, pattern.replace("[", "[[]"))


def flag(wiring: Wiring, name: str) -> Port:
    """Return the output that a name means, a number of any type; raises `UnknownName`."""
    outputs = [
        Port(component, v.name)
        for component, description in wiring.fmus.items()
        for v in description.outputs
        if v.type != "String"
    ]
    for port in outputs:
        if str(port) == canonical(name):
            return port
    raise UnknownName("output", name, "stop_when", list(map(str, outputs)))
