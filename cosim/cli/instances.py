"""The FMUs of a system's instances: what they say of themselves, and the values that a system gives them."""

from collections.abc import Callable, Generator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from cosim.cli.library import Library
from cosim.errors import UnknownName
from cosim.system import System
from cosim.system.reference import is_fmu
from cosim.system.wiring import Port, Wiring
from fmus.description.description import ModelDescription
from fmus.description.names import nested, split_element
from fmus.description.read import read_description
from fmus.export import references
from fmus.export.blame import blamed
from fmus.export.build import CATALOG

Locate = Callable[[Any], Path]


def read_descriptions(system: System, locate: Locate) -> dict[str, ModelDescription]:
    """Return the description of each instance's FMU."""
    return {name: read_description(locate(reference)) for name, reference in system.components.items()}


@contextmanager
def components_too() -> Generator[None]:
    """Tell an unknown system as an unknown component or system: for commands that take both."""
    try:
        yield
    except UnknownName as error:
        if error.kind != "system":
            raise
        known = [*CATALOG, *error.available]
        raise UnknownName("component or system", error.name, "the catalog and the papers", known) from error


def describe(reference: Any) -> ModelDescription:
    """Return what the FMU of a reference says; of a component from its declarations, so that nothing is built."""
    from fmus.export.native.native_fmu import describe_native
    from fmus.export.python.python_fmu import describe_python

    if is_fmu(reference):
        return read_description(Library()(reference))
    parsed = references.parse(reference)
    component = parsed.component()
    with blamed(parsed.file and parsed.file.resolve().parent):
        return (describe_python if component.python_only else describe_native)(component, parsed.model_name)


def as_arrays(wiring: Wiring, instance: str, given: Mapping[Port, Any]) -> dict[str, Any]:
    """Return the values of an instance among those given, whole arrays in the FMU's own units."""
    fmu = wiring.descriptions[instance]
    scalars = {p.variable: v for p, v in given.items() if p.component == instance}
    values: dict[str, Any] = {}
    for base in {split_element(name)[0] for name in scalars}:
        group = fmu.groups[base]
        flat = [scalars.get(e, fmu.variables[e].start) for e in group.elements]
        values[base] = nested(flat, group.shape)
    return values
