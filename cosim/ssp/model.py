"""A system structure as its files say it: systems within systems, connectors, connections, values that are bound."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from fmus.description.description import Scalar
from fmus.description.units import Unit

INTO, OUT_OF = ("input", "parameter"), ("output", "calculatedParameter")
"""Kinds of connectors that an element takes values by, and that it gives them by."""

TYPES = {
    "Real": "Real",
    "Float64": "Real",
    "Float32": "Real",
    **dict.fromkeys(("Integer", "Int8", "UInt8", "Int16", "UInt16", "Int32", "UInt32", "Int64", "UInt64"), "Integer"),
    "Boolean": "Boolean",
    "String": "String",
    "Enumeration": "Enumeration",
}
"""Types of SSP 1.0 and 2.0, and what they are in FMI 2.0."""


@dataclass(frozen=True)
class Transformation:
    """What a value becomes: factor * value + offset, or by a table of texts; `kind` is the element's name."""

    kind: str
    factor: float = 1.0
    offset: float = 0.0
    table: Mapping[str, str] = field(default_factory=dict)

    @property
    def is_linear(self) -> bool:
        """Whether it is a factor and an offset."""
        return self.kind == "LinearTransformation"

    @property
    def changes_nothing(self) -> bool:
        """Whether every value that it takes stays as it is."""
        return self.factor == 1.0 and self.offset == 0.0 and all(a == b for a, b in self.table.items())


@dataclass(frozen=True)
class Connector:
    """A connector; `type` of FMI 2.0, "" where it says none; `unit` None likewise.

    `shape`: sizes of its dimensions, None each that it does not say itself; () for a scalar.
    """

    name: str
    kind: str
    type: str = ""
    unit: str | None = None
    shape: tuple[int | None, ...] = ()


@dataclass(frozen=True)
class Edge:
    """A connection as it is written: start and end are (element, connector), the element "" for the system's own."""

    start: tuple[str, str]
    end: tuple[str, str]
    transformation: Transformation | None = None
    suppress_unit_conversion: bool = False

    def __str__(self) -> str:
        """Write "a.y -> b.u"."""
        return " -> ".join(".".join(part for part in end if part) for end in (self.start, self.end))


@dataclass(frozen=True)
class Assignment:
    """A value that a binding gives to the variable `name` of its element; `unit` as `units` define it, None: none said.

    The value is a text for an Enumeration, a list where it is an array, row by row.
    """

    name: str
    value: Scalar | list[Scalar]
    type: str
    unit: str | None = None
    units: Mapping[str, Unit] = field(default_factory=dict)
    transformation: Transformation | None = None
    suppress_unit_conversion: bool = False


@dataclass(frozen=True)
class Component:
    """An element that is an FMU; `fmu` is the reference of its file."""

    name: str
    connectors: Mapping[str, Connector]
    assignments: tuple[Assignment, ...]
    fmu: str


@dataclass(frozen=True)
class Node:
    """An element that is a system; `units`: of the description that it is written in."""

    name: str
    connectors: Mapping[str, Connector]
    assignments: tuple[Assignment, ...]
    elements: Mapping[str, "Component | Node"]
    edges: tuple[Edge, ...]
    units: Mapping[str, Unit]


@dataclass(frozen=True)
class Structure:
    """A whole description: its top system, the DefaultExperiment's times in s, the text of our own annotation."""

    name: str
    system: Node
    start_time: float | None = None
    stop_time: float | None = None
    annotation: Mapping[str, str] | None = None
