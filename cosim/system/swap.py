"""Replacing the FMU of one instance by another, by one rule: what fits is kept, what is missing is named."""

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cosim.errors import SimulationError, UnknownName, WiringError, WiringErrors
from cosim.system import Connection, System, Timing
from cosim.system.reference import Reference, name_of, reference_of
from fmus.description.description import ModelDescription, ScalarVariable
from fmus.description.names import split_element, split_port


@dataclass(frozen=True)
class SwapReport:
    """What `replace` did: connections, held inputs and parameters as text, in the order of the system."""

    instance: str
    reference: str
    kept: tuple[str, ...]
    dropped: tuple[str, ...]
    added: tuple[str, ...]


def replace(
    system: System, instance: str, reference: Reference | Path, descriptions: Mapping[str, ModelDescription]
) -> tuple[System, SwapReport]:
    """Return the system with another FMU for `instance`, and what that kept, dropped and added.

    `descriptions` has one entry per instance, the new FMU's for `instance`. Connections and held inputs whose port the
    new FMU has, with the same size, are kept. Its further inputs are connected to the one other instance that offers
    an output of that name and size. Parameters of the instance that it lacks are dropped; vehicle parameters stay.
    What acts by its rate in the new FMU (acting_rates.py) comes in once: its step mean is held, not connected.

    Raises `UnknownName` for an unknown instance, `WiringErrors` for inputs that no one or several instances offer.
    """
    reference = reference_of(reference, instance)
    if instance not in system.components:
        raise UnknownName("component", instance, f'system "{system.name}"', list(system.components))
    swap = _Swap(system, instance, descriptions)
    kept = [c for c in system.connections if swap.fits(c)]
    kept, held = swap.once(kept, {name: v for name, v in system.held.items() if swap.has(name, "input")})
    parameters = {name: v for name, v in system.parameters.items() if swap.settable(name)}
    added = swap.further(kept, held)
    dropped = [
        *(_text(c) for c in system.connections if c not in kept),
        *(f"held {name}" for name in system.held if name not in held),
        *(f"parameter {name}" for name in system.parameters if name not in parameters),
    ]
    known = {name for fmu in descriptions.values() for name in fmu.groups}
    vehicle = {name: value for name, value in system.vehicle.items() if name in known}
    dropped += [f"vehicle {name}, which no component has any more" for name in system.vehicle if name not in known]
    carried = [f"vehicle {name}" for name in vehicle if name in descriptions[instance].groups]
    mine = [c for c in kept if instance in (split_port(c.source)[0], split_port(c.target)[0])]
    changed = dataclasses.replace(
        system,
        components={**system.components, instance: reference},
        connections=(*kept, *added),
        held=held,
        parameters=parameters,
        vehicle=vehicle,
    )
    values = [f"parameter {name}" for name in parameters if split_port(name)[0] == instance]
    report = SwapReport(
        instance,
        name_of(reference),
        (*map(_text, mine), *values, *carried),
        tuple(dropped),
        (*map(_text, added), *(f"held {name}" for name in held if name not in system.held)),
    )
    return changed, report


class _Swap:
    def __init__(self, system: System, instance: str, descriptions: Mapping[str, ModelDescription]) -> None:
        self.system, self.instance, self.descriptions = system, instance, descriptions
        self.new = descriptions[instance]

    def fits(self, connection: Connection) -> bool:
        """Whether the new FMU has its end of a connection; a connection elsewhere always fits."""
        for name, causality, other in (
            (connection.source, "output", connection.target),
            (connection.target, "input", connection.source),
        ):
            if split_port(name)[0] != self.instance:
                continue
            size, wanted = self._size(name), self._size(other)
            if not self.has(name, causality) or (wanted is not None and size != wanted):
                return False
        return True

    def has(self, name: str, causality: str) -> bool:
        """Whether a name is of another instance, or a port of the new FMU."""
        component, variable = split_port(name)
        if component != self.instance:
            return True
        return any(v.causality == causality for v in self._variables(variable))

    def settable(self, key: str) -> bool:
        """Whether a parameter is of another instance, or one that the new FMU has."""
        component, variable = split_port(key)
        return component != self.instance or any(v.is_parameter for v in self._variables(variable))

    def once(self, kept: Sequence[Connection], held: Mapping[str, Any]) -> tuple[list[Connection], dict[str, Any]]:
        """Return connections and held inputs, with each step mean as the new FMU needs it.

        Where it takes what the mean is of by an input that acts by its rate, the mean is not connected but held, at the
        start value; where by any other, the mean is not held.
        """
        links, values = list(kept), dict(held)
        for taken in (c for c in kept if split_port(c.target)[0] == self.instance):
            acts = split_element(split_port(taken.target)[1])[0] in {split_element(n)[0] for n in self.new.rates_act}
            for mean in self._means_of(taken.source):
                port = f"{self.instance}.{split_port(mean)[1]}"
                if not acts:
                    values.pop(port, None)
                    continue
                twice = [c for c in links if c.source == mean and split_port(c.target)[0] == self.instance]
                links = [c for c in links if c not in twice]
                free = {c.target for c in twice} or {port} - {c.target for c in links} - values.keys()
                values |= {name: self._start(name) for name in free if self.has(name, "input")}
        return links, values

    def _means_of(self, source: str) -> set[str]:
        """Return the outputs of the same instance that are step means of a source."""
        component, variable = split_port(source)
        means = self.descriptions[component].step_means if component in self.descriptions else {}
        named = ((split_element(mean)[0], split_element(of)[0]) for mean, of in means.items() if of)
        return {f"{component}.{mean}" for mean, of in named if of == split_element(variable)[0]}

    def _start(self, name: str) -> Any:
        starts = [v.start or 0.0 for v in self._variables(split_port(name)[1])]
        return starts if len(starts) > 1 else starts[0]

    def further(self, kept: Sequence[Connection], held: Mapping[str, object]) -> list[Connection]:
        """Connect the inputs that have no source yet; raises `WiringErrors`."""
        ports = [split_port(name) for name in (*(c.target for c in kept), *held)]
        served = {split_element(v)[0] for component, v in ports if component == self.instance}
        added: list[Connection] = []
        mistakes: list[SimulationError] = []
        for name in self.new.base_names("input"):
            if name in served:
                continue
            offers = self._offers(name)
            if len(offers) == 1:
                source, target = f"{offers[0]}.{name}", f"{self.instance}.{name}"
                added.append(Connection(source, target, self._timing(offers[0], name)))
            else:
                many = f"{', '.join(offers)} offer it" if offers else self._lacking(name)
                advice = f'Connect it, or hold it: held={{"{self.instance}.{name}": ...}}.'
                problem = f"{self.instance} needs the input {name} in its new FMU {self.new.model_name}, but {many}"
                mistakes.append(WiringError(problem, advice, (f"{self.instance}.{name}",)))
        if mistakes:
            raise WiringErrors(self.system.name, mistakes)
        return added

    def _offers(self, name: str) -> list[str]:
        shape = self.new.groups[name].shape
        return [
            other
            for other, description in self.descriptions.items()
            if other != self.instance
            and name in description.base_names("output")
            and description.groups[name].shape == shape
        ]

    def _lacking(self, name: str) -> str:
        """Return why no instance offers an input: none has its name, or it is of another size there."""
        wanted = len(self.new.groups[name].elements)
        for other, description in self.descriptions.items():
            if other != self.instance and name in description.base_names("output"):
                size = len(description.groups[name].elements)
                both = f"{other}.{name} has {size} elements, {self.instance}.{name} has {wanted}"
                return f"{both}: name a component with that structure, as in NAME:modes={size}"
        for connection in self.system.connections:
            size = self._size(connection.source)
            if connection.target == f"{self.instance}.{name}" and size is not None and size != wanted:
                both = f"{connection.source} has {size} elements, {self.instance}.{name} has {wanted}"
                return f"{both}: name a component with that structure, as in NAME:width={size}"
        return "no instance has an output of that name"

    def _timing(self, source: str, name: str) -> Timing | None:
        """Take the timing of the other connections between the two, else what is usual for the instance."""
        description = self.descriptions[source]
        if description.groups[name].elements[0] in description.step_means:
            return None
        incoming = [c for c in self.system.connections if split_port(c.target)[0] == self.instance]
        timed = [c for c in incoming if not self._is_step_mean(c)]
        for connection in timed:
            if split_port(connection.source)[0] == source:
                return connection.timing
        return "after_step" if any(c.timing == "after_step" for c in timed) else "at_point"

    def _is_step_mean(self, connection: Connection) -> bool:
        component, variable = split_port(connection.source)
        description = self.descriptions.get(component)
        if description is None:
            return False
        base = split_element(variable)[0]
        return any(split_element(name)[0] == base for name in description.step_means)

    def _variables(self, name: str) -> list[ScalarVariable]:
        if name in self.new.groups:
            return [self.new.variables[e] for e in self.new.groups[name].elements]
        return [self.new.variables[name]] if name in self.new.variables else []

    def _size(self, name: str) -> int | None:
        component, variable = split_port(name)
        description = self.descriptions.get(component)
        if description is None:
            return None
        if variable in description.groups:
            return len(description.groups[variable].elements)
        return 1 if variable in description.variables else None


def _text(connection: Connection) -> str:
    timing = f" ({connection.timing})" if connection.timing else ""
    return f"{connection.source} -> {connection.target}{timing}"
