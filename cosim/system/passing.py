"""Faults on connections, checked, element by element, in the targets' own units."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from cosim.errors import ParameterError, UnknownName
from cosim.system.fault import QUANTITIES, Fault, FaultError, Passing
from cosim.system.parameters import Parameters
from cosim.system.system import System
from cosim.system.value import Value
from cosim.system.wiring import Link, Port, Wiring
from fmus.description.description import ScalarVariable
from fmus.description.names import Group, did_you_mean, split_port

LONGEST = 100_000
"""Of a delay, steps."""

LARGEST_SEED = 2**53

NEUTRAL: dict[str, dict[str, float]] = {
    "scale": {"scale": 1.0},
    "bias": {"bias": 0.0},
    "noise": {"sigma": 0.0},
    "quantisation": {"quantum": 0.0},
    "delay": {"steps": 0.0},
    "stuck": {"hold": 0.0},
    "dropout": {"hold": 0.0},
}
"""What a fault leaves when it ends, by kind."""

TYPES: dict[str, tuple[str, ...]] = {
    "stuck": ("Real", "Integer", "Boolean", "Enumeration"),
    "dropout": ("Real", "Integer", "Boolean", "Enumeration", "String"),
    "delay": ("Real", "Integer", "Boolean", "Enumeration", "String"),
}
"""On which types a fault can act; the other kinds on Real alone."""


@dataclass(frozen=True)
class Acting:
    """A fault on one scalar connection: what it puts in force when it begins."""

    link: Link
    begin: Passing


def acting(wiring: Wiring, system: System, fault: Fault) -> list[Acting]:
    """Return what a fault does to each scalar connection that it means; raises `FaultError`, `UnknownName`."""
    links = _links(wiring, fault)
    for link in links:
        _refuse_type(wiring, fault, link)
    return [Acting(*pair) for pair in zip(links, _begins(wiring, system, fault, links), strict=True)]


def _links(wiring: Wiring, fault: Fault) -> list[Link]:
    """Return the connections that a fault means."""
    source, arrow, target = (part.strip() for part in fault.on.partition("->"))
    if not arrow:
        component, group = _find(wiring, fault, source)
        mine = {Port(component, element) for element in group.elements}
        causality = wiring.variable(next(iter(mine))).causality
        if causality == "output":
            if links := [link for link in wiring.links if link.source in mine]:
                return links
            raise FaultError(str(fault), f"nothing is connected to output {source}")
        return _into(wiring, fault, source, component, group)
    (a, sources), (b, targets) = _find(wiring, fault, source), _find(wiring, fault, target)
    links = _into(wiring, fault, target, b, targets)
    others = [link for link in links if link.source not in {Port(a, element) for element in sources.elements}]
    if others:
        problem = f"{others[0].target} is connected to {others[0].source}, not to {source}"
        raise FaultError(str(fault), problem, f"Leave out the source: {target}.")
    return links


def _find(wiring: Wiring, fault: Fault, name: str) -> tuple[str, Group]:
    """Return the instance and the array or element of a port's name."""
    component, variable = split_port(name)
    if component not in wiring.fmus:
        raise UnknownName("component", component, f"fault {fault}", list(wiring.fmus))
    return component, wiring.fmus[component].find(variable, "variable", f'component "{component}" (fault {fault})')


def _into(wiring: Wiring, fault: Fault, name: str, component: str, group: Group) -> list[Link]:
    """Return the connections to an input, each of its elements."""
    by_target = {link.target: link for link in wiring.into(component)}
    variable = wiring.fmus[component].variables[group.elements[0]]
    if variable.causality != "input":
        inputs = wiring.fmus[component].base_names("input")
        advice = f"Inputs: {', '.join(inputs) or 'none'}.{did_you_mean(variable.name, inputs)}"
        if variable.is_parameter:
            advice = 'Its kind is "parameter" then.'
        raise FaultError(str(fault), f"{name} is no input, but {variable.causality}: no connection ends there", advice)
    links: list[Link] = []
    for port in (Port(component, element) for element in group.elements):
        link = by_target.get(port)
        if link is None:
            raise FaultError(str(fault), f"{port} is held, nothing is connected to it", "Hold it at another value.")
        if link.fed:
            raise FaultError(str(fault), f"a signal feeds {port}", "Put the fault into the signal.")
        links.append(link)
    return links


def _refuse_type(wiring: Wiring, fault: Fault, link: Link) -> None:
    kind = wiring.variable(link.target).type
    if kind not in TYPES.get(fault.kind, ("Real",)):
        possible = [name for name in NEUTRAL if kind in TYPES.get(name, ("Real",))]
        raise FaultError(str(fault), f"{link.target} is {kind}", f"Its faults are {', '.join(possible)}.")


def _begins(wiring: Wiring, system: System, fault: Fault, links: Sequence[Link]) -> list[Passing]:
    """Return the settings of each connection when the fault begins."""
    if fault.kind == "dropout":
        refuse_value(fault)
        return [Passing({"hold": 1.0})] * len(links)
    values, unit = _numbers(fault, len(links))
    if fault.kind == "stuck":
        stuck = [_stuck(wiring, system, fault, link, v, unit) for link, v in zip(links, values, strict=True)]
        return [Passing({"hold": 1.0}, value) for value in stuck]
    if fault.kind == "delay":
        return [Passing({"steps": _steps(fault, v, unit)}) for v in values]
    parameters = Parameters(system, wiring.fmus)
    found: list[Passing] = []
    for link, value in zip(links, values, strict=True):
        number, variable = _number(fault, value), wiring.variable(link.target)
        if fault.kind == "scale":
            _refuse_unit(fault, unit)
            found.append(Passing({"scale": number}))
            continue
        number = _factor(parameters, fault, link, variable, unit) * number  # a difference: no offset
        if fault.kind == "bias":
            found.append(Passing({"bias": number}))
            continue
        if number <= 0:
            raise FaultError(str(fault), f"its {QUANTITIES[fault.kind]} is {value}", "It must be above 0.")
        noise = {"sigma": number, "seed": float(_seed(fault))}
        found.append(Passing(noise if fault.kind == "noise" else {"quantum": number}))
    return found


def refuse_value(fault: Fault) -> None:
    """Raise `FaultError` where a fault has a value that takes none."""
    if fault.value is not None:
        raise FaultError(str(fault), f"it has the value {fault.value}, and takes none", "Leave it out.")


def _numbers(fault: Fault, n: int) -> tuple[list[Any], str | None]:
    """Return a value for each of n connections, and their unit."""
    quantity = QUANTITIES[fault.kind]
    if fault.value is None:
        raise FaultError(str(fault), f"it has no {quantity}", f"Give it a {quantity}.")
    given = fault.value if isinstance(fault.value, Value) else Value(fault.value)
    values = given.value if isinstance(given.value, list) else [given.value] * n
    if len(values) != n:
        size, advice = (f"{n} elements", f"Give it one, or {n}.") if n != 1 else ("1 element", "Give it one.")
        problem = f"its {quantity} has {len(values)} numbers, what it is on has {size}"
        raise FaultError(str(fault), problem, advice)
    return values, given.unit


def _number(fault: Fault, value: Any) -> float:
    good = isinstance(value, int | float) and not isinstance(value, bool)
    if not good or not math.isfinite(value):
        raise FaultError(str(fault), f"its {QUANTITIES[fault.kind]} {value!r} is no finite number")
    return float(value)


def _steps(fault: Fault, value: Any, unit: str | None) -> float:
    steps = _number(fault, value)
    if unit is not None or steps != int(steps) or not 1 <= steps <= LONGEST:
        told = f"{value} {unit or ''}".strip()
        advice = f"It counts steps of the source: a whole number, 1 to {LONGEST}."
        raise FaultError(str(fault), f"its steps are {told}", advice)
    return steps


def _seed(fault: Fault) -> int:
    seed: Any = fault.seed
    if isinstance(seed, bool) or not isinstance(seed, int) or not 0 <= seed <= LARGEST_SEED:
        raise FaultError(str(fault), f"its seed is {seed!r}", f"It must be a whole number, 0 to {LARGEST_SEED}.")
    return seed


def _refuse_unit(fault: Fault, unit: str | None) -> None:
    if unit not in (None, "1"):
        raise FaultError(str(fault), f"its factor has the unit {unit}", "It is a number without unit.")


def _factor(parameters: Parameters, fault: Fault, link: Link, variable: ScalarVariable, unit: str | None) -> float:
    try:
        return parameters.conversion(link.target.component, variable, unit).factor
    except ValueError as error:
        raise FaultError(str(fault), f"{link.target}: {error}") from error


def _stuck(wiring: Wiring, system: System, fault: Fault, link: Link, value: Any, unit: str | None) -> float:
    """Return the value at which a connection is stuck, as a held input would have it."""
    text = fault.value.text if isinstance(fault.value, Value) else fault.value
    given: Any = text if isinstance(value, str) else Value(value, unit)
    held: Mapping[str, Any] = {str(link.target): given}
    parameters = Parameters(replace(system, parameters={}, vehicle={}, held=held), wiring.fmus)
    found = parameters.held()
    for mistake in parameters.mistakes:
        raise FaultError(str(fault), mistake.problem if isinstance(mistake, ParameterError) else str(mistake))
    return float(found[link.target])
