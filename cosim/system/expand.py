"""From a system and the descriptions of its FMUs to a checked `Wiring`; all mistakes are found and told together."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property

from cosim.errors import SimulationError, UnknownName, WiringError, WiringErrors
from cosim.system.acting_rates import counted_twice
from cosim.system.feeds import Feeds
from cosim.system.feeds import description as feeds_description
from cosim.system.parameters import Parameters
from cosim.system.system import Connection, System
from cosim.system.timing import TIMINGS, carried, straight
from cosim.system.wiring import Link, Port, Wiring
from cosim.time import LARGEST_INTEGER
from fmus.description.annotations import FILTER
from fmus.description.description import ModelDescription, Scalar, ScalarVariable, Type
from fmus.description.names import Group, group, split_element, split_port
from fmus.description.units import IDENTITY, conversion

__all__ = ["Link", "Port", "Wiring", "wire"]


def wire(system: System, descriptions: Mapping[str, ModelDescription]) -> Wiring:
    """Expand and check a system; `descriptions` has one entry per instance.

    Raises `WiringErrors` with every mistake, in the order: connections, inputs, parameters, steps.
    """
    ordered = {name: descriptions[name] for name in system.components}
    parameters = Parameters(system, ordered)
    checker = _Checker(system, ordered)
    checker.instances()
    links = checker.links()
    feeds = Feeds(system, ordered)
    settings, held = parameters.settings(), _unfed(parameters.held(), feeds.links)
    if system.hold_unconnected:
        held |= _unconnected(ordered, [*links, *feeds.links], held)
    checker.inputs([*links, *feeds.links], held)
    checker.mistakes += counted_twice(links, ordered)
    periods = checker.periods()
    mistakes = checker.mistakes + feeds.mistakes + parameters.mistakes
    if mistakes:
        raise WiringErrors(system.name, mistakes)
    periods |= {name: periods[feed.component] for name, feed in feeds.feeds.items()}
    described = ordered | {name: feeds_description(feed) for name, feed in feeds.feeds.items()}
    whole = described, (*links, *feeds.links), settings, held, periods, system.name, feeds.feeds
    return Wiring(*whole, resolved=parameters.resolved)


def rewire(wiring: Wiring, system: System) -> Wiring:
    """Return a wiring with the parameters and held values of a system that differs from its own in nothing else.

    Raises `WiringErrors`.
    """
    parameters = Parameters(system, wiring.fmus, wiring.resolved)
    settings, held = parameters.settings(), _unfed(parameters.held(), wiring.links)
    if system.hold_unconnected:
        held |= _unconnected(wiring.fmus, wiring.links, held)
    if parameters.mistakes:
        raise WiringErrors(system.name, parameters.mistakes)
    return replace(wiring, settings=settings, held=held)


def _unfed(held: dict[Port, Scalar], links: Sequence[Link]) -> dict[Port, Scalar]:
    """Return the held inputs that no signal feeds."""
    fed = {link.target for link in links if link.fed}
    return {port: value for port, value in held.items() if port not in fed}


def _unconnected(
    descriptions: Mapping[str, ModelDescription], links: Sequence[Link], held: Mapping[Port, Scalar]
) -> dict[Port, Scalar]:
    """Return the inputs that have no source, with their start values."""
    served = {link.target for link in links} | held.keys()
    inputs = {Port(name, v.name): v for name, description in descriptions.items() for v in description.inputs}
    return {port: _start(variable) for port, variable in inputs.items() if port not in served}


def _start(variable: ScalarVariable) -> Scalar:
    """Return the start value of an input, zero or nothing where an FMU breaks the rule that it has one."""
    if variable.start is not None:
        return variable.start
    return {"Real": 0.0, "Boolean": False, "String": ""}.get(variable.type, 0)


class _Checker:
    def __init__(self, system: System, descriptions: Mapping[str, ModelDescription]) -> None:
        self.system = system
        self.descriptions = descriptions
        self.mistakes: list[SimulationError] = []

    def instances(self) -> None:
        """Find instance names that cannot stand before the dot of a variable's name."""
        for name in self.descriptions:
            if not name or set(name) & set(".*?[] "):
                self._wrong(
                    f'"{name}" cannot be an instance name', advice="Write it without dots, spaces and brackets."
                )

    def links(self) -> list[Link]:
        """Expand all connections element by element."""
        return [link for connection in self.system.connections for link in self._expand(connection)]

    def _expand(self, connection: Connection) -> list[Link]:
        source = self._end(connection.source, connection, "output")
        target = self._end(connection.target, connection, "input")
        if source is None or target is None:
            return []
        (a, sources), (b, targets) = source, target
        if len(sources.elements) != len(targets.elements) or (
            sources.shape != targets.shape and len(sources.elements) > 1
        ):
            ends = (self._words(connection.source, a, sources), self._words(connection.target, b, targets))
            advice = self._naming((b, a), [f"width={len(g.elements)}" for g in (sources, targets)])
            return self._wrong(f"{ends[0]}, {ends[1]}: cannot connect them", connection, advice)
        result: list[Link] = []
        for s, t in zip(sources.elements, targets.elements, strict=True):
            result += self._link(connection, Port(a, s), Port(b, t))
        return result

    def _end(self, name: str, connection: Connection, causality: str) -> tuple[str, Group] | None:
        component, variable = split_port(name)
        where = f"connection {connection.source} -> {connection.target}"
        description = self.descriptions.get(component)
        if description is None:
            self.mistakes.append(UnknownName("component", component, where, list(self.descriptions)))
            return None
        try:
            found = description.find(variable, "variable", f'component "{component}"')
        except UnknownName as error:
            if variable in description.unserved:
                problem = f"{name} is {description.unserved[variable]}: values of this type are not exchanged"
                self._wrong(problem, connection, "Leave it unconnected.")
                return None
            names = description.base_names(causality)
            element = error.kind == "element"  # of an array that is there
            self.mistakes.append(error if element else UnknownName(causality, error.name, error.where, names))
            return None
        first = description.variables[found.elements[0]]
        if first.causality != causality:
            listed = ", ".join(description.base_names(causality)) or "none"
            role = "source" if causality == "output" else "target"
            problem = f"{name} cannot be the {role} of a connection: its causality is {first.causality}"
            self._wrong(problem, connection, f"{causality.capitalize()}s of {component}: {listed}.")
            return None
        return component, found

    def _link(self, connection: Connection, source: Port, target: Port) -> list[Link]:
        a, b = self.descriptions[source.component], self.descriptions[target.component]
        ends = a.variables[source.variable], b.variables[target.variable]
        if not _fits(ends[0].type, ends[1].type):
            both = f"{connection.source} is {ends[0].type}, {connection.target} is {ends[1].type}: cannot connect them"
            return self._wrong(both, connection, _ADVICE[ends[1].type])
        names = f"{connection.source} -> {connection.target}"
        units = ends[0].unit, ends[1].unit
        found = connection.transformation or conversion(*units, a.units, b.units)
        if connection.transformation is not None:
            self._transformation(connection, ends)
        if found is None:
            both = f"{connection.source} has unit {units[0]}, {connection.target} has unit {units[1]}"
            advice = self._naming((target.component, source.component), [f"unit={unit}" for unit in units])
            self._wrong(f"{both}: they cannot be converted", connection, advice)
        step_mean = source.variable in a.step_means
        timing = connection.timing or self._default(source, target)
        if timing not in TIMINGS:
            return self._wrong(f'{names} has timing "{timing}"', connection, f"Choose {', '.join(TIMINGS)}.")
        if step_mean and timing != "after_step":
            problem = f"{names} has timing {timing}, but its source is the mean over a step"
            self._wrong(
                problem, connection, 'A step mean is held over the step it was taken from: timing="after_step".'
            )
        if timing in ("midpoint", "ramp", "smooth") and {end.type for end in ends} != {"Real"}:
            odd = ends[0] if ends[0].type != "Real" else ends[1]
            problem = f"{names} has timing {timing}, but there is nothing between two values of type {odd.type}"
            self._wrong(problem, connection, "Choose at_point or after_step.")
        link = Link(source, target, timing, found or IDENTITY, step_mean, allowed=_allowed(*ends))
        made = carried(link, timing, a, b)
        return [made if connection.timing else replace(made, asked="")]  # nobody asked for a default

    def _transformation(self, connection: Connection, ends: tuple[ScalarVariable, ScalarVariable]) -> None:
        """Find a factor or offset of numbers that are none, or between values that have none."""
        names = f"{connection.source} -> {connection.target} has a factor or offset"
        if {end.type for end in ends} != {"Real"}:
            types = " and ".join(dict.fromkeys(end.type for end in ends))
            self._wrong(f"{names}, but its ends are {types}: both must be Real", connection)
        assert connection.transformation is not None
        numbers = connection.transformation.factor, connection.transformation.offset
        if not all(math.isfinite(number) for number in numbers):
            self._wrong(f"{names} that is not finite: {numbers[0]}, {numbers[1]}", connection)

    def _default(self, source: Port, target: Port) -> str:
        """Return the timing of a connection that does not say one.

        What a step mean is of goes as a ramp to who takes both: held from a point on, momentum and torque would not be
        those of one exchange. What acts by its rate goes as one too: held, it would act in jumps.
        """
        if source.variable in self.descriptions[source.component].step_means:
            return "after_step"
        acts = target.variable in self.descriptions[target.component].rates_act
        return "ramp" if acts or (source, target.component) in self._exchanged else "at_point"

    @cached_property
    def _exchanged(self) -> frozenset[tuple[Port, str]]:
        """What step means are of, each with the component that takes the mean."""
        taken: list[tuple[Port, str]] = []
        for connection in self.system.connections:
            (source, name), target = split_port(connection.source), split_port(connection.target)[0]
            means = self.descriptions[source].step_means if source in self.descriptions else {}
            taken += [(Port(source, mean), target) for mean in means if name in (mean, split_element(mean)[0])]
        return straight(taken, self.descriptions)

    def inputs(self, links: list[Link], held: Mapping[Port, object]) -> None:
        """Find inputs without a source and inputs with two, whole arrays at a time."""
        sources: dict[Port, list[str]] = {}
        for link in links:
            sources.setdefault(link.target, []).append(str(link.source))
        for port in held:
            sources.setdefault(port, []).append("held")
        given = [*(c.target for c in self.system.connections), *self.system.held, *self.system.inputs]
        named = set(map(split_port, given))
        for component, description in self.descriptions.items():
            for base, g in group(v.name for v in description.inputs).items():
                count = {e: len(sources.get(Port(component, e), ())) for e in g.elements}
                for name in self._names(base, g, [e for e in g.elements if count[e] > 1]):
                    found = sources[Port(component, name if name in count else g.elements[0])]
                    self._wrong(
                        f"input {component}.{name} has {len(found)} sources: {', '.join(found)}",
                        advice="An input takes one connection; add several signals with the component Sum.",
                    )
                for name in self._names(base, g, [e for e in g.elements if count[e] == 0]):
                    if not {(component, name), (component, base)} & named:  # else reported already, with its reason
                        shape = g.shape if name == base else ()
                        self._not_connected(component, name, shape, description.variables[g.elements[0]])

    @staticmethod
    def _names(base: str, whole: Group, elements: list[str]) -> list[str]:
        """Return the array's name for all of its elements, else the elements."""
        return [base] if elements == list(whole.elements) else elements

    def _not_connected(self, component: str, name: str, shape: tuple[int, ...], variable: ScalarVariable) -> None:
        value = repr(_start(variable))
        for n in reversed(shape):
            value = f"[{', '.join([value] * n)}]"
        self._wrong(
            f"input {component}.{name} is not connected",
            advice=f'Connect it, or hold it: held={{"{component}.{name}": {value}}}.',
        )

    def periods(self) -> dict[str, int]:
        """Check the multiples of the communication step."""
        result = dict.fromkeys(self.descriptions, 1)
        for component, n in self.system.steps.items():
            if component not in result:
                self.mistakes.append(UnknownName("component", component, "steps", list(result)))
            elif isinstance(n, bool) or int(n) != n or not 1 <= n <= LARGEST_INTEGER:
                self._wrong(
                    f"steps of {component} is {n}", advice=f"It must be a whole number, 1 to {LARGEST_INTEGER}."
                )
            else:
                result[component] = int(n)
        return result

    def _wrong(self, problem: str, connection: Connection | None = None, advice: str = "") -> list[Link]:
        ports = (connection.source, connection.target) if connection is not None else ()
        mistake = WiringError(problem, advice, ports)
        if str(mistake) not in map(str, self.mistakes):
            self.mistakes.append(mistake)
        return []

    def _naming(self, components: Sequence[str], structures: Sequence[str]) -> str:
        """Return how the FMU of a filter, if just one of the components is one, is made for what it is connected to."""
        ends = zip(components, structures, strict=True)
        filters = [end for end in ends if self.descriptions[end[0]].role == FILTER]
        if len(filters) != 1:
            return ""
        return "{} is made for a width and a unit: name its FMU as in NAME:{}.".format(*filters[0])

    def _words(self, name: str, component: str, g: Group) -> str:
        unit = self.descriptions[component].variables[g.elements[0]].unit or "none"
        size = " x ".join(map(str, g.shape)) or "1"
        return f"{name} has {size} element{'s' if size != '1' else ''} (unit {unit})"


NUMBERS = ("Boolean", "Integer", "Enumeration")
_ADVICE = {
    "Real": "A Real takes Real, Integer, Boolean and Enumeration.",
    "Integer": "An Integer takes Integer, Boolean and Enumeration.",
    "Boolean": "A Boolean takes Boolean, and Integer and Enumeration while they are 0 or 1.",
    "Enumeration": "An Enumeration takes Enumeration, and Integer and Boolean while they are among its items.",
    "String": "A String takes String only.",
}


def _fits(source: Type, target: Type) -> bool:
    """Whether values of one type can be passed to another without rounding."""
    return source == target or (source in NUMBERS and target in ("Real", *NUMBERS))


def _allowed(source: ScalarVariable, target: ScalarVariable) -> tuple[int, ...] | None:
    """Return the values that the target can take, where those of the source are not certainly among them."""
    if target.type == "Boolean" and source.type != "Boolean":
        return (0, 1)
    items = sorted((target.items or {}).values())
    if target.type == "Enumeration" and items and (source.items or {}) != (target.items or {}):
        return tuple(items)
    return None
