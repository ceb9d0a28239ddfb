"""What `adcs show` and `adcs build` say about a system before it flies, and about an FMU."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from cosim import graph, scenario
from cosim.errors import UnknownName
from cosim.interface import Interface
from cosim.library import Library
from cosim.links import Wiring
from cosim.names import split_element
from cosim.slave import read_interface
from cosim.system import Experiment, System
from cosim.wiring import wire
from fmus.build import build_reference, is_component

Locate = Callable[[str], Path]


def interfaces(system: System, locate: Locate) -> dict[str, Interface]:
    """Return the interface of each instance's FMU."""
    return {name: read_interface(locate(reference)) for name, reference in system.components.items()}


def system(system: System, experiment: Experiment, locate: Locate) -> str:
    """Return connection table, evaluation order, feedthrough, loops and delayed paths of a system, as text."""
    wiring = wire(system, interfaces(system, locate))
    master: Any = experiment.master
    if hasattr(master, "timed"):
        wiring = master.timed(wiring)
    lines = [f"{system.name}: {experiment.stop_time:g} s in steps of {experiment.communication_step_size:g} s", ""]
    lines += _table(("from", "to", "timing"), _connections(wiring))
    lines += ["", *_table(("held", "value"), [(str(port), f"{value:g}") for port, value in wiring.held.items()])]
    lines += ["", f"stepping order: {', '.join(graph.stepping_order(wiring))}", "direct feedthrough:"]
    lines += [f"  {line}" for name in wiring.components for line in _feedthrough(name, wiring.interfaces[name])] or [
        "  none"
    ]
    loops = [*graph.algebraic_loops(wiring), *graph.algebraic_loops(wiring, initial=True)]
    lines += ["algebraic loops: " + ("" if loops else "none"), *(f"  {' <- '.join(loop)}" for loop in loops)]
    delayed = [str(path) for path in graph.refresh_order(wiring).delayed]
    lines += ["delayed paths: " + ("" if delayed else "none"), *(f"  {path}" for path in delayed)]
    return "\n".join(lines)


def interface(path: Path) -> str:
    """Return the interface of an FMU as text."""
    fmu = read_interface(path)
    lines = [f"{fmu.model_name}: {fmu.description}", f"made by {fmu.generation_tool}, GUID {fmu.guid}", ""]
    rows = []
    for base, group in fmu.groups.items():
        first = fmu.variables[group.elements[0]]
        if base.startswith("der("):
            continue
        size = f"[{','.join(map(str, group.shape))}]" if group.shape else ""
        rows.append((f"{base}{size}", first.causality, first.variability, first.unit or "", first.description))
    lines += _table(("variable", "causality", "variability", "unit", "description"), rows)
    can = {
        "input interpolation": fmu.can_interpolate_inputs,
        "output derivatives": fmu.max_output_derivative_order > 0,
        "get and set state": fmu.can_get_and_set_state,
        "serialize state": fmu.can_serialize_state,
        "directional derivatives": fmu.provides_directional_derivative,
        "re-evaluation at a communication point": fmu.refresh,
    }
    lines += ["", "direct feedthrough:", *([f"  {line}" for line in _feedthrough("", fmu)] or ["  none"])]
    lines += ["", *(f"{name}: {'yes' if offered else 'no'}" for name, offered in can.items())]
    return "\n".join(lines)


def built(
    name: str, backends: Sequence[str], platforms: Sequence[str], folder: Path | None, note: Callable[[str], None]
) -> list[Path]:
    """Build a component, or each instance of a system into `folder`, and return the FMUs.

    The FMUs of a system have the system's parameters as start values, so that they can be wired elsewhere as they are.
    """
    try:
        found, _ = scenario.load(name) if not is_component(name) else (None, None)
    except UnknownName:
        found = None
    if found is None:
        return [build_reference(name, b, platforms, folder, announce=note) for b in backends]
    paths: list[Path] = []
    for backend in backends:
        place = (folder or Path(found.name)) / (backend if len(backends) > 1 else "")
        wiring = wire(found, interfaces(found, Library(backend, note)))
        for instance, reference in found.components.items():
            if not reference.endswith(".fmu"):
                values = _start_values(wiring, instance)
                paths.append(build_reference(reference, backend, platforms, place, values, instance, note))
    return paths


def _start_values(wiring: Wiring, instance: str) -> dict[str, Any]:
    """Return what a system sets and holds in an instance, as whole arrays in the FMU's own units."""
    fmu = wiring.interfaces[instance]
    scalars = {p.variable: v for p, v in {**wiring.settings, **wiring.held}.items() if p.component == instance}
    values: dict[str, Any] = {}
    for base in {split_element(name)[0] for name in scalars}:
        group = fmu.groups[base]
        flat = [scalars.get(e, fmu.variables[e].start) for e in group.elements]
        values[base] = _shaped(flat, group.shape)
    return values


def _shaped(flat: list[Any], shape: tuple[int, ...]) -> Any:
    if not shape:
        return flat[0]
    if len(shape) == 1:
        return flat
    return [flat[i : i + shape[1]] for i in range(0, len(flat), shape[1])]


def _connections(wiring: Wiring) -> list[tuple[str, str, str]]:
    """Return one row per connected array: elements are joined where they have one timing."""
    rows: dict[tuple[str, str, str], None] = {}
    for link in wiring.links:
        source, target = (f"{p.component}.{split_element(p.variable)[0]}" for p in (link.source, link.target))
        rows[source, target, "step mean" if link.step_mean else link.timing] = None
    return list(rows)


def _feedthrough(name: str, fmu: Interface) -> list[str]:
    """Return lines `output <- inputs` of an FMU, by arrays."""
    table: dict[str, dict[str, None]] = {}
    for output in fmu.real_outputs:
        for port in fmu.feedthrough(output.name):
            table.setdefault(split_element(output.name)[0], {})[split_element(port)[0]] = None
    prefix = f"{name}." if name else ""
    return [f"{prefix}{output} <- {', '.join(inputs)}" for output, inputs in table.items()]


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    widths = [max(len(row[i]) for row in (head, *rows)) for i in range(len(head))]
    lines = [
        "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in (head, *rows)
    ]
    return [lines[0], "  ".join("-" * width for width in widths), *lines[1:]] if rows else []
