"""From a system structure to a flat system: instances, connections between FMUs, values of their variables.

An instance in a system within is named with the systems that it lies in, `arm/motor`: a dot ends an instance's name
here. Of values, those of a higher system win over those of a lower one, later bindings over earlier ones.
"""

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any

from cosim.errors import UnknownName
from cosim.ssp.model import INTO, TYPES, Assignment, Component, Connector, Node
from cosim.ssp.wires import Address, Measure, Wires, written
from cosim.system import Connection
from fmus.description.description import ModelDescription, Scalar
from fmus.description.units import IDENTITY, Conversion, conversion

SEPARATOR = "/"

Path = tuple[str, ...]


@dataclass
class Flat:
    """A flat system; `values`: (instance, scalar variable) -> value in its own unit, those of inputs among them.

    `links`: one for each connection of two variables. `ignored`: names of parameter sets that nothing has.
    """

    components: dict[str, str] = field(default_factory=dict)
    descriptions: dict[str, ModelDescription] = field(default_factory=dict)
    links: list[Connection] = field(default_factory=list)
    values: dict[tuple[str, str], Scalar] = field(default_factory=dict)
    ignored: list[str] = field(default_factory=list)
    mistakes: list[str] = field(default_factory=list)


def flatten(system: Node, describe: Callable[[str], ModelDescription]) -> Flat:
    """Return the flat system; `describe`: reference of an FMU -> its description."""
    return _Flattening(system, describe).flat


class _Flattening:
    def __init__(self, system: Node, describe: Callable[[str], ModelDescription]) -> None:
        self.flat = Flat()
        self.names: dict[Path, str] = {}
        self.leaves = dict(_leaves((), system))
        for path, component in self.leaves.items():
            self._enter(path, component, describe)
        descriptions = {path: self.flat.descriptions[name] for path, name in self.names.items()}
        self.descriptions = descriptions
        self.wires = Wires(system, descriptions)
        for path, component in self.leaves.items():
            for connector in component.connectors.values():
                self._check(path, connector, descriptions[path])
        if not self.flat.mistakes and not self.wires.mistakes:
            self._link()
            self._assign((), system)
        self.flat.mistakes += self.wires.mistakes

    def _enter(self, path: Path, component: Component, describe: Callable[[str], ModelDescription]) -> None:
        name = SEPARATOR.join(re.sub(r"[.*?\[\]/\s]", "_", part) for part in path)
        if name in self.flat.components:
            other = next(".".join(p) for p, n in self.names.items() if n == name)
            self.flat.mistakes.append(f"{'.'.join(path)} and {other} would have one name here, {name}: rename one")
        self.names[path] = name
        self.flat.components[name] = component.fmu
        self.flat.descriptions[name] = describe(component.fmu)

    def _check(self, path: Path, connector: Connector, fmu: ModelDescription) -> None:
        """Hold a connector against the variable of the FMU that it stands for."""
        name = written((path, connector.name))
        try:
            found = fmu.find(connector.name, "variable", f"the FMU of {'.'.join(path)}")
        except UnknownName as error:
            self.flat.mistakes.append(str(error))
            return
        first = fmu.variables[found.elements[0]]
        if connector.kind in ("input", "output", "parameter", "calculatedParameter"):
            if connector.kind != first.causality:
                both = f"is of kind {connector.kind}, but its variable of causality {first.causality}"
                self.flat.mistakes.append(f"the connector {name} {both}")
        if connector.type and connector.type != TYPES.get(first.type, first.type):
            self.flat.mistakes.append(f"the connector {name} is {connector.type}, but its variable {first.type}")
        if connector.shape and not _fits(connector.shape, found.shape):
            sizes = " x ".join("?" if n is None else str(n) for n in connector.shape)
            both = f"{sizes} elements, but its variable {' x '.join(map(str, found.shape)) or '1'}"
            self.flat.mistakes.append(f"the connector {name} has {both}")
        units = connector.unit, first.unit
        defined = self.wires.units((path, connector.name))
        if None not in units and conversion(*units, defined, fmu.units) != IDENTITY:
            self.flat.mistakes.append(f"the connector {name} has unit {units[0]}, but its variable {units[1]}")

    def _link(self) -> None:
        """Make a connection of each way from FMU to FMU."""
        for path, component in self.leaves.items():
            for connector in component.connectors.values():
                target = path, connector.name
                found = self.wires.traced(target) if connector.kind in INTO else None
                if found is None:
                    continue
                source, how = found
                if connector.kind == "parameter":
                    both = f"{written(source)} -> {written(target)}"
                    self.flat.mistakes.append(f"the connection {both} is of parameters, which is not implemented here")
                    continue
                self.flat.links.append(self._connection(source, target, how))

    def _connection(self, source: Address, target: Address, how: Conversion) -> Connection:
        """Return a connection, with factor and offset where they are not what the units of its ends say."""
        ends = [self.descriptions[a[0]] for a in (source, target)]
        found = [fmu.find(a[1], "variable", "") for fmu, a in zip(ends, (source, target), strict=True)]
        if len(found[0].elements) != len(found[1].elements):
            sizes = " elements with ".join(str(len(group.elements)) for group in found)
            self.flat.mistakes.append(f"the connection {written(source)} -> {written(target)} joins {sizes}")
        first = [fmu.variables[group.elements[0]] for fmu, group in zip(ends, found, strict=True)]
        names = [f"{self.names[a[0]]}.{a[1]}" for a in (source, target)]
        usual = conversion(first[0].unit, first[1].unit, ends[0].units, ends[1].units)
        if how == usual:
            return Connection(names[0], names[1])
        if {v.type for v in first} != {"Real"}:
            both = f"{written(source)} -> {written(target)}"
            self.flat.mistakes.append(f"the connection {both} has a linear transformation, but is not of Real values")
        return Connection(names[0], names[1], factor=how.factor, offset=how.offset)

    # ---- values --------------------------------------------------------------------------------------------------

    def _assign(self, path: Path, element: Component | Node) -> None:
        """Apply the bindings of the elements within, then those of this one, which win."""
        if isinstance(element, Node):
            for name, inner in element.elements.items():
                self._assign((*path, name), inner)
        for assignment in element.assignments:
            targets = list(self._meant(path, element, assignment.name))
            if not targets:
                self.flat.ignored.append(written((path, assignment.name)))
            for target in targets:
                self._give(target, assignment)

    def _meant(self, path: Path, element: Component | Node, name: str) -> Iterator[Address]:
        """Yield what a hierarchical name means: all that have it."""
        if isinstance(element, Component):
            fmu = self.descriptions[path]
            try:
                fmu.find(name, "variable", "")
            except UnknownName:
                return
            yield path, name
            return
        if name in element.connectors:
            yield path, name
        for inner, child in element.elements.items():
            if name.startswith(f"{inner}."):
                yield from self._meant((*path, inner), child, name[len(inner) + 1 :])

    def _give(self, target: Address, given: Assignment) -> None:
        """Give a value to a variable, or to a connector and all that it goes on to."""
        name = written(target)
        how = given.transformation
        value = given.value
        if how is not None and not how.is_linear:
            value = self._looked_up(value, given, name)
        measure = Measure(given.unit, given.units) if given.unit is not None else self.wires.measure(target)
        here = self.wires.measure(target)
        if how is not None and how.is_linear and given.type != "Real":
            self.flat.mistakes.append(f"the parameter {name} is {given.type}: a linear transformation is for Real")
            return
        found, measure = self.wires.converted(
            measure, here, given.suppress_unit_conversion, how, f"the parameter {name}"
        )
        self._spread(target, _changed(value, found), measure)

    def _looked_up(self, value: Any, given: Assignment, name: str) -> Any:
        """Return a value, or each of a list, by the table of a transformation."""
        if isinstance(value, list):
            return [self._looked_up(v, given, name) for v in value]
        assert given.transformation is not None
        text = {True: "true", False: "false"}[value] if isinstance(value, bool) else str(value)
        table = {_plain(a, given.type): b for a, b in given.transformation.table.items()}
        if text not in table:
            there = ", ".join(table)
            self.flat.mistakes.append(f"the parameter {name} is {text}, its mapping knows {there}")
            return value
        new = _plain(table[text], given.type)
        return new == "true" if given.type == "Boolean" else int(new) if given.type == "Integer" else new

    def _spread(self, target: Address, value: Any, measure: Measure) -> None:
        if target[0] in self.descriptions:
            self._keep(target, value)
            return
        connector = self.wires.connector(target)
        if connector.kind not in INTO:
            what = f"the parameter {written(target)} sets a connector of kind {connector.kind} of a system"
            self.flat.mistakes.append(f"{what}, which is not implemented here")
            return
        for hop in self.wires.out_of.get(target, ()):
            if hop.target[0][: len(target[0])] == target[0] and hop.target[0] != target[0]:  # goes on inwards
                found, onwards = self.wires.passed(hop, measure)
                self._spread(hop.target, _changed(value, found), onwards)

    def _keep(self, target: Address, value: Any) -> None:
        elements = self.descriptions[target[0]].find(target[1], "variable", "").elements
        values = value if isinstance(value, list) else [value]
        if len(values) != len(elements):
            self.flat.mistakes.append(f"the parameter {written(target)} has {len(values)} values, not {len(elements)}")
            return
        for element, one in zip(elements, values, strict=True):
            self.flat.values[self.names[target[0]], element] = one


def _leaves(path: Path, node: Node) -> Iterator[tuple[Path, Component]]:
    for name, element in node.elements.items():
        if isinstance(element, Node):
            yield from _leaves((*path, name), element)
        else:
            yield (*path, name), element


def _fits(said: tuple[int | None, ...], shape: tuple[int, ...]) -> bool:
    return len(said) == len(shape) and all(n in (None, size) for n, size in zip(said, shape, strict=True))


def _changed(value: Any, how: Conversion) -> Any:
    if isinstance(value, list):
        return [_changed(v, how) for v in value]
    return value if how == IDENTITY else how(value)


def _plain(text: str, kind: str) -> str:
    """Return a boolean or a whole number as it is written here."""
    if kind == "Boolean":
        return {"1": "true", "0": "false"}.get(text, text)
    return str(int(text)) if kind == "Integer" else text
