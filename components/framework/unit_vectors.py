"""Unit vectors: attitude quaternions and axes, declared with `unit_length`; of a matrix each column is one.

    v / |v|  where  ROUNDING < ||v| - 1| <= TYPED,  else v as it is                                (1)

What was typed with three or more digits is divided by its length when an FMU enters and leaves initialization mode, and
an axis that is tunable when it is set in flight; the FMU says so. What is off by rounding keeps its bits, what is
further off is refused. Inputs, and states that initialization calculates, are what others make of them.

Shapes: a column v (n,) or a matrix (n, columns), each element of unit 1.
Invariants: 1 - ROUNDING <= |v| <= 1 + ROUNDING after (1), and (1) again changes no bit.
"""

from collections.abc import Iterable, Iterator
from typing import Any

import casadi as ca

from .equations import Condition, Equations
from .variables import Parameter, State, Variable

ROUNDING = 1e-12  # of numbers that were computed, or written with 13 digits
TYPED = 1e-3  # of three digits: each is off by 5e-4, the length by up to 5e-4 |v|_1 <= 1e-3 (four elements)


def unit_vectors(group: Iterable[Variable]) -> list[Variable]:
    """Return the unit vectors among states or parameters, but for states whose start is calculated."""
    declared = (v for v in group if isinstance(v, State | Parameter) and v.unit_length)
    return [v for v in declared if not (isinstance(v, State) and v.calculated)]


def lengths_said(group: Iterable[Variable]) -> list[str]:
    """Return 'q_BN has norm', 'axis 2 of spin_axes_B has length' of every unit vector in a group of variables."""
    return [what for variable in unit_vectors(group) for what in _said(variable)]


def unit_conditions(part: Equations, x: Any, p: Any) -> list[Condition]:
    """Return the conditions that no unit vector is further off than typing makes it."""
    values = vars(x) | vars(p)
    conditions: list[Condition] = []
    for variable in unit_vectors((*part.states, *part.parameters)):
        rest = f", a unit vector (within {TYPED:g}) is needed. Divide it by its length."
        if _quaternion(variable):
            rest = f" at the start, a unit quaternion (within {TYPED:g}) is needed. Divide it by its norm."
        for what, column in zip(_said(variable), _columns(variable, values[variable.name]), strict=True):
            length = ca.norm_2(column)
            conditions.append(Condition(TYPED - ca.fabs(length - 1), f"{what} {{}}{rest}", (length,)))
    return conditions


def normalised(group: Iterable[Variable], values: dict[str, Any]) -> tuple[list[Any], dict[str, Any]]:
    """Return the lengths of the unit vectors in a group of variables, and `values` with each of them as in (1)."""
    lengths: list[Any] = []
    found = dict(values)
    for variable in unit_vectors(group):
        columns = _columns(variable, values[variable.name])
        own = [ca.norm_2(column) for column in columns]
        # dividing by 1 keeps every bit, the sign of a zero too
        found[variable.name] = ca.horzcat(*(v / ca.if_else(_typed(n), n, 1) for v, n in zip(columns, own, strict=True)))
        lengths += own
    return lengths, found


def is_typed(length: float) -> bool:
    """Return whether a length is off 1 as far as (1) divides by it."""
    return ROUNDING < abs(length - 1) <= TYPED


def _typed(length: Any) -> Any:
    off = ca.fabs(length - 1)
    return ca.logic_and(off > ROUNDING, off <= TYPED)


def _quaternion(variable: Variable) -> bool:
    return variable.shape[0] == 4


def _columns(variable: Variable, value: Any) -> list[Any]:
    return [value] if len(variable.shape) == 1 else [value[:, i] for i in range(variable.shape[1])]


def _said(variable: Variable) -> Iterator[str]:
    if len(variable.shape) == 1:
        yield f"{variable.name} has {'norm' if _quaternion(variable) else 'length'}"
    for i in range(*variable.shape[1:]) if len(variable.shape) > 1 else ():
        yield f"axis {i + 1} of {variable.name} has length"
