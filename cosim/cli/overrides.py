"""What a command line changes in a system: parameters one by one or from a file, and the FMU of an instance."""

import math
import tomllib
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace as changed
from pathlib import Path
from typing import Any

from cosim.errors import ParameterError, UnknownName
from cosim.masters.explicit import Explicit
from cosim.system import Experiment, System, Value
from cosim.system.swap import SwapReport, replace
from cosim.time import parse_seconds
from fmus.description.description import ModelDescription
from fmus.description.read import read_description


def parameter_file(path: Path) -> dict[str, Any]:
    """Read a TOML file: a table per instance ("*" for all), numbers, arrays, or texts with a unit ("0.005 deg")."""
    try:
        tables = tomllib.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError as error:
        raise ParameterError(f"file {path}", "there is no such file") from error
    except OSError as error:
        raise ParameterError(f"file {path}", f"it cannot be read: {error.strerror}") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ParameterError(f"file {path}", f"it is no TOML: {error}") from error
    values: dict[str, Any] = {}
    for instance, table in tables.items():
        if not isinstance(table, Mapping):
            raise ParameterError(f"file {path}", f"{instance} must be a table of an instance, as in [controller]")
        for name, value in table.items():
            values[f"{instance}.{name}"] = Value(value) if isinstance(value, str) else value
    return values


def assignments(texts: Iterable[str]) -> dict[str, Any]:
    """Read NAME=VALUE texts: plant.J=[[..]], plant.J[1,1]=500, *.J=..., controller.rho_inf=0.005 deg."""
    values: dict[str, Any] = {}
    for text in texts:
        name, equals, value = text.partition("=")
        if not equals or "." not in name:
            raise ParameterError(
                text, "it is not INSTANCE.NAME=VALUE, as in plant.J[1,1]=500 or controller.rho_inf='0.005 deg'"
            )
        values[name.strip()] = Value(value.strip())
    return values


def parse_degrees(text: str, name: str) -> float:
    """Read "0.005 deg", "1e-4 rad" or "0.005" (a plain number is degrees); the answer is in deg."""
    angle = Value(text)
    factor = {None: 1.0, "deg": 1.0, "rad": math.degrees(1.0)}.get(angle.unit)
    if factor is None or not isinstance(angle.value, int | float) or not 0 < angle.value < math.inf:
        raise ParameterError(name, f"{text!r} is no positive angle. Write it as 0.005 deg or 1e-4 rad")
    return factor * angle.value


def with_swaps(system: System, uses: Sequence[str], locate: Callable[[str], Path]) -> tuple[System, list[SwapReport]]:
    """Return the system with the FMUs of `INSTANCE=REFERENCE` texts in place of its own, and what each swap did."""
    reports: list[SwapReport] = []
    for text in uses:
        instance, equals, reference = text.partition("=")
        if not equals:
            raise ParameterError(text, "it is not INSTANCE=FMU, as in controller=AdaptiveTracking")
        if instance not in system.components:
            raise UnknownName("component", instance, f'system "{system.name}"', list(system.components))
        references = {**system.components, instance: reference}
        descriptions: dict[str, ModelDescription] = {
            name: read_description(locate(r)) for name, r in references.items()
        }
        system, report = replace(system, instance, reference, descriptions)
        reports.append(report)
    return system, reports


def with_experiment(
    experiment: Experiment,
    step: str | None = None,
    stop: str | None = None,
    every: int | None = None,
    master: str | None = None,
    extrapolation: int | None = None,
    tolerance: float | None = None,
    announce_stop_time: bool = False,
) -> Experiment:
    """Return the experiment with what the command line says instead; step and stop as in "1ms" or "200"."""
    changes: dict[str, Any] = {}
    if step is not None:
        changes["communication_step_size"] = parse_seconds(step, "--step")
    if stop is not None:
        changes["stop_time"] = parse_seconds(stop, "--stop")
    if every is not None:
        changes["every"] = every
    if tolerance is not None:
        changes["tolerance"] = tolerance
    if announce_stop_time:
        changes["announce_stop_time"] = True
    if master is not None or extrapolation is not None:
        changes["master"] = _master(experiment.master, master, extrapolation)
    return changed(experiment, **changes)


PRESETS: dict[str, Any] = {"explicit": "declared", "jacobi": "jacobi", "gauss_seidel": "gauss_seidel"}


def _master(own: Any, name: str | None, extrapolation: Any) -> Explicit:
    """Return the experiment's own master with another preset or extrapolation; a preset of another name is plain."""
    if name is not None and name not in PRESETS:
        raise UnknownName("master", name, "--master", list(PRESETS))
    master = own if isinstance(own, Explicit) and name in (None, "explicit") else Explicit()
    if name is not None:
        master = changed(master, preset=PRESETS[name])
    return master if extrapolation is None else changed(master, extrapolation=extrapolation)
