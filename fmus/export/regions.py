"""The one flat vector that holds every real variable of an FMU; a value reference is an index into it.

    [ p parameters | c calculated parameters | u inputs | x states | y other outputs | s | d state derivatives ]

d exists where the FMU provides directional derivatives (native) of continuous states. e: the first of y, whose start is
set. s: the internal step taken, where there is one.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from components.framework import Component, Output, Variable
from fmus.description.annotations import SOLVER_STEP, STEP_TAKEN

REGIONS = ("p", "c", "u", "x", "y", "s", "d")

_TAKEN = Output(name=STEP_TAKEN, unit="s", doc="internal step of the last communication step")


@dataclass(frozen=True)
class Regions:
    """Region -> its number of scalars, and the value reference of its first one."""

    size: Mapping[str, int]
    offset: Mapping[str, int]


def regions_of(component: Component, derivatives: bool) -> Regions:
    """Return the regions of a component's FMU; derivatives: whether it provides directional ones."""
    groups: dict[str, Iterable[Variable]] = {
        "p": component.parameters,
        "c": component.calculated_parameters,
        "u": component.inputs,
        "x": component.states,
        "y": component.outputs_declared,
        "s": step_taken(component),
        "d": component.states if derivatives and not component.sampled else (),
    }
    size = {region: component.size(groups[region]) for region in REGIONS}
    offset = {region: sum(size[r] for r in REGIONS[:i]) for i, region in enumerate(REGIONS)}
    return Regions(size | {"e": component.size(component.exact_outputs)}, offset | {"e": offset["y"]})


def step_taken(component: Component) -> tuple[Variable, ...]:
    """Return the variable that tells the internal step, of a component that has one."""
    moving = component.size(component.states) and any(p.name == SOLVER_STEP for p in component.parameters)
    return (_TAKEN,) if moving else ()
