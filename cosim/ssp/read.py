"""FILE.ssp as a system and an experiment.

Of a file of ours all comes back that was declared (own.py). Another tool's file says nothing of steps, masters and
timings: its stop time is that of its DefaultExperiment; its step the shortest that the DefaultExperiment of one of its
FMUs proposes, else a thousandth of the flight; inputs that nothing is connected to keep their start values.
"""

import logging
import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from fractions import Fraction
from functools import cache
from pathlib import Path
from typing import Any

from cosim.errors import FmuError
from cosim.ssp.errors import SspError
from cosim.ssp.flatten import Flat, flatten
from cosim.ssp.model import Structure
from cosim.ssp.own import TYPE, VERSION, decode, parsed
from cosim.ssp.package import Package, extracted
from cosim.ssp.refine import pairs, refined
from cosim.ssp.signals import recognised
from cosim.ssp.structure import read_structure
from cosim.system import At, Connection, Experiment, System
from cosim.time import Seconds, exact_seconds
from fmus.description.description import ModelDescription
from fmus.description.names import group, nested, split_element, split_port
from fmus.description.read import read_description

STEPS = 1000
"""Steps of a flight where nobody says how long one is."""

_log = logging.getLogger(__name__)


def read(
    path: Path | str, masters: Mapping[str, Any], stop: Seconds | None = None, step: Seconds | None = None
) -> tuple[System, Experiment]:
    """Return the system and experiment of a .ssp file; FMUs are referred to as FILE.ssp#resources/NAME.fmu.

    `masters`: class name -> class of master settings. `stop`, `step`: instead of the file's, s. Raises `SspError` with
    all mistakes, and for what is not implemented.
    """
    package = Package.of(path)
    structure = read_structure(package)
    flat = flatten(structure.system, cache(lambda reference: _description(reference, package.label)))
    if flat.mistakes:
        raise SspError(package.label, flat.mistakes)
    if flat.ignored:
        names = ", ".join(f"{name:.80}" for name in flat.ignored[:10]) + (", ..." if len(flat.ignored) > 10 else "")
        _log.warning("%s: its parameter sets name what no FMU of it has, passed over: %s", package.label, names)
    name = _name(structure.name, Path(path))
    if structure.annotation is None:
        return _plain_system(flat, name), _experiment(structure, flat, package.label, stop, step)
    try:
        return _as_declared(structure, flat, name, masters, package, stop, step)
    except (TypeError, ValueError, AttributeError, KeyError, OverflowError) as error:
        problem = f"its annotation {TYPE} is damaged ({error}). Without it the file is read too"
        raise SspError(package.label, [problem]) from error


def _description(reference: str, label: str) -> ModelDescription:
    try:
        return read_description(extracted(reference))
    except FmuError as error:
        raise SspError(reference, [error.problem]) from error


def _name(name: str, path: Path) -> str:
    """Return the name of a system, which names its result's folder too: the file's where it cannot."""
    fits = Path(name).name == name and name.isprintable() and not set(name) & set('\\/:*?"<>|') and name[:1] not in ".~"
    return name if fits and name.strip() else path.stem


def _plain_system(flat: Flat, name: str) -> System:
    """Return the system of a structure that says no more than SSP can."""
    connected = _connected(flat)
    parameters: dict[str, Any] = {}
    held: dict[str, Any] = {}
    for instance, fmu in flat.descriptions.items():
        mine = {v: value for (i, v), value in flat.values.items() if i == instance and (i, v) not in connected}
        for base, found in group(mine).items():
            whole = fmu.groups.get(base) == found
            for key, elements in [(base, found.elements)] if whole else [(e, (e,)) for e in found.elements]:
                into = held if fmu.variables[elements[0]].causality == "input" else parameters
                into[f"{instance}.{key}"] = nested([mine[e] for e in elements], found.shape if whole else ())
    inputs = {(i, v.name) for i, fmu in flat.descriptions.items() for v in fmu.inputs}
    return System(
        name=name,
        components=flat.components,
        connections=_joined(flat),
        parameters=parameters,
        held=held,
        hold_unconnected=bool(inputs - connected - flat.values.keys()),
    )


def _connected(flat: Flat) -> set[tuple[str, str]]:
    """Return the inputs that something is connected to, whose start values are nobody's."""
    return {(port.component, port.variable) for link in flat.links for _, port in pairs(link, flat.descriptions)}


def _joined(flat: Flat) -> list[Connection]:
    """Return the connections, those of all elements of two arrays as one."""
    found: dict[Connection, None] = {}
    links = {pair: link for link in flat.links for pair in pairs(link, flat.descriptions)}
    for (source, target), link in links.items():
        ends = [f"{port.component}.{split_element(port.variable)[0]}" for port in (source, target)]
        whole = replace(link, source=ends[0], target=ends[1])
        elements = pairs(whole, flat.descriptions)
        same = elements and all(
            pair in links and links[pair].transformation == link.transformation for pair in elements
        )
        alone = replace(link, source=str(source), target=str(target))
        found[whole if same and (source, target) in elements else alone] = None
    return list(found)


def _experiment(structure: Structure, flat: Flat, label: str, stop: Seconds | None, step: Seconds | None) -> Experiment:
    """Return the experiment that the file of another tool proposes."""
    start = structure.start_time or 0.0
    stop = structure.stop_time if stop is None else stop
    if stop is None or not start < stop < math.inf:
        after = f" after its start time {start:g} s" if stop is not None else ""
        raise SspError(label, [f"it has no stop time{after} in its DefaultExperiment. Give it one: --stop 10"])
    if step is None:
        proposed = [fmu.default_experiment.step_size or 0.0 for fmu in flat.descriptions.values()]
        step = min((p for p in proposed if 0.0 < p < math.inf), default=None)
    if step is None:
        step = (exact_seconds(stop, "stop_time") - exact_seconds(start, "start_time")) / STEPS
        _log.warning("%s: SSP has no step size: a thousandth of the flight is taken. --step 1ms sets one", label)
    return Experiment(stop_time=stop, communication_step_size=step, start_time=start)


def _as_declared(
    structure: Structure,
    flat: Flat,
    name: str,
    masters: Mapping[str, Any],
    package: Package,
    stop: Seconds | None,
    step: Seconds | None,
) -> tuple[System, Experiment]:
    """Return system and experiment with what our annotation says; times that differ are the structure's."""
    annotation, label = structure.annotation or {}, package.label
    if annotation.get("version") != VERSION:
        problem = f"its annotation {TYPE} is of version {annotation.get('version')}, read is {VERSION}"
        raise SspError(label, [problem])
    told = decode(annotation.get("System", "{}"), System, masters, label)
    flown = decode(annotation.get("Experiment", "{}"), Experiment, masters, label)
    flat, inputs = recognised(flat, parsed(annotation.get("Signals", "{}"), {}, label), package)
    system = replace(_plain_system(flat, name), inputs=inputs)
    true = {"start_time": structure.start_time, "stop_time": structure.stop_time}
    _refuse_other_types(flown, masters)
    if "events" in flown:
        flown["events"] = list(_still_there(flown["events"], flat))
    changed = {n: t for n, t in true.items() if t is not None and (n not in flown or float(flown[n]) != t)}
    given = {"stop_time": stop, "communication_step_size": step}
    flown |= changed | {name: value for name, value in given.items() if value is not None}
    if "stop_time" not in flown or "communication_step_size" not in flown:
        return refined(flat, system, told), _experiment(structure, flat, label, stop, step)
    return refined(flat, system, told), Experiment(**flown)


def _refuse_other_types(flown: Mapping[str, Any], masters: Mapping[str, Any]) -> None:
    """Raise TypeError for fields of an experiment that are not of their types."""
    numbers = (int, float, Fraction)
    kinds: dict[str, tuple[type, ...]] = {
        **dict.fromkeys(("stop_time", "communication_step_size", "start_time"), numbers),
        **dict.fromkeys(("pending_timeout", "isolation_timeout"), (int, float)),
        "tolerance": (int, float, type(None)),
        "every": (int,),
        "stop_when": (str,),
        "announce_stop_time": (bool,),
        "master": (*masters.values(), type(None)),
    }
    for name, value in flown.items():
        if name in kinds and (
            not isinstance(value, kinds[name]) or (isinstance(value, bool) and bool not in kinds[name])
        ):
            raise TypeError(f"{name} is {value!r:.60}")
    each = [(name, item) for name in ("record", "events") for item in _listed(flown.get(name, ()))]
    wrong = next((f"{n} has {i!r:.60}" for n, i in each if not isinstance(i, At if n == "events" else str)), "")
    times: list[Any] = [event.time for _, event in each if isinstance(event, At)]
    wrong = wrong or next((f"an event is at {t!r:.60}" for t in times if not isinstance(t, numbers)), "")
    if wrong:
        raise TypeError(wrong)


def _listed(given: Any) -> list[Any]:
    return [given] if isinstance(given, str) else list(given)


def _still_there(events: Iterable[At], flat: Flat) -> Iterator[At]:
    """Yield events with what they change in instances that are there."""
    for event in events:
        values = {n: v for n, v in event.values.items() if split_port(n)[0] in ("*", *flat.components)}
        if values:
            yield At(event.time, values)
