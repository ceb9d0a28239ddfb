"""SystemStructure.ssd as data: what it refers to is read with it, be it another .ssd or another package."""

import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

from cosim.ssp.errors import SspError
from cosim.ssp.model import TYPES, Assignment, Component, Connector, Edge, Node, Structure
from cosim.ssp.own import NAMESPACE, TYPE
from cosim.ssp.package import STRUCTURE, Package
from cosim.ssp.values import Place, bound, read_units, transformation_of
from cosim.ssp.xml import SSC, SSD, Element, parse

FMU = "application/x-fmu-sharedlibrary"
DEFINITION, PACKAGE = "application/x-ssp-definition", "application/x-ssp-package"
DEEPEST = 50
"""References within one another; nesting in one file is limited by the parser."""

MOST = 100_000
"""Elements in all: ten references a level make 10^10 on ten levels."""


def read_structure(package: Package, name: str = STRUCTURE) -> Structure:
    """Read a system structure description of a package, and all that it is made of; raises `SspError`."""
    if name not in package.names:
        there = ", ".join(sorted(n for n in package.names if n.lower().endswith(".ssd"))) or "none"
        cut = "modelDescription.xml" in package.names  # the last file that is left
        hint = ". It has the files of an FMU: it is one, or it was cut" if cut else f". Descriptions: {there}"
        raise SspError(package.label, [f"there is no {name} at its top, which a system needs{hint}"])
    root = parse(package.text(name), f"{{{SSD}}}SystemStructureDescription", f"{package.label}#{name}")
    system = _Reader(package, name, root, itertools.count()).top()
    experiment = root.find(f"{{{SSD}}}DefaultExperiment")
    times = [None if experiment is None else experiment.get(name) for name in ("startTime", "stopTime")]
    seconds = [None if text is None else float(text) for text in times]
    return Structure(root.get("name", ""), system, seconds[0], seconds[1], _annotation(root))


def _annotation(root: Element) -> dict[str, str] | None:
    """Return the parts of our own annotation, element -> text, None where there is none."""
    for annotation in root.iterfind(f"{{{SSD}}}Annotations/{{{SSC}}}Annotation"):
        if annotation.get("type") == TYPE:
            for own in annotation.iterfind(f"{{{NAMESPACE}}}Flight"):
                parts = {str(part.tag).rpartition("}")[2]: part.text or "" for part in own}
                return {**parts, "version": own.get("version", "")}
    return None


@dataclass(frozen=True)
class _Reader:
    """Reads one .ssd; `above`: what this one is read within, which it must not hold again; `count`: of all elements."""

    package: Package
    file: str
    root: Element
    count: Iterator[int]
    above: tuple[str, ...] = ()

    @property
    def label(self) -> str:
        return f"{self.package.label}#{self.file}"

    def top(self) -> Node:
        system = self.root.find(f"{{{SSD}}}System")
        assert system is not None  # the schema says so
        return self.node(system)

    def node(self, element: Element) -> Node:
        name = element.get("name", "")
        if element.find(f"{{{SSD}}}SignalDictionaries") is not None:
            raise self._refuse(f"the system {name!r} has signal dictionaries (.ssb)")
        elements = [self.element(e) for e in element.iterfind(f"{{{SSD}}}Elements/*")]
        self._refuse_twice([e.name for e in elements], f"elements of the system {name!r}")
        return Node(
            name,
            self.connectors(element),
            bound(element, Place(self.package, self.file)),
            {e.name: e for e in elements},
            tuple(self.edge(e) for e in element.iterfind(f"{{{SSD}}}Connections/{{{SSD}}}Connection")),
            read_units(self.root),
        )

    def element(self, element: Element) -> Component | Node:
        if next(self.count) >= MOST:
            raise SspError(self.label, [f"it has more than {MOST} elements, with all that it refers to"])
        if element.tag == f"{{{SSD}}}System":
            return self.node(element)
        name = element.get("name", "")
        if element.tag != f"{{{SSD}}}Component":
            raise self._refuse(f"the element {name!r} refers to a signal dictionary")
        source, kind = element.get("source"), element.get("type", FMU)
        if source is None:
            raise SspError(self.label, [f"the component {name!r} has no source: there is nothing to fly"])
        if kind in (DEFINITION, PACKAGE):
            return self._elsewhere(element, name, source, kind)
        if kind != FMU:
            raise SspError(self.label, [f"the component {name!r} is of type {kind!r}, flown are FMUs, {FMU}"])
        if element.get("implementation", "any") not in ("any", "CoSimulation"):
            raise self._refuse(f"the component {name!r} is to be flown as {element.get('implementation')}")
        fmu = self.package.resolve(source, self.file)
        place = Place(self.package, self.file, fmu)
        reference = f"{self.package.label}#{fmu}"
        if not fmu.lower().endswith(".fmu"):
            raise SspError(self.label, [f"the source of the component {name!r}, {source!r}, is no .fmu file"])
        if fmu not in self.package.names:
            raise SspError(self.label, [f"there is no file {fmu!r} inside, which the component {name!r} is"])
        return Component(name, self.connectors(element), bound(element, place), reference)

    def _elsewhere(self, element: Element, name: str, source: str, kind: str) -> Node:
        """Return a system that is defined in this file by its id, in another .ssd or in another package.

        The component's own bindings come after those of that system.
        """
        path, _, fragment = source.partition("#")
        meant = f"{self.package.label}#{source}"
        if meant in self.above or len(self.above) > DEEPEST:
            raise SspError(self.label, [f"the component {name!r}, {source!r}, lies within itself"])
        above = (*self.above, meant)
        if not path:
            found = [e for e in self.root.iter(f"{{{SSD}}}System") if e.get("id") == fragment]
            if not found:
                raise SspError(self.label, [f"the component {name!r} is the system with the id {fragment!r}: none has"])
            node = replace(self, above=above).node(found[0])
        else:
            file, package = self.package.resolve(path, self.file), self.package
            if kind == PACKAGE:
                package, file = package.package(file), fragment or STRUCTURE
            text = package.text(file)
            root = parse(text, f"{{{SSD}}}SystemStructureDescription", f"{package.label}#{file}")
            node = _Reader(package, file, root, self.count, above).top()
        more: tuple[Assignment, ...] = bound(element, Place(self.package, self.file))
        return replace(node, name=name, assignments=(*node.assignments, *more))

    def connectors(self, element: Element) -> Mapping[str, Connector]:
        name = element.get("name", "")
        found = [self._connector(c, name) for c in element.iterfind(f"{{{SSD}}}Connectors/{{{SSD}}}Connector")]
        self._refuse_twice([c.name for c in found], f"connectors of {name!r}")
        return {c.name: c for c in found}

    def _connector(self, connector: Element, owner: str) -> Connector:
        name, kind = connector.get("name", ""), connector.get("kind", "")
        tags = {str(child.tag).rpartition("}")[2]: child for child in connector}
        for tag in ("Binary", "Clock"):
            if tag in tags:
                raise self._refuse(f"the connector {owner}.{name} is {tag}")
        if kind == "inout":
            raise self._refuse(f"the connector {owner}.{name} is of kind inout, as of signal dictionaries")
        found = next((tag for tag in tags if tag in TYPES), "")
        sizes = [d.get("size") for d in connector.iterfind(f"{{{SSC}}}Dimension")]
        shape = tuple(None if size is None else int(size) for size in sizes)
        return Connector(name, kind, TYPES.get(found, ""), tags[found].get("unit") if found else None, shape)

    def edge(self, element: Element) -> Edge:
        ends = [(element.get(f"{e}Element", ""), element.get(f"{e}Connector", "")) for e in ("start", "end")]
        suppress = element.get("suppressUnitConversion") in ("true", "1")
        edge = Edge(ends[0], ends[1], transformation_of(element), suppress)
        if element.get("startIndices") or element.get("endIndices"):
            raise self._refuse(f"the connection {edge} is of single elements of arrays (startIndices, endIndices)")
        if edge.transformation is not None and not edge.transformation.is_linear:
            if not edge.transformation.changes_nothing:
                raise self._refuse(f"the connection {edge} has a {edge.transformation.kind}")
            edge = replace(edge, transformation=None)
        return edge

    def _refuse(self, what: str) -> SspError:
        return SspError(self.label, [f"{what}, which is not implemented here"])

    def _refuse_twice(self, names: Sequence[str], what: str) -> None:
        for name in names:
            if names.count(name) > 1:
                raise SspError(self.label, [f"two {what} have one name, {name!r}"])
