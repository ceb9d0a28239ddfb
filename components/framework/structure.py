"""Structural parameters: what a component is made with, and keeps: how many elements it has, in which unit.

They are class attributes annotated `int` or `str`: `modes: int = 2`, `unit: str = "N.m"`. A shape may name a whole
number, a unit may name a text: `Input(unit="unit", shape=("width",))`, and `unit="unit/s"` for its time derivative.
"""

import inspect
import re
from collections.abc import Mapping

from .units import UNITS, rate_unit

TEXT = re.compile(r"[A-Za-z0-9./()]+")
"""What a text may consist of: what units do."""


def structural(cls: type, base: type) -> dict[str, int | str]:
    """Return the structural parameters of a class with their defaults, its bases' first; none is of `base` itself."""
    found: dict[str, int | str] = {}
    for owner in reversed(cls.__mro__):
        for name, kind in inspect.get_annotations(owner).items():
            if kind in (int, str, "int", "str") and not name.startswith("_") and not hasattr(base, name):
                found[name] = getattr(cls, name)
    return found


def checked(name: str, default: int | str, value: object) -> int | str:
    """Return the value of a structural parameter, as the kind that its default is; ValueError where it is none."""
    what = f"structural parameter {name} = {value!r} is"
    if isinstance(default, str):
        text = str(value) if isinstance(value, int) and not isinstance(value, bool) else value
        if not isinstance(text, str) or not TEXT.fullmatch(text):
            raise ValueError(f"{what} not a text of letters, digits and . / ( ).")
        return text
    if isinstance(value, bool) or not isinstance(value, int) or value < 0:
        raise ValueError(f"{what} not a whole number >= 0.")
    return value


def unit_of(declared: str, structure: Mapping[str, int | str]) -> str:
    """Return the unit that is declared, by itself or by the name of a text; ValueError where a rate has no unit."""
    unit = structure.get(declared.removesuffix("/s"))
    if declared in UNITS or not isinstance(unit, str):
        return declared
    if unit not in UNITS or not declared.endswith("/s"):
        return unit
    rate = rate_unit(unit)
    if rate is None:
        raise ValueError(f"there is no unit of the rate of what is in {unit}")
    return rate


def follows(names: tuple[object, ...], changed: Mapping[str, object]) -> bool:
    """Return whether a shape or a unit names one of the structural parameters that change."""
    return any(isinstance(name, str) and name.removesuffix("/s") in changed for name in names)
