"""A system and an experiment are data: what flies, how it is wired, how long and with which master."""

import ast
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np

from cosim.masters.explicit import Explicit
from cosim.masters.master import Master

Timing = Literal["at_point", "after_step", "midpoint", "ramp"]
TIMINGS: tuple[Timing, ...] = ("at_point", "after_step", "midpoint", "ramp")

_NUMBER = re.compile(r"^\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)(.*)$", re.DOTALL)


@dataclass(frozen=True)
class Value:
    """A value with its unit: Value(0.005, "deg"), or in one text: Value("0.005 deg"), Value("[[1,0],[0,2]] kg.m2").

    The unit None means the variable's own. A text that is no number and no list stays a text.
    """

    value: Any
    unit: str | None = None

    def __post_init__(self) -> None:
        """Read a text, make arrays plain."""
        value, unit = plain(self.value), self.unit
        if isinstance(value, str) and unit is None:
            value, unit = _parse(value)
        object.__setattr__(self, "value", value)
        object.__setattr__(self, "unit", unit)


@dataclass(frozen=True)
class Connection:
    """A connection between two variables, arrays or elements: "plant.q_BN" -> "controller.q_BN".

    `timing` decides what the target has as input while it steps from t_k to t_k+1: "at_point" the source's value at
    t_k, "after_step" that at t_k+1, "midpoint" the mean of both, "ramp" the line between them. None: after_step for a
    step mean, at_point otherwise. A target that cannot interpolate its inputs takes a ramp's midpoint.
    """

    source: str
    target: str
    timing: Timing | None = None


@dataclass(frozen=True, kw_only=True)
class System:
    """Components (instance name -> FMU reference) and everything between and in them.

    `parameters`: "plant.J" or "*.J" -> number, nested list or `Value`. `vehicle`: name -> value, set in every component
    that has a parameter of that name; entries of `parameters` win. `held`: input -> value for inputs without a
    connection. `steps`: instance -> n, it steps every n-th communication step.
    """

    name: str
    components: dict[str, str]
    connections: Sequence[Connection] = ()
    parameters: dict[str, Any] = field(default_factory=dict)
    vehicle: dict[str, Any] = field(default_factory=dict)
    held: dict[str, Any] = field(default_factory=dict)
    steps: dict[str, int] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Copy what the caller could change later, make arrays plain, so that equal systems compare equal."""
        object.__setattr__(self, "components", dict(self.components))
        object.__setattr__(self, "connections", tuple(self.connections))
        for name in ("parameters", "vehicle", "held"):
            object.__setattr__(self, name, {k: plain(v) for k, v in getattr(self, name).items()})
        object.__setattr__(self, "steps", dict(self.steps))


@dataclass(frozen=True, kw_only=True)
class Experiment:
    """Times in s, the master, and what is recorded: every n-th row of the variables that match `record`.

    The patterns of `record` choose among inputs and outputs ("*", "plant.*", "*.q_BN"); a local variable is recorded
    where a pattern names it in full. The first and the last row are always recorded.

    `stop_when`: a flag of a component, "plant.cage_contact": where it is there, the run ends at the first communication
    point at which the flag is above 0.5. That is a result, no failure; run.json has it as its `event`.
    """

    stop_time: float
    communication_step_size: float
    master: Master = field(default_factory=Explicit)
    start_time: float = 0.0
    every: int = 1
    record: Sequence[str] = ("*",)
    stop_when: str = ""

    def __post_init__(self) -> None:
        """Make the patterns a tuple."""
        object.__setattr__(self, "record", tuple(self.record))


def plain(value: Any) -> Any:
    """Return arrays, NumPy numbers and tuples as nested lists of Python numbers; all else as it is."""
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    if isinstance(value, list | tuple):
        return [plain(v) for v in value]
    return value


def _parse(text: str) -> tuple[Any, str | None]:
    if text.strip() in ("true", "True", "false", "False"):
        return text.strip().lower() == "true", None
    if text.strip().lower().lstrip("+-") in ("nan", "inf"):
        return float(text), None
    if text.lstrip().startswith("[") and "]" in text:
        end = text.rindex("]") + 1
        try:
            return plain(ast.literal_eval(text[:end].strip())), text[end:].strip() or None
        except (ValueError, SyntaxError):
            return text, None
    match = _NUMBER.match(text)
    if match is None:
        return text, None
    number = float(match[1])
    whole = number.is_integer() and math.isfinite(number) and re.fullmatch(r"[-+]?\d+", match[1])
    return (int(number) if whole else number), match[2].strip() or None
