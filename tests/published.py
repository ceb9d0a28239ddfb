"""The components of a paper's experiment with the paper's numbers, its inputs those of the start."""

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
from helpers import Point

from components.framework import Component
from cosim.cli.instances import as_arrays
from cosim.studies import papers
from cosim.system import System
from cosim.system.expand import wire
from fmus.description.names import split_port
from fmus.export import references
from fmus.export.describe import describe


def as_in(experiment: str, instance: str, **base: Any) -> Callable[..., Component]:
    """What makes a component of an experiment, as its class does; what its structure changes is the class's again.

    Values by name replace the paper's; `base` for all that it makes.
    """

    def make(**changed: Any) -> Component:
        _, bare, values = _values(experiment)
        component = bare[instance]
        seen = {} if instance == "plant" else _inputs(experiment, instance)  # what acts on a plant is a test's business
        known = seen | values[instance] | base
        whole = type(component)(**(component.structure | known))
        structure = {n: v for n, v in changed.items() if n in component.structure}
        kept = whole.variant(**structure) if structure else whole
        return type(component)(**(kept.given | changed))

    return make


def published(experiment: str, **changed: dict[str, Any]) -> dict[str, Component]:
    """All components of an experiment by instance; `changed`: further values by instance, controller={"K": 0.1}."""
    system, _, _ = _values(experiment)
    unknown = set(changed) - set(system.components)
    if unknown:
        raise KeyError(f"{experiment} has no {', '.join(unknown)}")
    return {name: as_in(experiment, name)(**changed.get(name, {})) for name in system.components}


@cache
def _values(experiment: str) -> tuple[System, dict[str, Component], dict[str, dict[str, Any]]]:
    """The system, its components as in the library, and what it sets and holds in each."""
    system, _ = papers.scenario(experiment)
    bare = {name: references.parse(reference).component() for name, reference in system.components.items()}
    wiring = wire(system, {name: describe(c, c.name, derivatives=True) for name, c in bare.items()})
    return system, bare, {name: as_arrays(wiring, name, {**wiring.settings, **wiring.held}) for name in bare}


@cache
def _inputs(experiment: str, instance: str) -> dict[str, Any]:
    """Connected inputs at the start: those whose source has a start, or is an output that follows from states alone."""
    system, bare, values = _values(experiment)
    found: dict[str, Any] = {}
    for connection in system.connections:
        target, name = split_port(connection.target)
        source, output = split_port(connection.source)
        if target != instance or source == instance:
            continue
        component = type(bare[source])(**(bare[source].structure | values[source]))
        states = _starts(component)
        if output in states:
            found[name] = states[output]
        elif output in component.direct_feedthrough and not component.direct_feedthrough[output]:
            found[name] = Point(component).outputs()[output]
        elif output in component.direct_feedthrough:
            ready = _states_of_others(experiment, source)
            if set(component.direct_feedthrough[output]) <= set(ready):
                whole = type(component)(**(component.structure | values[source] | ready))
                found[name] = Point(whole).outputs()[output]
    return {name: np.asarray(value) for name, value in found.items()}


def _states_of_others(experiment: str, instance: str) -> dict[str, Any]:
    """The inputs of an instance whose source is a state of another one."""
    system, bare, values = _values(experiment)
    found: dict[str, Any] = {}
    for connection in system.connections:
        (source, output), (target, name) = split_port(connection.source), split_port(connection.target)
        if target == instance and output in _starts(bare[source]):
            component = type(bare[source])(**(bare[source].structure | values[source]))
            found[name] = _starts(component)[output]
    return found


def _starts(component: Component) -> dict[str, Any]:
    """The start values of states and outputs that are set."""
    return {
        v.name: v.start for v in (*component.states, *component.exact_outputs) if not getattr(v, "calculated", False)
    }
