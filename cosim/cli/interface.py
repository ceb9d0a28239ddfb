"""adcs show FILE.fmu: what its table of variables has no room for, and what would keep the file from running here."""

import zipfile
from collections.abc import Callable, Iterable
from pathlib import Path

import fmpy

from cosim.cli import console
from cosim.errors import CallFailed, SimulationError
from cosim.slaves.opening import open_isolated
from fmus.description.description import ModelDescription, ScalarVariable
from fmus.description.names import Group


def write(path: Path, fmu: ModelDescription) -> None:
    """Print kind, items, proposed experiment, platforms, licences and obstacles of an FMU's file."""
    with zipfile.ZipFile(path) as archive:
        names = archive.namelist()
    kind = "model exchange (integrated here by CVode)" if fmu.model_exchange else "co-simulation"
    lines = ["", f"FMI {fmu.fmi_version}, {kind}"]
    lines += [f"{name}: {items}" for name, items in _items(fmu)]
    lines.append(f"proposed experiment: {_experiment(fmu)}")
    lines.append(f"variable step size: {_word(fmu.can_handle_variable_step)}")
    lines.append(f"once per process only: {_word(fmu.only_once_per_process)}")
    lines.append(f"platforms: {', '.join(fmpy.supported_platforms(str(path))) or 'none'}")
    lines.append(f"licence: {', '.join(_licences(names)) or 'no file under documentation/licenses'}")
    if fmu.unserved:
        lines.append(f"not exchanged: {', '.join(f'{name} ({kind})' for name, kind in fmu.unserved.items())}")
    lines.append("what would keep it from running here:")
    console.write("\n".join([*lines, *(f"  {line}" for line in obstacles(path, fmu) or ["nothing that was found"])]))


def obstacles(path: Path, fmu: ModelDescription) -> list[str]:
    """Return what keeps an FMU from running here, or may; it is loaded and instantiated in another process."""
    found = (
        [f"it needs its tool, {fmu.generation_tool or 'which it does not name'}"] if fmu.needs_execution_tool else []
    )
    silent = [v.name for v in fmu.inputs if v.start is None]
    if silent:
        found.append(
            f"inputs without a start value, which are held at 0 where nothing is connected: {', '.join(silent)}"
        )
    try:
        slave = open_isolated("fmu", path)
        try:
            slave.instantiate()
        finally:
            slave.free()
    except CallFailed as error:
        found.append("\n    ".join([error.what, *error.messages]))
    except SimulationError as error:
        found.append(str(error).removeprefix(f"{path}: "))
    return found


def type_of(variable: ScalarVariable) -> str:
    """Return a variable's type, that of FMI 3.0 where it is of FMI 3.0."""
    return variable.type if variable.element is None else variable.element.type


def range_in_words(fmu: ModelDescription, group: Group) -> str:
    """Return the least and the largest value that an array's elements may have, "" where none is said."""
    least = _one(fmu, group, lambda v: v.minimum)
    largest = _one(fmu, group, lambda v: v.maximum)
    return f"{least} to {largest}" if least and largest else f"from {least}" if least else largest and f"to {largest}"


def _one(fmu: ModelDescription, group: Group, limit: Callable[[ScalarVariable], float | None]) -> str:
    values = {limit(fmu.variables[e]) for e in group.elements}
    value = values.pop() if len(values) == 1 else None
    return "" if value is None else f"{value:g}"


def _items(fmu: ModelDescription) -> list[tuple[str, str]]:
    """Return the names of the enumerations that share a set of items, and the items."""
    sets: dict[tuple[tuple[str, int], ...], list[str]] = {}
    for base, group in fmu.groups.items():
        items = fmu.variables[group.elements[0]].items
        if items:
            sets.setdefault(tuple(items.items()), []).append(base)
    return [(", ".join(names), ", ".join(f"{item} ({n})" for item, n in items)) for items, names in sets.items()]


def _experiment(fmu: ModelDescription) -> str:
    said = fmu.default_experiment
    parts = {"from": said.start, "to": said.stop, "step": said.step_size, "tolerance": said.tolerance}
    units = {"tolerance": ""}
    words = [f"{name} {value:g}{units.get(name, ' s')}" for name, value in parts.items() if value is not None]
    return ", ".join(words) or "none"


def _licences(names: Iterable[str]) -> list[str]:
    return [name for name in names if name.startswith("documentation/licenses/") and not name.endswith("/")]


def _word(said: bool) -> str:
    return "yes" if said else "no"
