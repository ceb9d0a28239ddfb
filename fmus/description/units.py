"""Units as FMUs define them: conversion by BaseUnit exponents, factor and offset, and by DisplayUnit.

FMI 2.0: value in SI = factor * value + offset (BaseUnit); displayed value = factor * value + offset (DisplayUnit).
"""

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

EXPONENTS = ("kg", "m", "s", "A", "K", "mol", "cd", "rad")
"""Order of the base units in `BaseUnit.exponents`."""


@dataclass(frozen=True)
class Conversion:
    """new = factor * old + offset."""

    factor: float = 1.0
    offset: float = 0.0

    def __call__(self, value: float) -> float:
        """Convert one value."""
        return self.factor * value + self.offset

    def then(self, other: "Conversion") -> "Conversion":
        """Return this conversion followed by another."""
        return Conversion(other.factor * self.factor, other.factor * self.offset + other.offset)

    @property
    def inverse(self) -> "Conversion":
        """The way back."""
        return Conversion(1.0 / self.factor, -self.offset / self.factor)


IDENTITY = Conversion()


@dataclass(frozen=True)
class BaseUnit:
    """Dimension of a unit (exponents in the order of `EXPONENTS`) and the way to its SI unit."""

    exponents: tuple[int, ...]
    to_si: Conversion = IDENTITY


@dataclass(frozen=True)
class Unit:
    """A unit of a modelDescription; without `base` it is comparable to nothing but its own name."""

    name: str
    base: BaseUnit | None = None
    display: Mapping[str, Conversion] = field(default_factory=dict)


def spelled(unit: str) -> str:
    """Return a unit's name with ^ before an exponent in brackets, as other tools read it; it was once left out."""
    return re.sub(r"(?<=[A-Za-z])\((\d+/\d+)\)", r"^(\1)", unit)


def conversion(
    source: str | None, target: str | None, source_units: Mapping[str, Unit], target_units: Mapping[str, Unit]
) -> Conversion | None:
    """Return how a value in `source` becomes one in `target`, or None if the dimensions differ.

    Equal names pass. An end without any unit passes too: FMI makes units optional and there is nothing to compare.
    """
    if source is None or target is None or spelled(source) == spelled(target):
        return IDENTITY
    return _between(source_units.get(source), target_units.get(target))


def resolve(unit: str, target: str | None, definitions: Iterable[Mapping[str, Unit]]) -> Conversion | None:
    """Return how a user's value in `unit` becomes one in the variable's unit `target`, or None if it cannot.

    `definitions` are the units of all FMUs of the system, those of the variable's own FMU first. A name is looked for
    as the target itself, among the target's display units, among all units, then among all their display units.
    """
    if target is None:
        return None
    unit = spelled(unit)
    if unit == spelled(target):
        return IDENTITY
    tables = list(definitions)
    targets = [table[target] for table in tables if target in table]
    for known in targets:
        if unit in known.display:
            return known.display[unit].inverse
    for table in tables:
        for known in table.values():
            shown = known.display.get(unit)
            to_known = IDENTITY if known.name == unit else shown.inverse if shown is not None else None
            if to_known is None:
                continue
            for goal in targets:
                onwards = IDENTITY if known.name == goal.name else _between(known, goal)
                if onwards is not None:
                    return to_known.then(onwards)
    return None


def names_like(target: str | None, definitions: Iterable[Mapping[str, Unit]]) -> list[str]:
    """Return the names of units that `resolve` can bring to `target`, for messages."""
    tables = list(definitions)
    known = {name for table in tables for unit in table.values() for name in (unit.name, *unit.display)}
    return sorted(name for name in known if resolve(name, target, tables) is not None)


def _between(source: Unit | None, target: Unit | None) -> Conversion | None:
    if source is None or target is None or source.base is None or target.base is None:
        return None
    if source.base.exponents != target.base.exponents:
        return None
    a, b = source.base.to_si, target.base.to_si
    return Conversion(a.factor / b.factor, (a.offset - b.offset) / b.factor)
