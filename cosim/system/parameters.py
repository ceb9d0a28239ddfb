"""Parameters, vehicle values and held inputs of a system, turned into values of single variables in their own units."""

import math
import re
from collections.abc import Iterator, Mapping
from typing import Any

from cosim.errors import ParameterError, SimulationError, UnknownName
from cosim.quantity import advice_on_numbers
from cosim.system.system import System
from cosim.system.value import Value, plain
from cosim.system.wiring import Port
from fmus.description import units
from fmus.description.arrays import range_of
from fmus.description.description import ModelDescription, Scalar, ScalarVariable
from fmus.description.names import Group, did_you_mean, split_element, split_port

WORDS = ("String", "Enumeration", "Boolean")
"""Types whose values may be words: of a text, what was written counts."""

EXACT = 2**53
"""The largest whole number up to which all are doubles, as values that are exchanged are."""

Settings = Mapping[Port, Scalar]
"""Values of single variables in their own units."""

Entry = tuple[str, str, str, str | None]
"""An entry of a system's vehicle or parameters: which of them, name, and the value as Python and as a text."""

NONE: Mapping[Entry, Settings] = {}


class Parameters:
    """Resolves names and values of a system; every mistake is put into `mistakes` instead of raised.

    `known`: what entries have come to before, for the same descriptions; `resolved` has it of all that are right.
    """

    def __init__(
        self, system: System, descriptions: Mapping[str, ModelDescription], known: Mapping[Entry, Settings] = NONE
    ) -> None:
        self.system = system
        self.descriptions = descriptions
        self.mistakes: list[SimulationError] = []
        self._known, self.resolved = known, dict[Entry, Settings]()

    def settings(self) -> dict[Port, Scalar]:
        """Return what is set before initialization: vehicle values, then "*.name", then arrays, then elements."""
        result: dict[Port, Scalar] = {}
        for name, value in self.system.vehicle.items():
            result |= self._entry("vehicle", name, value)
        for key in sorted(self.system.parameters, key=_specificity):
            result |= self._entry("parameters", key, self.system.parameters[key])
        return result

    def _entry(self, where: str, key: str, value: Any) -> Settings:
        entry = where, key, repr(value), value.text if isinstance(value, Value) else None
        found, mistakes = self._known.get(entry), len(self.mistakes)
        if found is None:
            found = self._resolve(where, key, value)
        if len(self.mistakes) == mistakes:
            self.resolved[entry] = found
        return found

    def _resolve(self, where: str, key: str, value: Any) -> Settings:
        if where == "vehicle":
            return self._everywhere(key, value, where, only_parameters=True)
        component, name = split_port(key)
        if component == "*":
            return self._everywhere(name, value, where, only_parameters=False)
        if component not in self.descriptions:
            self.mistakes.append(UnknownName("component", component, f'parameter "{key}"', list(self.descriptions)))
            return {}
        return self._set(component, name, value)

    def held(self) -> dict[Port, Scalar]:
        """Return the values of held inputs."""
        result: dict[Port, Scalar] = {}
        for key, value in self.system.held.items():
            component, name = split_port(key)
            description = self.descriptions.get(component)
            if description is None:
                self.mistakes.append(UnknownName("component", component, f'held "{key}"', list(self.descriptions)))
                continue
            group = self._find(component, name, "input")
            if group is None:
                continue
            if description.variables[group.elements[0]].causality != "input":
                self.mistakes.append(
                    ParameterError(key, "it is held, but it is no input. Inputs: " + _inputs(description))
                )
                continue
            values = self._values(component, group, name, value)
            for port in [port for port, v in values.items() if isinstance(v, int) and abs(v) > EXACT]:
                problem = f"the value {values.pop(port)} is beyond 2^53, up to which all are exact"
                self.mistakes.append(ParameterError(str(port), problem))
            result |= values
        return result

    def _everywhere(self, name: str, value: Any, where: str, *, only_parameters: bool) -> dict[Port, Scalar]:
        """Set every component that has it: a parameter, or for "*.name" an initial state too."""
        result: dict[Port, Scalar] = {}
        base = split_element(name)[0]
        known: list[str] = []
        found = False
        for component, description in self.descriptions.items():
            here = [b for b, g in description.groups.items() if _settable(description, g, only_parameters)]
            known += here
            if base in here or name in here:
                found = True
                result |= self._set(component, name, value)
        if not found:
            self.mistakes.append(UnknownName("parameter", name, f"{where} of any component", sorted(set(known))))
        return result

    def _set(self, component: str, name: str, value: Any) -> dict[Port, Scalar]:
        group = self._find(component, name, "parameter")
        if group is None:
            return {}
        description = self.descriptions[component]
        if not _settable(description, group, False):
            causality = description.variables[group.elements[0]].causality
            advice = f'hold it: held={{"{component}.{name}": ...}}' if causality == "input" else "it cannot be set"
            self.mistakes.append(ParameterError(f"{component}.{name}", f"it is {_article(causality)}: {advice}"))
            return {}
        return self._sized(component, self._values(component, group, name, value))

    def _sized(self, component: str, values: dict[Port, Scalar]) -> dict[Port, Scalar]:
        """Refuse a structural parameter that would change the size of an array: sizes are those of its start value."""
        description = self.descriptions[component]
        kept: dict[Port, Scalar] = {}
        for port, value in values.items():
            start, arrays = description.variables[port.variable].start, description.sizes.get(port.variable)
            if arrays is None:
                kept[port] = value
            elif value != start:
                problem = f"{', '.join(arrays)} take their size from it, which is that of its start value {start}"
                self.mistakes.append(ParameterError(str(port), f"{problem}: it cannot be {value} here"))
        return kept

    def _find(self, component: str, name: str, kind: str) -> Group | None:
        description = self.descriptions[component]
        try:
            return description.find(name, kind, f'component "{component}"')
        except UnknownName as error:
            wanted = [
                base
                for base, g in description.groups.items()
                if (description.variables[g.elements[0]].causality == "input") == (kind == "input")
                and (kind == "input" or _settable(description, g, False))
            ]
            element = error.kind == "element"  # of an array that is there
            self.mistakes.append(error if element else UnknownName(kind, error.name, error.where, wanted))
            return None

    def _values(self, component: str, group: Group, name: str, value: Any) -> dict[Port, Scalar]:
        full = f"{component}.{name}"
        variables = [self.descriptions[component].variables[e] for e in group.elements]
        given = value if isinstance(value, Value) else Value(value)
        one = not isinstance(given.value, list) or (group.shape == () and variables[0].type == "String")
        words = given.text is not None and one
        numbers = given.text if words and variables[0].type in WORDS else plain(given.value)
        if isinstance(numbers, str) and variables[0].type == "Real":
            advice = advice_on_numbers(numbers)
            problem = f"it is Real, the value {numbers!r} is no number and no list of numbers{advice}"
            self.mistakes.append(ParameterError(full, problem))
            return {}
        shape = shape_of(numbers)
        if shape == () and len(group.shape) == 1:
            numbers, shape = [numbers] * group.shape[0], group.shape
        if shape != group.shape:
            self.mistakes.append(ParameterError(full, f"it is {_words(group.shape)}, the value is {_words(shape)}"))
            return {}
        result: dict[Port, Scalar] = {}
        try:
            convert = self.conversion(component, variables[0], None if words and numbers == given.text else given.unit)
            for variable, number in zip(variables, _flat(numbers), strict=True):
                result[Port(component, variable.name)] = _checked(variable, number, convert)
        except ValueError as error:
            self.mistakes.append(ParameterError(full, str(error)))
            return {}
        return result

    def conversion(self, component: str, variable: ScalarVariable, unit: str | None) -> units.Conversion:
        """Return how a value in a unit becomes one of a variable, None: in its own; raises ValueError."""
        if unit is None:
            return units.IDENTITY
        own = self.descriptions[component].units
        tables = [own, *(i.units for i in self.descriptions.values())]
        found = units.resolve(unit, variable.unit, tables)
        if found is None:
            known = ", ".join(units.names_like(variable.unit, tables)) or "none"
            target = f"unit {variable.unit}" if variable.unit is not None else "no unit"
            meant = did_you_mean(unit, units.names_like(variable.unit, tables))
            text = f"it has {target}, the value has unit {unit}, which cannot be converted.{meant} Units: {known}"
            raise ValueError(text)
        return found


def _specificity(key: str) -> int:
    component, name = split_port(key)
    return 0 if component == "*" else 2 if split_element(name)[1] else 1


def _settable(description: ModelDescription, group: Group, only_parameters: bool) -> bool:
    variable = description.variables[group.elements[0]]
    only = variable.causality in ("parameter", "structuralParameter")
    return only or (variable.is_parameter and not only_parameters)


def _checked(variable: ScalarVariable, value: Any, convert: units.Conversion) -> Scalar:
    """Return the value as the variable's type; raises ValueError for a wrong type or a number that is not finite."""
    wrong = ValueError(f"it is {variable.type}, the value {value!r} is {type(value).__name__}")
    if variable.type == "String":
        if not isinstance(value, str):
            raise ValueError(f"{wrong}. Write it in quotes: '\"{value}\"'")
        return value
    if variable.type == "Enumeration":
        return _item(variable, value)
    if variable.type == "Boolean":
        known = {"true": True, "True": True, "1": True, "false": False, "False": False, "0": False}
        if str(value) not in known:
            raise ValueError(f"{wrong}. Write true, false, 1 or 0")
        return known[str(value)]
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise ValueError(f"{wrong}{advice_on_numbers(value)}") if isinstance(value, str) else wrong
    if variable.type == "Real":
        return _real(value, convert)
    if isinstance(value, float) and not math.isfinite(value):
        raise ValueError(f"the value {value} is not finite")
    if int(value) != value:
        raise wrong
    kind = "Integer of FMI 2.0" if variable.element is None else variable.element.type
    least, largest = range_of(kind)
    if not least <= value <= largest:
        raise ValueError(f"the value {value} is beyond {_article(kind)}, {least} to {largest}")
    return int(value)


def _real(value: int | float, convert: units.Conversion) -> float:
    try:
        number = float(value) if convert == units.IDENTITY else convert(float(value))
    except OverflowError as error:
        raise ValueError("the value is beyond a double, 1.8e308") from error
    if not math.isfinite(number):
        raise ValueError(f"the value {value} is not finite")
    return number


def _item(variable: ScalarVariable, value: Any) -> int:
    """Return the number of an enumeration's item, given by its literal or its number; raises ValueError."""
    items = dict(variable.items or {})
    if isinstance(value, str) and value in items:
        return items[value]
    number = value if isinstance(value, int) else int(value) if re.fullmatch(r"[-+]?\d+", str(value)) else None
    if number is None or isinstance(value, bool) or (items and number not in items.values()):
        there = ", ".join(f"{literal} ({n})" for literal, n in items.items()) or "any whole number"
        raise ValueError(f"it has no item {value!r}.{did_you_mean(str(value), items)} There: {there}")
    return number


def shape_of(value: Any) -> tuple[int, ...] | None:
    """Return the shape of a nested list, () of a scalar, None of a ragged list."""
    if not isinstance(value, list):
        return ()
    shapes = {shape_of(v) for v in value}
    if len(shapes) != 1:
        return None
    inner = shapes.pop()
    return None if inner is None else (len(value), *inner)


def _flat(value: Any) -> Iterator[Any]:
    if isinstance(value, list):
        for v in value:
            yield from _flat(v)
    else:
        yield value


def _words(shape: tuple[int, ...] | None) -> str:
    if shape is None:
        return "a ragged list"
    if shape == ():
        return "a scalar"
    return f"a {'vector' if len(shape) == 1 else 'matrix'} of {' x '.join(map(str, shape))}"


def _article(causality: str) -> str:
    return f"{'an' if causality[0].lower() in 'aeiou' else 'a'} {causality}"


def _inputs(description: ModelDescription) -> str:
    return ", ".join(description.base_names("input")) or "none"
