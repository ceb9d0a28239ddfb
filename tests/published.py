"""The components of a paper's experiment with the paper's numbers, as its system sets them."""

from functools import cache
from typing import Any

from components.framework import Component
from cosim.cli.instances import start_values
from cosim.studies import papers
from cosim.system.expand import wire
from fmus.export import references
from fmus.export.describe import describe


def published(experiment: str, **changed: dict[str, Any]) -> dict[str, Component]:
    """Instance -> component; `changed`: further values by instance, e.g. controller={"K": 0.1}."""
    values = _values(experiment)
    unknown = set(changed) - set(values)
    if unknown:
        raise KeyError(f"{experiment} has no {', '.join(unknown)}")
    return {
        name: type(bare)(**bare.structure, **(starts | changed.get(name, {})))
        for name, (bare, starts) in values.items()
    }


@cache
def _values(experiment: str) -> dict[str, tuple[Component, dict[str, Any]]]:
    """Instance -> the component as in the library, and what the system sets and holds in it."""
    system, _ = papers.scenario(experiment)
    bare = {name: references.parse(reference).component() for name, reference in system.components.items()}
    wiring = wire(system, {name: describe(c, c.name, derivatives=True) for name, c in bare.items()})
    return {name: (component, start_values(wiring, name)) for name, component in bare.items()}
