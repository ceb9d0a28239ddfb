"""What `adcs show` and `adcs build` say about a system before it flies, and about an FMU."""

import dataclasses
import textwrap
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from cosim.cli import scenario
from cosim.cli.library import Library
from cosim.errors import UnknownName
from cosim.system import graph
from cosim.system.expand import wire
from cosim.system.system import Experiment, System
from cosim.system.wiring import Port, Wiring
from fmus.description.description import ModelDescription
from fmus.description.names import split_element
from fmus.description.read import read_description
from fmus.export.build import CATALOG, build_reference

WORDS = {"centred": "after_step, centred"}
Locate = Callable[[str], Path]

WIDTH = 70
"""Characters of the longest column."""


def descriptions(system: System, locate: Locate) -> dict[str, ModelDescription]:
    """Return the description of each instance's FMU."""
    return {name: read_description(locate(reference)) for name, reference in system.components.items()}


def system(system: System, experiment: Experiment, locate: Locate) -> str:
    """Return connection table, evaluation order, feedthrough, loops and delayed paths of a system, as text."""
    wiring = wire(system, descriptions(system, locate))
    master: Any = experiment.master
    if hasattr(master, "timed"):
        wiring = master.timed(wiring)
    times = f"{experiment.stop_time:g} s in steps of {experiment.communication_step_size:g} s"
    lines = [f"{system.name}: {times}, master {_master(master)}", ""]
    order = graph.stepping_order(wiring)
    head = ("order", "instance", "FMU", "parameters and initial states that are set")
    lines += _table(head, _instances(order, system, wiring))
    lines += ["", *_table(("from", "to", "unit", "timing"), _connections(wiring))]
    held = [(f"{port} = {value}", unit) for port, value, unit in _held(wiring)]
    lines += ["", *_table(("held", "unit"), held)] if held else []
    lines += ["", "direct feedthrough, output <- inputs:"]
    lines += [f"  {line}" for name in order for line in _feedthrough(name, wiring.descriptions[name])] or ["  none"]
    loops = [*graph.algebraic_loops(wiring), *graph.algebraic_loops(wiring, initial=True)]
    lines += ["algebraic loops: " + ("" if loops else "none"), *(f"  {' <- '.join(loop)}" for loop in loops)]
    delayed = [str(path) for path in graph.refresh_order(wiring).delayed]
    lines += ["delayed paths: " + ("" if delayed else "none"), *(f"  {path}" for path in delayed)]
    return "\n".join(lines)


def fmu(path: Path) -> str:
    """Return the description of an FMU as text."""
    fmu = read_description(path)
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
        wiring = wire(found, descriptions(found, Library(backend, note)))
        for instance, reference in found.components.items():
            if not reference.endswith(".fmu"):
                values = _start_values(wiring, instance)
                paths.append(build_reference(reference, backend, platforms, place, values, instance, note))
            else:
                note(f"{instance} is {reference} as it is")
    return paths


def _start_values(wiring: Wiring, instance: str) -> dict[str, Any]:
    """Return what a system sets and holds in an instance, as whole arrays in the FMU's own units."""
    fmu = wiring.descriptions[instance]
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


def _connections(wiring: Wiring) -> list[tuple[str, str, str, str]]:
    """Return one row per connected array: elements are joined where they have one timing."""
    rows: dict[tuple[str, str, str, str], None] = {}
    for link in wiring.links:
        source, target = (f"{p.component}.{split_element(p.variable)[0]}" for p in (link.source, link.target))
        ends = (wiring.descriptions[p.component].variables[p.variable].unit or "" for p in (link.source, link.target))
        units = " -> ".join(dict.fromkeys(ends))
        rows[source, target, units, "step mean" if link.step_mean else WORDS.get(link.timing, link.timing)] = None
    return list(rows)


def _master(master: Any) -> str:
    """Return a master with the settings that are not its defaults, as one would write it."""
    changed = [
        f"{f.name}={getattr(master, f.name)!r}"
        for f in dataclasses.fields(master)
        if getattr(master, f.name) != f.default
    ]
    return f"{type(master).__name__}({', '.join(changed)})"


def _instances(order: Sequence[str], system: System, wiring: Wiring) -> list[tuple[str, str, str, str]]:
    """Return rows of the instances in stepping order; a long list of what is set goes on in the next row."""
    rows: list[tuple[str, str, str, str]] = []
    for place, name in enumerate(order):
        n = wiring.period(name)
        reference = system.components[name] + (f", every {n} steps" if n > 1 else "")
        bases = dict.fromkeys(split_element(p.variable)[0] for p in wiring.settings if p.component == name)
        first, *further = textwrap.wrap(", ".join(bases), WIDTH) or [""]
        rows += [(str(place + 1), name, reference, first), *(("", "", "", line) for line in further)]
    return rows


def _held(wiring: Wiring) -> list[tuple[str, str, str]]:
    """Return name, value and unit of the held inputs, arrays whole."""
    rows: list[tuple[str, str, str]] = []
    for instance, fmu in wiring.descriptions.items():
        for base, g in fmu.groups.items():
            values = [wiring.held[port] for e in g.elements if (port := Port(instance, e)) in wiring.held]
            if values and len(values) == len(g.elements):
                unit = fmu.variables[g.elements[0]].unit or ""
                rows.append((f"{instance}.{base}", str(_shaped(values, g.shape)), unit))
            elif values:
                parts = [(e, wiring.held[Port(instance, e)]) for e in g.elements if Port(instance, e) in wiring.held]
                rows += [(f"{instance}.{e}", str(value), fmu.variables[e].unit or "") for e, value in parts]
    return rows


def _feedthrough(name: str, fmu: ModelDescription) -> list[str]:
    """Return lines `outputs <- inputs` of an FMU, by arrays, a line for all outputs that follow the same inputs."""
    inputs_of: dict[str, dict[str, None]] = {}
    for output in fmu.real_outputs:
        for port in fmu.feedthrough(output.name):
            inputs_of.setdefault(split_element(output.name)[0], {})[split_element(port)[0]] = None
    outputs_of: dict[tuple[str, ...], list[str]] = {}
    for output, inputs in inputs_of.items():
        outputs_of.setdefault(tuple(inputs), []).append(output)
    prefix = f"{name}: " if name else ""
    return [f"{prefix}{', '.join(outputs)} <- {', '.join(inputs)}" for inputs, outputs in outputs_of.items()]


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    widths = [max(len(row[i]) for row in (head, *rows)) for i in range(len(head))]
    lines = [
        "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in (head, *rows)
    ]
    return [lines[0], "  ".join("-" * width for width in widths), *lines[1:]] if rows else []
