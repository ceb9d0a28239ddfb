"""The FMUs of a system's instances: what they say of themselves, and each built with the system's values."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from cosim.cli import scenario
from cosim.cli.library import Library
from cosim.errors import UnknownName
from cosim.system import System
from cosim.system.expand import wire
from cosim.system.reference import is_fmu
from cosim.system.wiring import Wiring
from fmus.description.description import ModelDescription
from fmus.description.names import nested, split_element
from fmus.description.read import read_description
from fmus.export.build import CATALOG, build_reference

Locate = Callable[[Any], Path]


def read_descriptions(system: System, locate: Locate) -> dict[str, ModelDescription]:
    """Return the description of each instance's FMU."""
    return {name: read_description(locate(reference)) for name, reference in system.components.items()}


def build_system(
    name: str, backends: Sequence[str], platforms: Sequence[str], folder: Path | None, note: Callable[[str], None]
) -> list[Path]:
    """Build a component of a file, or each instance of a system into `folder`, and return the FMUs.

    The FMUs of a system have the system's parameters as start values, so that they can be wired elsewhere as they are.
    """
    try:
        found, _ = scenario.load(name)
    except scenario.NoScenario:
        return [build_reference(name, b, platforms, folder, announce=note) for b in backends]
    except UnknownName as error:
        if error.kind != "system":
            raise
        known = [*CATALOG, *error.available]
        raise UnknownName("component or system", name, "the catalog and the papers", known) from error
    paths: list[Path] = []
    for backend in backends:
        place = (folder or Path(found.name)) / (backend if len(backends) > 1 else "")
        wiring = wire(found, read_descriptions(found, Library(backend, note)))
        for instance, reference in found.components.items():
            if not is_fmu(reference):
                values = start_values(wiring, instance)
                paths.append(build_reference(reference, backend, platforms, place, values, instance, note))
            else:
                note(f"{instance} is {reference} as it is")
    return paths


def start_values(wiring: Wiring, instance: str) -> dict[str, Any]:
    """Return what a system sets and holds in an instance, as whole arrays in the FMU's own units."""
    fmu = wiring.descriptions[instance]
    scalars = {p.variable: v for p, v in {**wiring.settings, **wiring.held}.items() if p.component == instance}
    values: dict[str, Any] = {}
    for base in {split_element(name)[0] for name in scalars}:
        group = fmu.groups[base]
        flat = [scalars.get(e, fmu.variables[e].start) for e in group.elements]
        values[base] = nested(flat, group.shape)
    return values
