"""Other values in a system: parameters one by one, and held inputs where a name is one."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from cosim.system.system import System
from fmus.description.names import canonical, split_element, split_port


def with_inputs(system: System, signals: Mapping[str, Any], held: Mapping[str, Any] | None = None) -> System:
    """Return the system with inputs fed by signals, or held; they take the place of what each had, a connection too."""
    given = {*map(canonical, signals), *map(canonical, held or {})}
    connections = [c for c in system.connections if canonical(c.target) not in given]
    kept = {name: value for name, value in system.held.items() if canonical(name) not in given}
    fed = {name: signal for name, signal in system.inputs.items() if canonical(name) not in given}
    return replace(system, connections=connections, held=kept | dict(held or {}), inputs=fed | dict(signals))


def with_parameters(system: System, values: Mapping[str, Any]) -> System:
    """Return the system with parameters set, or held inputs where a name is one; they win over its own entries."""
    held = {name: value for name, value in values.items() if {name, split_element(name)[0]} & system.held.keys()}
    parameters = dict(system.parameters)
    for name, value in values.items():
        if name not in held:
            _set(parameters, name, value)
    return replace(system, parameters=parameters, held=system.held | held)


def _set(parameters: dict[str, Any], name: str, value: Any) -> None:
    """Set one entry, and have older ones of more specific names not undo it: of single instances, of elements."""
    instance, variable = split_port(name)
    base, index = split_element(variable)
    older = [(key, *split_port(key)) for key in parameters]
    same = [(key, i, v) for key, i, v in older if split_element(v)[0] == base and instance in ("*", i)]
    for key, i, _ in same:
        if not index:
            del parameters[key]
        elif instance == "*" and i != "*":
            parameters[f"{i}.{variable}"] = value
    parameters[name] = value
