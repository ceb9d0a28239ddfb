"""Declarations: a variable of a component, declared once, as data. Everything else is derived from it."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np


@dataclass(frozen=True, kw_only=True)
class Variable:
    """A real variable with a unit and a shape.

    unit: a name in units.UNITS, or the name of a structural text (structure.py). shape: () scalar, (n,) column, (r, c)
    matrix; an entry may be the name of a structural number. start: a number (for every element), a nested sequence of
    the shape, or a function of the component that returns one. display_unit, nominal, min, max: as in FMI, for every
    element. name is set by the component's class.
    """

    unit: str
    doc: str
    shape: tuple[Any, ...] = ()
    start: Any = 0.0
    display_unit: str | None = None
    nominal: float | None = None
    min: float | None = None
    max: float | None = None
    name: str = ""

    def __get__(self, instance: object, owner: type) -> Any:
        """Allow `self.J` nowhere: a variable's value exists only inside x, u, p of an equation."""
        return self

    @property
    def size(self) -> int:
        """Number of scalar elements."""
        return int(np.prod(self.shape, dtype=int))

    def elements(self) -> Iterator[str]:
        """Yield the FMI names of the elements, row by row: `name`, `name[i]` or `name[i,j]`, 1-based."""
        if not self.shape:
            yield self.name
        for index in product(*(range(1, n + 1) for n in self.shape)) if self.shape else ():
            yield f"{self.name}[{','.join(map(str, index))}]"


@dataclass(frozen=True, kw_only=True)
class Parameter(Variable):
    """A number that a user may set: fixed at the end of initialization, or tunable between steps.

    shared: it is one of the vehicle, with one value in every component that knows it. unit_length: it is a quaternion,
    an axis, or a matrix with an axis a column (unit_vectors.py).
    """

    tunable: bool = False
    shared: bool = False
    unit_length: bool = False


@dataclass(frozen=True, kw_only=True)
class CalculatedParameter(Variable):
    """What follows from parameters, computed by `calculate(p)`; tunable where it depends on a tunable parameter."""

    tunable: bool = False


@dataclass(frozen=True, kw_only=True)
class Input(Variable):
    """An input; its start value is what the component sees when nothing is connected.

    rate_acts: its rate acts on the component too, up to its sign, as the torque does that changes a stored momentum.
    Who takes it so must not take the mean of that rate (`Output.mean_of`) beside it.
    """

    rate_acts: bool = False


@dataclass(frozen=True, kw_only=True)
class State(Variable):
    """A state: continuous (`derivatives`), of a sampled component (`update`), or of a Python-only one (`step`).

    output: it is an output too. calculated: its start value comes from `initial(t, u, p)` and cannot be set.
    unit_length: its start is a quaternion or an axis (unit_vectors.py).
    """

    output: bool = False
    calculated: bool = False
    unit_length: bool = False


@dataclass(frozen=True, kw_only=True)
class Output(Variable):
    """An output, computed by `outputs(t, x, u, p)`.

    step_mean: the output is instead the mean, over the last communication step, of the time derivative of what
    `step_means(t, x, p)` gives for it. It keeps the total momentum when two units exchange a torque. mean_of: the
    output, of the same shape, whose rate that is, up to its sign.

    exact: its start value is set, as FMI's initial="exact" says, and calculated states follow from it by `initial`, of
    which `outputs` is then the inverse. The value that was set is shown as it is until after initialization something
    is set or a step is made.
    """

    step_mean: bool = False
    mean_of: str = ""
    exact: bool = False


def expand(value: Any, shape: tuple[int, ...]) -> np.ndarray:
    """Return the start value as an array of the shape, a scalar repeated; ValueError where it does not fit."""
    array = np.asarray(value, dtype=float)
    if array.shape == shape:
        return array
    if array.shape != ():
        raise ValueError(f"start value has shape {array.shape}, declared shape is {shape}")
    return np.full(shape, float(array))


def settled(variable: Variable, structure: dict[str, Any], start: Any, component: Any) -> dict[str, Any]:
    """Return the shape in numbers and the start value as an array, for dataclasses.replace."""
    unknown = [n for n in variable.shape if isinstance(n, str) and not isinstance(structure.get(n), int)]
    if unknown:
        raise ValueError(f"shape names {unknown[0]!r}, the structural parameters are: {', '.join(structure) or 'none'}")
    shape = tuple(structure[n] if isinstance(n, str) else n for n in variable.shape)
    value: Any = start
    if isinstance(value, Callable):
        value = value(component)
    return {"shape": shape, "start": expand(value, shape)}
