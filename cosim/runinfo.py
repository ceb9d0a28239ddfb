"""What run.json says of a run: enough to repeat it, and how it ended."""

import dataclasses
import platform
import sys
from collections.abc import Mapping, Sequence
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from cosim.interface import Interface, Scalar
from cosim.links import Port, Wiring
from cosim.masters.plan import Plan
from cosim.swap import SwapReport
from cosim.system import Experiment, System
from cosim.time import Schedule, to_seconds

PACKAGES = ("adcs-cosim", "fmpy", "pythonfmu", "casadi", "numpy", "scipy", "pyarrow")


def setup(
    system: System,
    experiment: Experiment,
    wiring: Wiring,
    plan: Plan,
    paths: Mapping[str, Path],
    swaps: Sequence[SwapReport],
) -> dict[str, Any]:
    """Return what is known before the first step."""
    return {
        "system": system.name,
        "versions": {"python": platform.python_version(), **{p: _version(p) for p in PACKAGES}},
        "platform": {"system": sys.platform, "machine": platform.machine()},
        "components": {
            name: _component(system.components[name], interface, paths.get(name), wiring.period(name))
            for name, interface in wiring.interfaces.items()
        },
        "stepping_order": [c.name for c in plan.components],
        "master": {"name": type(experiment.master).__name__, **_fields(experiment.master)},
        "start_time": to_seconds(plan.schedule.start),
        "stop_time": to_seconds(plan.schedule.stop),
        "communication_step_size": to_seconds(plan.schedule.step),
        "last_step": to_seconds(plan.schedule.stop - plan.schedule.point(plan.schedule.steps - 1)),
        "every": plan.schedule.every,
        "parameters": _values(wiring, wiring.settings),
        "held": _values(wiring, wiring.held),
        "swaps": [dataclasses.asdict(report) for report in swaps],
        "units": dict(zip(plan.columns.names, plan.columns.units, strict=True)),
    }


def ending(schedule: Schedule, reached: float | None, failure: Exception | None) -> dict[str, Any]:
    """Return how the run ended: finished, interrupted or failed, where and why."""
    if failure is not None:
        return broken(failure) | {"reached_time": reached}
    status = "finished" if reached == to_seconds(schedule.stop) else "interrupted"
    return {"status": status, "reached_time": reached}


def broken(failure: BaseException) -> dict[str, Any]:
    """Return what an exception tells of the end of a run."""
    if isinstance(failure, KeyboardInterrupt):
        return {"status": "interrupted"}
    fields = _fields(failure) if dataclasses.is_dataclass(failure) else {}
    told = {k: v for k, v in fields.items() if v is not None}
    return {"status": "failed", "error": type(failure).__name__, "why": str(failure), "failure": told}


def _component(reference: str, interface: Interface, path: Path | None, steps: int) -> dict[str, Any]:
    return {
        "reference": reference,
        "path": str(path) if path is not None else None,
        "model_name": interface.model_name,
        "guid": interface.guid,
        "generation_tool": interface.generation_tool,
        "steps": steps,
    }


def _values(wiring: Wiring, values: Mapping[Port, Scalar]) -> dict[str, Any]:
    return {
        str(port): {"value": value, "unit": wiring.interfaces[port.component].variables[port.variable].unit}
        for port, value in values.items()
    }


def _fields(thing: Any) -> dict[str, Any]:
    return {f.name: _plain(getattr(thing, f.name)) for f in dataclasses.fields(thing)}


def _plain(value: Any) -> Any:
    if isinstance(value, tuple | list):
        return [_plain(v) for v in value]
    if (isinstance(value, float) and value != value) or value in (float("inf"), float("-inf")):
        return str(value)
    return value if isinstance(value, str | int | float | bool | None) else str(value)


def _version(package: str) -> str | None:
    try:
        return version(package)
    except PackageNotFoundError:
        return None
