"""Conditions that many components ask of their parameters, element by element; a message names element and unit."""

from collections.abc import Iterator
from typing import Any

import casadi as ca

from .component import Component
from .equations import Condition


def positive(component: Component, p: Any, *names: str) -> list[Condition]:
    """Return the conditions that every element of the named parameters is above zero."""
    return [
        Condition(value, f"{what}: it must be positive.", (value,)) for what, value in _elements(component, p, names)
    ]


def not_negative(component: Component, p: Any, *names: str) -> list[Condition]:
    """Return the conditions that no element of the named parameters is below zero."""
    return [
        Condition(value >= 0, f"{what}: it must not be negative.", (value,))
        for what, value in _elements(component, p, names)
    ]


def flag_conditions(component: Component, p: Any, *names: str) -> list[Condition]:
    """Return the conditions that every element of the named parameters, options of a law, is 0 or 1."""
    return [
        Condition(value * (value - 1) == 0, f"{what}: it must be 0 or 1.", (value,))
        for what, value in _elements(component, p, names)
    ]


def lag_condition(p: Any, name: str) -> Condition:
    """Return the condition that a time constant is zero, for none, or one that the internal integrator can follow."""
    lag, step = vars(p)[name], vars(p)["solver.step"]
    text = f"{name} = {{}} s: it must be 0 or at least half the internal step, solver.step = {{}} s."
    return Condition(ca.logic_or(lag == 0, lag >= step / 2), text, (lag, step))


def _elements(component: Component, p: Any, names: tuple[str, ...]) -> Iterator[tuple[str, Any]]:
    """Yield 'name[i] = {} unit' and the value of every element of the named parameters, row by row."""
    declared = {v.name: v for v in component.parameters}
    for name in names:
        unit = "" if declared[name].unit == "1" else f" {declared[name].unit}"
        rows = vars(p)[name].T  # CasADi counts column by column
        for i, element in enumerate(declared[name].elements()):
            yield f"{element} = {{}}{unit}", rows[i]
