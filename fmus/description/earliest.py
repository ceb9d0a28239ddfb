"""What FMI 1.0 says in places of its own: which inputs an output follows, when a start value holds, capabilities.

A start value holds (`fixed`, FMI 1.0's default) for parameters and inputs; of states it is initial="exact".
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from fmus.description.description import ScalarVariable
from fmus.description.names import canonical


def interface(variables: Mapping[str, ScalarVariable], root: Any) -> dict[str, Any]:
    """Return variables, and of each output the inputs on which it depends (None: all), as the elements say."""
    tags = {canonical(v.get("name")): v for v in root.find("ModelVariables")}
    found = {name: _with_initial(v, tags[name]) for name, v in variables.items()}
    depends = {v.name: _named(tags[v.name]) for v in found.values() if v.causality == "output"}
    return {"variables": found, "dependencies": depends, "initial_unknowns": depends}


def _with_initial(v: ScalarVariable, tag: Any) -> ScalarVariable:
    given = v.start is not None and tag[0].get("fixed", "true") in ("true", "1")
    exact = v.causality in ("input", "parameter") or (given and v.causality in ("output", "local"))
    return replace(v, initial="exact" if exact else "calculated")


def _named(tag: Any) -> tuple[str, ...] | None:
    listed = tag.find("DirectDependency")
    return None if listed is None else tuple(canonical(name.text) for name in listed.findall("Name"))


def capabilities(root: Any) -> dict[str, Any]:
    """Return the capabilities that stand under Implementation."""
    said = root.find("Implementation//Capabilities")
    attributes: Mapping[str, str] = {} if said is None else said.attrib

    def can(name: str) -> bool:
        return attributes.get(name) in ("true", "1")

    return {
        "can_handle_variable_step": can("canHandleVariableCommunicationStepSize"),
    }  # derivatives of inputs and outputs are not asked for
