"""What `adcs show` says about a system before it flies, and about an FMU."""

import dataclasses
import textwrap
from collections.abc import Sequence
from pathlib import Path

from cosim.cli import console, happenings, interface
from cosim.cli.instances import Locate, read_descriptions
from cosim.cli.internal_steps import internal_steps
from cosim.masters.explicit import Explicit
from cosim.masters.implicit.cut import stages
from cosim.results.runinfo import warnings
from cosim.system import Connection, Experiment, System, graph
from cosim.system.expand import wire
from cosim.system.reference import name_of
from cosim.system.system import MasterSettings, isolated
from cosim.system.wiring import Port, Wiring
from cosim.time import exact_seconds, written
from fmus.description.description import ModelDescription, ScalarVariable
from fmus.description.names import Group, nested, split_element
from fmus.description.read import read_description

WORDS = {
    "extrapolated": "at_point, extrapolated",
    "extrapolated_mean": "at_point, extrapolated, mean",
    "mean": "smooth, mean",
}
"""Timings that a master makes, in words: what was declared and how it is carried."""


def write_system(system: System, experiment: Experiment, locate: Locate) -> None:
    """Print connection table, evaluation order, feedthrough, loops and delayed paths of a system."""
    master = experiment.master or Explicit()
    wired = wire(system, read_descriptions(system, locate))
    happenings.refuse(system, experiment, wired)
    wiring = master.timed(wired)
    stop = exact_seconds(experiment.stop_time, "stop_time")
    step = exact_seconds(experiment.communication_step_size, "communication_step_size")
    times = f"{written(stop)} in steps of {written(step)}"
    console.write(f"{system.name}: {times}, master {_master(master)}\n")
    order = [name for name in stepping_order(wiring, master) if name not in wiring.feeds]
    head = ("order", "instance", "FMU", "parameters and initial states that are set")
    console.write_table(head, _instances(order, system, wiring), whole=(0, 1, 2))
    console.write("")
    console.write_table(("from", "to", "unit", "timing"), _connections(system, wiring))
    console.write("")
    console.write_table(("held", "unit"), [(f"{port} = {value}", unit) for port, value, unit in _held(wiring)])
    if system.inputs:
        fed = [(name, str(signal)) for name, signal in system.inputs.items()]
        console.write_table(("input", "signal"), fed)
    if happens := happenings.lines(experiment):
        console.write("\n".join(happens))
    lines = ["", "start values that nothing sets (those of one FMU: adcs show FMU):"]
    lines += [line for name in order for line in _left_alone(name, wiring)] or ["  none"]
    lines += ["", "internal steps, set by solver.step or, where that is 0, found by the FMU at its start:"]
    lines += internal_steps(system, experiment, locate, wiring) or ["  none"]
    lines += ["", "direct feedthrough, output <- inputs:"]
    lines += [f"  {line}" for name in order for line in _feedthrough(name, wiring.descriptions[name])] or ["  none"]
    loops = _loops(wiring, master)
    loops += [(path, "solved in initialization") for path in graph.algebraic_loops(wiring, initial=True)]
    lines += ["algebraic loops: " + ("" if loops else "none")]
    lines += [f"  {' <- '.join(path)}: {what}" for path, what in loops]
    delayed = [str(path) for path in graph.refresh_order(wiring).delayed]
    lines += ["delayed paths: " + ("" if delayed else "none"), *(f"  {path}" for path in delayed)]
    lines += warnings(wiring)
    console.write("\n".join(lines))


def stepping_order(wiring: Wiring, master: MasterSettings) -> Sequence[str]:
    """Return the instances in the order in which they step; repeated ones in that of each repetition."""
    if isinstance(master, Explicit):
        return graph.stepping_order(wiring)
    return [name for stage in stages(wiring) for name in stage.members]


def _loops(wiring: Wiring, master: MasterSettings) -> list[tuple[Sequence[str], str]]:
    """Return the algebraic loops at communication points, and what the master does with each."""
    if not isinstance(master, Explicit):
        return [(path, "solved by repeating steps") for path in graph.algebraic_loops(wiring)]
    solved = graph.solved_loops(wiring)
    refused = {tuple(loop.path): f"refused: {loop.problem}. {loop.advice}" for loop in graph.unsolved_loops(wiring)}
    others = [path for path in graph.algebraic_loops(wiring) if path not in solved and path not in refused]
    return [
        *((path, "solved at each communication point") for path in solved),
        *refused.items(),
        *((path, "delayed, see below") for path in others),
    ]


def write_fmu(path: Path, *, foreign: bool) -> None:
    """Print the description of an FMU; of one that is `foreign` what its file says beyond, and whether it runs here."""
    fmu = read_description(path)
    date = f" on {fmu.generation_date}" if fmu.generation_date else ""
    tool = fmu.generation_tool or "a tool that it does not name"
    made = [": ".join(filter(None, (fmu.model_name, fmu.description))), f"made by {tool}{date}, GUID {fmu.guid}"]
    origin = {"author": fmu.author, "version": fmu.version, "license": fmu.license, "copyright": fmu.copyright}
    proposed = dataclasses.asdict(fmu.default_experiment).items()
    lines = [
        ", ".join(f"{name}: {text}" for name, text in origin.items() if text),
        ", ".join(f"{name.replace('_', ' ')} {value:g}" for name, value in proposed if value is not None),
    ]
    console.write("\n".join([*made, *filter(None, lines), ""]))
    rows: list[tuple[str, ...]] = []
    for base, group in fmu.groups.items():
        first = fmu.variables[group.elements[0]]
        if base.startswith("der("):
            continue
        size = f"[{','.join(map(str, group.shape))}]" if group.shape else ""
        kind = (interface.type_of(first), first.causality, first.variability, first.unit or "")
        limits = interface.range_in_words(fmu, group)
        rows.append((f"{base}{size}", *kind, _start(fmu, group), limits, first.description))
    heads = ("variable", "type", "causality", "variability", "unit", "start", "range", "description")
    console.write_table(heads, rows, whole=(0, 1, 2, 3))
    can = {
        "input interpolation": fmu.can_interpolate_inputs,
        "output derivatives": fmu.max_output_derivative_order > 0,
        "get and set state": fmu.can_get_and_set_state,
        "serialize state": fmu.can_serialize_state,
        "directional derivatives": fmu.provides_directional_derivative,
        "re-evaluation at a communication point": fmu.refresh,
    }
    lines = ["", "direct feedthrough:", *([f"  {line}" for line in _feedthrough("", fmu)] or ["  none"])]
    lines += ["", *(f"{name}: {'yes' if offered else 'no'}" for name, offered in can.items())]
    console.write("\n".join(lines))
    if foreign:
        interface.write(path, fmu)


def _connections(system: System, wiring: Wiring) -> list[tuple[str, str, str, str]]:
    """Return one row per connected array: elements are joined where they have one timing; defaults are marked."""
    factors = {c.target: _factor(c) for c in system.connections}
    silent = {c.target for c in system.connections if c.timing is None}
    rows: dict[tuple[str, str, str, str], None] = {}
    for link in (link for link in wiring.links if not link.fed):
        source, target = (f"{p.component}.{split_element(p.variable)[0]}" for p in (link.source, link.target))
        ends = (wiring.descriptions[p.component].variables[p.variable].unit or "" for p in (link.source, link.target))
        units = " -> ".join(dict.fromkeys(ends)) + factors.get(str(link.target), factors.get(target, ""))
        timing = "step mean" if link.step_mean else WORDS.get(link.timing, link.timing)
        default = " (default)" if {target, str(link.target)} & silent else ""
        rows[source, target, units, timing + default] = None
    return list(rows)


def _factor(connection: Connection) -> str:
    """Return the factor and offset that a connection has of its own, "" where it has none."""
    how = connection.transformation
    return "" if how is None else f", times {how.factor:.6g}" + (f" plus {how.offset:.6g}" if how.offset else "")


def _master(master: MasterSettings) -> str:
    """Return a master with the settings that are not its defaults, as one would write it."""
    settings = dataclasses.fields(master) if dataclasses.is_dataclass(master) else ()
    values = {f.name: getattr(master, f.name) for f in settings if getattr(master, f.name) != f.default}
    changed = [f"{name}={value!r}" for name, value in values.items()]
    return f"{type(master).__name__}({', '.join(changed)})"


def _instances(order: Sequence[str], system: System, wiring: Wiring) -> list[tuple[str, str, str, str]]:
    """Return a row an instance, in stepping order."""
    rows: list[tuple[str, str, str, str]] = []
    apart = isolated(system)
    for place, name in enumerate(order):
        n = wiring.period(name)
        reference = name_of(system.components[name]) + (f", every {n} steps" if n > 1 else "")
        reference += ", in a process of its own" if name in apart else ""
        bases = dict.fromkeys(split_element(p.variable)[0] for p in wiring.settings if p.component == name)
        rows.append((str(place + 1), name, reference, ", ".join(bases)))
    return rows


def _left_alone(name: str, wiring: Wiring) -> list[str]:
    """Return a line with the parameters and initial states of an instance that keep their start values, if any do."""
    fmu = wiring.descriptions[name]
    alone = [
        f"{base} = {_start(fmu, g)} {_unit(fmu.variables[g.elements[0]])}".strip()
        for base, g in fmu.groups.items()
        if all(fmu.variables[e].is_parameter and Port(name, e) not in wiring.settings for e in g.elements)
    ]
    return (
        textwrap.wrap(f"{name}: {', '.join(alone)}", 116, initial_indent="  ", subsequent_indent="    ")
        if alone
        else []
    )


def _unit(variable: ScalarVariable) -> str:
    return "" if variable.unit in (None, "1") else variable.unit


def _start(fmu: ModelDescription, group: Group) -> str:
    """Return the start value of a variable, one for all elements where they have one; "" where there is none."""
    values = [fmu.variables[e].start for e in group.elements]
    if None in values:
        return ""
    words = [f"{v:.6g}" if isinstance(v, float) else str(v) for v in values]
    return words[0] if len(set(words)) == 1 else str(nested(words, group.shape)).replace("'", "")


def _held(wiring: Wiring) -> list[tuple[str, str, str]]:
    """Return name, value and unit of the held inputs, arrays whole."""
    rows: list[tuple[str, str, str]] = []
    for instance, fmu in wiring.descriptions.items():
        for base, g in fmu.groups.items():
            values = [wiring.held[port] for e in g.elements if (port := Port(instance, e)) in wiring.held]
            if values and len(values) == len(g.elements):
                unit = fmu.variables[g.elements[0]].unit or ""
                rows.append((f"{instance}.{base}", str(nested(values, g.shape)), unit))
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
