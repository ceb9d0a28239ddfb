"""A system that is read, with what our annotation says of it: what the structure says itself stays true.

The annotation has whole arrays, values with their units, one value for a whole vehicle, timings. It holds as far as
the structure agrees; a value, connection or instance that another tool has changed since is the structure's.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

from cosim.errors import UnknownName
from cosim.ssp.flatten import Flat
from cosim.ssp.signals import fed
from cosim.system import Connection, System
from cosim.system.overrides import with_parameters
from cosim.system.parameters import Parameters
from cosim.system.wiring import Port
from fmus.description.description import ModelDescription, Scalar
from fmus.description.names import split_port
from fmus.description.units import Conversion, conversion

Pair = tuple[Port, Port]


def refined(flat: Flat, system: System, told: Mapping[str, Any]) -> System:
    """Return the system of a structure in the words of the annotation; `told`: the fields of a `System`."""
    here: dict[str, Any] = dict(told)
    for name in ("parameters", "held"):
        here[name] = {key: v for key, v in told.get(name, {}).items() if _instance(key) in ("*", *flat.components)}
    here["steps"] = {key: n for key, n in told.get("steps", {}).items() if key in flat.components}
    for name, n in here["steps"].items():
        if not (isinstance(n, int) or (isinstance(n, float) and n.is_integer())):
            raise TypeError(f"steps of {name} is {n!r}")
    here["isolated"] = [n for n in _texts(told.get("isolated", ())) if n in ("*", *flat.components)]
    if not isinstance(told.get("hold_unconnected", False), bool):
        raise TypeError(f"hold_unconnected is {told['hold_unconnected']!r}")
    here["connections"] = _connections(told.get("connections", ()), flat)
    here |= {"name": system.name, "components": system.components, "inputs": system.inputs}
    return _with_changed_values(System(**here), flat)


def _texts(given: Any) -> Sequence[str]:
    names = [given] if isinstance(given, str) else list(given)
    if not all(isinstance(name, str) for name in names):
        raise TypeError(f"isolated is {given!r}")
    return names


def _instance(key: str) -> str:
    return split_port(key)[0]


def _connections(told: Iterable[Connection], flat: Flat) -> list[Connection]:
    """Return what the annotation connects where the structure does too, then what it alone connects."""
    true = {pair: c for c in flat.links for pair in pairs(c, flat.descriptions)}
    kept: list[Connection] = []
    served: set[Pair] = set()
    for connection in told:
        these = pairs(connection, flat.descriptions)
        if these and all(
            p in true and _how(connection, p, flat.descriptions) == _how(true[p], p, flat.descriptions) for p in these
        ):
            kept.append(connection)
            served |= set(these)
    rest = [c for pair, c in true.items() if pair not in served]
    return [*kept, *dict.fromkeys(rest)]


def _how(connection: Connection, pair: Pair, descriptions: Mapping[str, ModelDescription]) -> Conversion | None:
    """Return what a connection makes of a value, by itself or by the units of its ends."""
    ends = [descriptions[port.component] for port in pair]
    units = [fmu.variables[port.variable].unit for fmu, port in zip(ends, pair, strict=True)]
    return connection.transformation or conversion(units[0], units[1], ends[0].units, ends[1].units)


def pairs(connection: Connection, descriptions: Mapping[str, ModelDescription]) -> list[Pair]:
    """Return the variables that a connection connects, one by one; none where an end is not there."""
    ends: list[list[Port]] = []
    for end in (connection.source, connection.target):
        instance, name = split_port(end)
        try:
            found = descriptions[instance].find(name, "variable", instance)
        except (KeyError, UnknownName):
            return []
        ends.append([Port(instance, element) for element in found.elements])
    return list(zip(*ends, strict=True)) if len(ends[0]) == len(ends[1]) else []


def _with_changed_values(system: System, flat: Flat) -> System:
    """Return the system with the structure's values where they are not the annotation's."""
    parameters = Parameters(system, flat.descriptions)
    sources = fed(system.inputs, flat.descriptions)
    told: dict[Port, Scalar] = {**parameters.settings(), **parameters.held()}
    told = {port: value for port, value in told.items() if port not in sources}
    connected = sources | {pair[1] for c in system.connections for pair in pairs(c, flat.descriptions)}
    true = {Port(*key): value for key, value in flat.values.items() if Port(*key) not in connected}
    for port in told.keys() - true.keys():  # the structure leaves it at its start value
        start = flat.descriptions[port.component].variables[port.variable].start
        if start is not None:
            true[port] = start
    usual = {port: flat.descriptions[port.component].variables[port.variable].start for port in true}
    changed = {port: v for port, v in true.items() if told.get(port, usual[port]) != comparable(port, v, flat)}
    inputs = {port: v for port, v in changed.items() if _is_input(port, flat)}
    others = {str(port): v for port, v in changed.items() if port not in inputs}
    held = {str(port): v for port, v in inputs.items() if not (system.hold_unconnected and port not in told)}
    system = replace(system, held=_without(system.held, inputs) | held) if inputs else system
    return with_parameters(system, others) if others else system


def _is_input(port: Port, flat: Flat) -> bool:
    return flat.descriptions[port.component].variables[port.variable].causality == "input"


def comparable(port: Port, value: Scalar, flat: Flat) -> Scalar:
    """Return a value of a structure as parameters have it: an item of an enumeration by its number."""
    items = flat.descriptions[port.component].variables[port.variable].items
    return items.get(value, value) if items and isinstance(value, str) else value


def _without(held: Mapping[str, Any], ports: Iterable[Port]) -> dict[str, Any]:
    named = {str(port) for port in ports}
    return {key: value for key, value in held.items() if key not in named}
