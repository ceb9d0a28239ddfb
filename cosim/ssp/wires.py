"""Connections through systems within systems, followed from output to input of FMUs.

On the way a value passes hops. Each brings it into the unit of the connector that it comes to, where both say one and
the connection does not forbid it, and applies the connection's linear transformation then:

    target = factor * (source in the target's unit) + offset                                        (1)

A connector without a unit hands on the one that comes. The hops together are one factor and one offset.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field

from cosim.ssp.model import INTO, OUT_OF, Component, Connector, Edge, Node, Transformation
from fmus.description.description import ModelDescription
from fmus.description.units import IDENTITY, Conversion, Unit, conversion

Address = tuple[tuple[str, ...], str]
"""Names of elements from the top system inwards, and the connector's: of an FMU its variable's."""


@dataclass(frozen=True)
class Measure:
    """The unit of a value on its way, None: none said; `units` define it."""

    unit: str | None = None
    units: Mapping[str, Unit] = field(default_factory=dict)


@dataclass(frozen=True)
class Hop:
    """One connection in the direction in which values go."""

    source: Address
    target: Address
    edge: Edge


class Wires:
    """The connections of a system by their ends; what is wrong with them stands in `mistakes`."""

    def __init__(self, system: Node, descriptions: Mapping[tuple[str, ...], ModelDescription]) -> None:
        self.mistakes: list[str] = []
        self.into: dict[Address, Hop] = {}
        self.out_of: dict[Address, list[Hop]] = {}
        self._descriptions = descriptions
        self._connectors: dict[Address, tuple[Connector, Mapping[str, Unit]]] = {}
        self._enter((), system)

    def _enter(self, path: tuple[str, ...], node: Node) -> None:
        self._connectors |= {(path, c.name): (c, node.units) for c in node.connectors.values()}
        for name, element in node.elements.items():
            inner = (*path, name)
            if isinstance(element, Node):
                self._enter(inner, element)
            else:
                self._connectors |= {(inner, c.name): (c, node.units) for c in element.connectors.values()}
        for edge in node.edges:
            self._connect(path, node, edge)

    def _connect(self, path: tuple[str, ...], node: Node, edge: Edge) -> None:
        ends = [self._end(path, node, edge, end) for end in (edge.start, edge.end)]
        found = [(address, gives) for address, gives in ends if address is not None]
        if len(found) < 2:
            return
        if found[0][1] == found[1][1]:
            kinds = " and ".join(self._connectors[address][0].kind for address, _ in found)
            self._wrong(f"the connection {edge} has no direction: {kinds} both {'give' if found[0][1] else 'take'}")
            return
        source, target = (address for address, _ in sorted(found, key=lambda end: not end[1]))
        if target in self.into:
            self._wrong(f"{written(target)} has two sources, {written(self.into[target].source)}, {written(source)}")
            return
        self.into[target] = hop = Hop(source, target, edge)
        self.out_of.setdefault(source, []).append(hop)

    def _end(self, path: tuple[str, ...], node: Node, edge: Edge, end: tuple[str, str]) -> tuple[Address | None, bool]:
        """Return an end of a connection, None where it is wrong, and whether it gives values within its system."""
        name, connector = end
        owner: Component | Node | None = node if not name else node.elements.get(name)
        if owner is None:
            there = ", ".join(node.elements) or "none"
            self._wrong(f"the connection {edge} has an end on {name!r}, which is no element. Elements: {there}")
            return None, False
        if connector not in owner.connectors:
            there = ", ".join(owner.connectors) or "none"
            self._wrong(f"the connection {edge}: {owner.name!r} has no connector {connector!r}. Connectors: {there}")
            return None, False
        kind = owner.connectors[connector].kind
        if kind not in (*INTO, *OUT_OF):
            self._wrong(f"the connection {edge}: {connector!r} is of kind {kind}, which is not implemented here")
            return None, False
        return ((*path, name) if name else path, connector), (kind in INTO) == (not name)

    def connector(self, address: Address) -> Connector:
        """Return the connector of a system or component that is there."""
        return self._connectors[address][0]

    def units(self, address: Address) -> Mapping[str, Unit]:
        """Return the units that the description of a connector defines."""
        return self._connectors[address][1]

    def measure(self, address: Address) -> Measure:
        """Return the unit of a connector: an FMU's variable has its own, or else that of its connector."""
        fmu, (connector, units) = self._descriptions.get(address[0]), self._connectors.get(address, _UNKNOWN)
        if fmu is not None and (address[1] in fmu.variables or address[1] in fmu.groups):
            first = fmu.variables[fmu.find(address[1], "variable", "").elements[0]]
            if first.unit is not None:
                return Measure(first.unit, fmu.units)
        return Measure(connector.unit, units)

    def passed(self, hop: Hop, measure: Measure) -> tuple[Conversion, Measure]:
        """Return what a hop makes of a value with its unit, and the unit that it has then: (1)."""
        here = self.measure(hop.target)
        suppress, how = hop.edge.suppress_unit_conversion, hop.edge.transformation
        return self.converted(measure, here, suppress, how, f"the connection {hop.edge}")

    def converted(
        self, source: Measure, target: Measure, suppress: bool, transformation: Transformation | None, where: str
    ) -> tuple[Conversion, Measure]:
        """Return (1) from one unit to another, and the unit then; `where` begins what is said of a mistake."""
        found: Conversion | None = IDENTITY
        if not suppress:
            found = conversion(source.unit, target.unit, source.units, target.units)
        if found is None:
            self._wrong(f"{where}: the units {source.unit} and {target.unit} cannot be converted")
            found = IDENTITY
        if transformation is not None and transformation.is_linear:
            found = found.then(Conversion(transformation.factor, transformation.offset))
        return found, target if target.unit is not None else source

    def traced(self, target: Address) -> tuple[Address, Conversion] | None:
        """Return where the value of an FMU's input comes from, and what it becomes on the way; None: from nowhere.

        Nowhere is a connector of a system that nothing is connected to from outside.
        """
        hops: list[Hop] = []
        at = target
        while at in self.into and self.into[at] not in hops:
            hops.insert(0, self.into[at])
            at = hops[0].source
        if not hops or at[0] not in self._descriptions:
            return None
        found, measure = IDENTITY, self.measure(at)
        for hop in hops:
            step, measure = self.passed(hop, measure)
            found = step if found == IDENTITY else found.then(step)
        return at, found

    def _wrong(self, problem: str) -> None:
        if problem not in self.mistakes:
            self.mistakes.append(problem)


_UNKNOWN: tuple[Connector, Mapping[str, Unit]] = (Connector("", ""), {})


def written(address: Address) -> str:
    """Return an address as the standard's hierarchical name."""
    return ".".join((*address[0], address[1]))
