"""What a run flies with: parameters, calculated ones too, and initial states of every FMU.

Of an FMU of ours they are read from the instance, once it is initialized; of any other, which may not like to be asked,
they are what was set, else the start value of modelDescription.xml (None: it has none).
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from cosim.errors import CallFailed
from cosim.masters.calls import read
from cosim.masters.types import Kind, Texts, kind_of
from cosim.slaves.slave import References, Slave
from cosim.system.wiring import Port, Wiring
from fmus.description.description import ModelDescription, Scalar, ScalarVariable
from fmus.description.names import Group, nested

Values = dict[str, dict[str, dict[str, Any]]]
"""Instance -> variable, arrays whole -> {"value", "unit"}."""


def is_given(variable: ScalarVariable) -> bool:
    """Whether a variable is one that a run flies with: a parameter, calculated or not, or a settable initial state."""
    return variable.is_parameter or variable.causality == "calculatedParameter"


def groups_of(description: ModelDescription) -> dict[str, Group]:
    """Return the variables that a run flies with, arrays whole."""
    groups = description.groups.items()
    return {base: g for base, g in groups if all(is_given(description.variables[e]) for e in g.elements)}


class Effective:
    """Which values are asked of which instance; worked out once for many flights."""

    def __init__(self, wiring: Wiring) -> None:
        self._wiring = wiring
        self._groups = {name: groups_of(description) for name, description in wiring.descriptions.items()}
        self._calls = {
            name: _calls(description, self._groups[name])
            for name, description in wiring.descriptions.items()
            if description.refresh
        }

    def read(self, slaves: Mapping[str, Slave], settings: Mapping[Port, Scalar]) -> Values:
        """Return the values of instances that are initialized; `settings`: what was set in them."""
        return {name: self._of(name, slave, settings) for name, slave in slaves.items()}

    def _of(self, name: str, slave: Slave, settings: Mapping[Port, Scalar]) -> dict[str, dict[str, Any]]:
        variables = self._wiring.descriptions[name].variables
        try:
            known = _asked(slave, self._calls.get(name, {}))
        except CallFailed:
            known = {}
        return {
            base: {
                "value": nested([_value(e, variables, name, known, settings) for e in g.elements], g.shape),
                "unit": variables[g.elements[0]].unit if g.elements else None,
            }
            for base, g in self._groups[name].items()
        }


def _calls(description: ModelDescription, groups: Mapping[str, Group]) -> dict[Kind, tuple[References, list[str]]]:
    """Return kind -> value references and names."""
    wanted = [description.variables[e] for g in groups.values() for e in g.elements]
    found: dict[Kind, tuple[References, list[str]]] = {}
    for kind in {kind_of(v) for v in wanted} - {Kind.STRING}:  # a String is what was set
        mine = [v for v in wanted if kind_of(v) == kind]
        found[kind] = tuple(v.value_reference for v in mine), [v.name for v in mine]
    return found


def _asked(slave: Slave, calls: Mapping[Kind, tuple[References, list[str]]]) -> dict[str, float]:
    found: dict[str, float] = {}
    for kind, (references, names) in calls.items():
        found |= zip(names, np.asarray(read(slave, kind, references, Texts())).tolist(), strict=True)
    return found


def _value(
    element: str,
    variables: Mapping[str, ScalarVariable],
    instance: str,
    known: Mapping[str, float],
    settings: Mapping[Port, Scalar],
) -> Scalar | None:
    if element in known:
        value, kind = known[element], variables[element].type
        return value if kind == "Real" else bool(value) if kind == "Boolean" else int(value)
    return settings.get(Port(instance, element), variables[element].start)
