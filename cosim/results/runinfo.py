"""What run.json says of a run: enough to repeat it, and how it ended."""

import dataclasses
import platform
import sys
from collections import Counter
from collections.abc import Mapping, Sequence
from contextlib import suppress
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from cosim.errors import CallFailed
from cosim.masters.master import Course
from cosim.slaves.slave import Slave
from cosim.system import Experiment, System
from cosim.system.reference import name_of
from cosim.system.shared import disagreements
from cosim.system.swap import SwapReport
from cosim.system.system import isolated
from cosim.system.timing import remarks
from cosim.system.wiring import Port, Wiring
from cosim.time import Schedule
from fmus.description.annotations import STEP_TAKEN
from fmus.description.description import ModelDescription, Scalar
from fmus.description.names import split_element, split_port

PACKAGES = ("adcs-cosim", "fmpy", "pythonfmu", "casadi", "numpy", "scipy", "pyarrow")


def setup(
    system: System,
    experiment: Experiment,
    schedule: Schedule,
    wiring: Wiring,
    course: Course,
    master: Any,
    paths: Mapping[str, Path],
    swaps: Sequence[SwapReport],
) -> dict[str, Any]:
    """Return what is known before the first step; `schedule`: the experiment's, `wiring` has the timings flown."""
    columns, alone = course.layout.columns, isolated(system)
    last = schedule.stop - schedule.count(schedule.steps - 1)
    return {
        "system": system.name,
        "source": _plain(system.source),
        "versions": versions(),
        "platform": {"system": sys.platform, "machine": platform.machine()},
        "components": {
            name: _component(name_of(system.components[name]), description, paths.get(name), wiring.period(name))
            | {"isolated": name in alone}
            for name, description in wiring.fmus.items()
        },
        "stepping_order": [name for name in course.order if name not in wiring.feeds],
        "master": {"name": type(master).__name__, **_fields(master)},
        "start_time": schedule.time(0),
        "stop_time": schedule.time(schedule.steps),
        "communication_step_size": float(schedule.step_size),
        "communication_step": f"{schedule.step_size} s",
        "last_step": last / schedule.denominator,
        "every": schedule.every,
        "stop_when": experiment.stop_when,
        "tolerance": experiment.tolerance,
        "announce_stop_time": experiment.announce_stop_time,
        "isolation_timeout": experiment.isolation_timeout,
        "connections": _connections(wiring),
        "parameters": values(wiring, wiring.settings),
        "held": values(wiring, wiring.held),
        "inputs": {name: signal.told() for name, signal in system.inputs.items()},
        "warnings": warnings(wiring),
        "swaps": [dataclasses.asdict(report) for report in swaps],
        "units": dict(zip(columns.names, columns.units, strict=True)),
        "types": {n: kind for n, kind in zip(columns.names, columns.types, strict=True) if kind != "Real"},
        "items": {n: dict(items) for n, items in zip(columns.names, columns.items, strict=True) if items is not None},
    }


def warnings(wiring: Wiring) -> list[str]:
    """Return what is to be told before a flight: parameters that disagree, connections weaker than asked for."""
    return [*disagreements(wiring), *remarks(wiring)]


def internal_steps(slaves: Mapping[str, Slave], wiring: Wiring) -> dict[str, float]:
    """Return the internal step that FMUs of ours took in their last communication step, s, by instance."""
    found: dict[str, float] = {}
    for name, slave in slaves.items():
        taken = wiring.descriptions[name].variables.get(STEP_TAKEN)
        if taken is None or not wiring.descriptions[name].refresh:
            continue
        with suppress(CallFailed):
            found[name] = float(slave.get_real((taken.value_reference,))[0])
    return {name: step for name, step in found.items() if step > 0}


def messages(slaves: Mapping[str, Slave]) -> dict[str, dict[str, int]]:
    """Return what FMUs have logged, by instance: each text once, with how often it came."""
    return {name: dict(Counter(slave.messages)) for name, slave in slaves.items() if slave.messages}


def calls(slaves: Mapping[str, Slave], refused: Mapping[str, CallFailed]) -> dict[str, Any]:
    """Return which calls returned fmi2Warning, by instance and function, and which instances `refused` to terminate."""
    warned = {
        name: {function: {"count": n, "first": _plain(first)} for function, (n, first) in slave.warned.items()}
        for name, slave in slaves.items()
        if slave.warned
    }
    told = {name: {"status": error.status, "messages": list(error.messages)} for name, error in refused.items()}
    return {"fmi2Warning": warned, "fmi2Terminate": told}


def ending(
    schedule: Schedule, reached: float | None, failure: Exception | None, event: Mapping[str, Any] | None = None
) -> dict[str, Any]:
    """Return how the run ended: finished, at its stop time or by an event, interrupted or failed, where and why."""
    if failure is not None:
        return broken(failure) | {"reached_time": reached}
    if reached == schedule.time(schedule.steps):
        return {"status": "finished", "reached_time": reached}
    if event is None:
        return {"status": "interrupted", "reached_time": reached}
    return {"status": "finished", "reached_time": reached, "event": dict(event)}


def event(descriptions: Mapping[str, ModelDescription], flag: str, reached: float | None) -> dict[str, Any] | None:
    """Return the event that a flag stands for, if the run was to end by one: time in s, variable, meaning."""
    if not flag:
        return None
    component, variable = split_port(flag)
    meaning = descriptions[component].variables[variable].description
    return {"time": reached, "variable": f"{component}.{variable}", "meaning": meaning}


def broken(failure: BaseException) -> dict[str, Any]:
    """Return what an exception tells of the end of a run."""
    if isinstance(failure, KeyboardInterrupt):
        return {"status": "interrupted"}
    fields = _fields(failure) if dataclasses.is_dataclass(failure) else {}
    told = {k: v for k, v in fields.items() if v is not None and v is not False}
    return {"status": "failed", "error": type(failure).__name__, "why": str(failure), "failure": told}


def _component(reference: str, description: ModelDescription, path: Path | None, steps: int) -> dict[str, Any]:
    return {
        "reference": reference,
        "path": str(path) if path is not None else None,
        "model_name": description.model_name,
        "guid": description.guid,
        "generation_tool": description.generation_tool,
        "role": description.role,
        "inputs": description.base_names("input"),
        "outputs": description.base_names("output"),
        "steps": steps,
    }


def _connections(wiring: Wiring) -> dict[str, Any]:
    """Return target -> source and timing as flown, arrays whole."""
    found: dict[str, Any] = {}
    for link in wiring.links:
        if link.fed:
            continue
        source, target = (f"{p.component}.{split_element(p.variable)[0]}" for p in (link.source, link.target))
        whole = {"source": source, "timing": "step mean" if link.step_mean else link.timing}
        if found.setdefault(target, whole) != whole:  # elements of an array from several sources
            found[str(link.target)] = whole | {"source": str(link.source)}
    return found


def values(wiring: Wiring, given: Mapping[Port, Scalar]) -> dict[str, Any]:
    """Return values of variables in their own units, with these."""
    return {
        str(port): {"value": value, "unit": wiring.descriptions[port.component].variables[port.variable].unit}
        for port, value in given.items()
    }


def _fields(thing: Any) -> dict[str, Any]:
    return {f.name: _plain(getattr(thing, f.name)) for f in dataclasses.fields(thing)}


def _plain(value: Any) -> Any:
    if isinstance(value, tuple | list):
        return [_plain(v) for v in value]
    if (isinstance(value, float) and value != value) or value in (float("inf"), float("-inf")):
        return str(value)
    if isinstance(value, Mapping):
        return {str(k): _plain(v) for k, v in value.items()}
    return value if isinstance(value, str | int | float | bool | None) else str(value)


@cache
def versions() -> Mapping[str, str | None]:
    """Return the versions of Python and of the packages that matter, looked up once per process."""
    return {"python": platform.python_version(), **{package: _version(package) for package in PACKAGES}}


def _version(package: str) -> str | None:
    try:
        return version(package)
    except PackageNotFoundError:
        return None
