"""Filters between an input and what is connected to it: a notch, a delay, any FMU that takes u and shows y."""

from dataclasses import replace

from cosim.errors import WiringError
from cosim.system.reference import Reference
from cosim.system.system import Connection, System, Timing
from fmus.description.names import canonical


def with_filters(system: System, target: str, **filters: Reference) -> System:
    """Return the system with filters, by their instance names, between `target` and what is connected to it.

    with_filters(system, "plant.tau_B", notch="Notch:width=3,unit=N.m", delay="Delay:width=3,unit=N.m")

    They stand in the order of what goes through them. The target keeps its timing; where that is at_point, a filter has
    the line between two points as its input, so that what goes through it loses no time on the way.

    Raises `WiringError` where nothing is connected to the target, or an instance has a filter's name.
    """
    old = next((c for c in system.connections if canonical(c.target) == canonical(target)), None)
    if old is None:
        connected = ", ".join(c.target for c in system.connections) or "nothing"
        problem = f"{target} has no connection that filters could be put into"
        raise WiringError(problem, f"Connected are: {connected}.", (target,))
    for name in filters.keys() & system.components.keys():
        problem = f"there is a component {name} already, and a filter before {target} is to have that name"
        raise WiringError(problem, "Choose another name.", (target,))
    inside: Timing = "ramp" if old.timing is None or old.timing == "at_point" else old.timing
    sources = [old.source, *(f"{name}.y" for name in filters)]
    targets = [*(f"{name}.u" for name in filters), old.target]
    timings: list[Timing | None] = [*(inside for _ in filters), old.timing]
    chain = [Connection(*ends) for ends in zip(sources, targets, timings, strict=True)]
    connections = [link for c in system.connections for link in (chain if c is old else [c])]
    return replace(system, components={**system.components, **filters}, connections=connections)
