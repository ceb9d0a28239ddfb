"""A value with its unit, as a user writes it in Python, in a parameter file or on the command line."""

import ast
import math
import re
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from cosim.quantity import split_quantity


@dataclass(frozen=True)
class Value:
    """A value with its unit: Value(0.005, "deg"), or in one text: Value("0.005 deg"), Value("[[1,0],[0,2]] kg.m2").

    The unit None means the variable's own. A text in quotes, and one that is no number and no list, stays a text.
    `text` is what was written, for variables whose values are words.
    """

    value: Any
    unit: str | None = None
    text: str | None = field(default=None, init=False, compare=False, repr=False)

    def __post_init__(self) -> None:
        """Read a text, make arrays plain."""
        value, unit = plain(self.value), self.unit
        if isinstance(value, str) and unit is None:
            object.__setattr__(self, "text", unquoted(value))
            value, unit = _parse(value)
        object.__setattr__(self, "value", value)
        object.__setattr__(self, "unit", unit)


def plain(value: Any) -> Any:
    """Return arrays, NumPy numbers and tuples as nested lists of Python numbers; all else as it is."""
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    if isinstance(value, list | tuple):
        return [plain(v) for v in value]  # pyright: ignore[reportUnknownVariableType]
    return value


def as_written(value: Any) -> Any:
    """Return a value as one writes it: with its unit, as a text."""
    if not isinstance(value, Value):
        return value
    return value.text or (value.value if value.unit is None else f"{value.value} {value.unit}")


def unquoted(text: str) -> str:
    """Return a text without the quotes around it, which keep a text that looks like a number a text."""
    bare = text.strip()
    return bare[1:-1] if len(bare) >= 2 and bare[0] == bare[-1] and bare[0] in "\"'" else text


def _parse(text: str) -> tuple[Any, str | None]:
    if unquoted(text) != text:
        return unquoted(text), None
    if text.strip() in ("true", "True", "false", "False"):
        return text.strip().lower() == "true", None
    if re.fullmatch(r"[-+]?(nan|inf)", text.strip().lower()):
        return float(text), None
    if text.lstrip().startswith("[") and "]" in text:
        end = text.rindex("]") + 1
        try:
            return plain(ast.literal_eval(text[:end].strip())), text[end:].strip() or None
        except (ValueError, SyntaxError, RecursionError, MemoryError):
            return text, None
    quantity = split_quantity(text)
    if quantity is None:
        return text, None
    number, unit = float(quantity[0]), quantity[1]
    whole = number.is_integer() and math.isfinite(number) and re.fullmatch(r"[-+]?\d+", quantity[0])
    return (int(number) if whole else number), unit or None
