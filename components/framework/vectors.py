"""Variables of one role: by name, as a component's equations see them, and as one flat column, matrices row by row."""

from collections.abc import Iterable
from types import SimpleNamespace
from typing import Any

import casadi as ca

from .errors import ComponentError, hint
from .variables import Variable


class Values(SimpleNamespace):
    """The variables of one role under their names."""

    def __getattr__(self, name: str) -> Any:
        """Name the nearest variables where one does not exist."""
        known = list(vars(self))
        raise AttributeError(f"no variable {name!r} here.{hint(name, known)} There are: {', '.join(known)}")


def unflatten(group: Iterable[Variable], vector: Any) -> dict[str, Any]:
    """Return name -> scalar, column or matrix of a flat CasADi vector."""
    values: dict[str, Any] = {}
    at = 0
    for v in group:
        part = vector[at : at + v.size]
        at += v.size
        values[v.name] = ca.reshape(part, v.shape[1], v.shape[0]).T if len(v.shape) == 2 else part
    return values


def flatten(component: str, where: str, group: Iterable[Variable], values: dict[str, Any]) -> ca.SX:
    """Return the values of a group as one column; every variable must be there with its shape, and nothing else."""
    group = tuple(group)
    names = [v.name for v in group]
    extra = [n for n in values if n not in names]
    if extra:
        raise ComponentError(component, f"{where} returns {extra[0]!r}, which it should not.{hint(extra[0], names)}")
    columns: list[Any] = []
    for v in group:
        if v.name not in values:
            raise ComponentError(component, f"{where} does not return {v.name!r}.")
        value = ca.densify(ca.SX(values[v.name]))
        rows, cols = (*v.shape, 1, 1)[:2]
        if value.shape == (1, 1) and v.size != 1 and v.size:
            raise ComponentError(component, f"{where}: {v.name} is a scalar, declared with shape {v.shape}.")
        if value.shape not in ((rows, cols), (cols, rows) if len(v.shape) == 1 else (rows, cols)):
            raise ComponentError(component, f"{where}: {v.name} has shape {value.shape}, declared with {v.shape}.")
        columns.append(ca.vec(value.T) if len(v.shape) == 2 else ca.vec(value))
    return ca.densify(ca.vertcat(*columns)) if columns else ca.SX(0, 1)
