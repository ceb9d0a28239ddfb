"""What a command line changes in a system: parameters one by one or from a file, and the FMU of an instance."""

import math
import tomllib
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace as changed
from pathlib import Path
from typing import Any

from cosim.cli import masters
from cosim.cli.attitudes import value_of
from cosim.errors import ParameterError, UnknownName
from cosim.quantity import advice_on_numbers
from cosim.system import Experiment, System, Value
from cosim.system.overrides import with_parameters
from cosim.system.swap import SwapReport, replace
from cosim.time import parse_seconds
from fmus.description.description import ModelDescription
from fmus.description.read import read_description

DEEPEST = 32
TOO_DEEP = "it is nested too deep for an array of numbers"


def parameter_file(path: Path, alone: str = "") -> dict[str, Any]:
    """Read a TOML file: a table per instance ("*" for all), numbers, arrays, or texts with a unit ("0.005 deg").

    alone: the only instance that there is; its values need no table.
    """
    try:
        tables = tomllib.loads(path.read_text(encoding="utf-8"))
        if alone and isinstance(tables.get(alone, {}), Mapping):
            tables = {alone: _flat(tables | dict(tables.pop(alone, {})))}
    except FileNotFoundError as error:
        raise ParameterError(f"file {path}", "there is no such file") from error
    except OSError as error:
        raise ParameterError(f"file {path}", f"it cannot be read: {error.strerror}") from error
    except ValueError as error:  # no TOML, no UTF-8, or a number of more digits than Python reads
        raise ParameterError(f"file {path}", f"it is no TOML: {error}") from error
    except RecursionError as error:
        raise ParameterError(f"file {path}", TOO_DEEP) from error
    values: dict[str, Any] = {}
    for instance, table in tables.items():
        if not isinstance(table, Mapping):
            raise ParameterError(f"file {path}", f"{instance} must be a table of an instance, as in [controller]")
        for name, value in table.items():
            if _depth(value) > DEEPEST:
                raise ParameterError(f"file {path}", f"{instance}.{name}: {TOO_DEEP}")
            full = f"{instance}.{name}"
            values[full] = value_of(value, full) if isinstance(value, str) else value
    return values


def _flat(tables: Mapping[str, Any]) -> dict[str, Any]:
    """Return values of tables within tables by their dotted names, as solver.step."""
    found: dict[str, Any] = {}
    for name, value in tables.items():
        inner = _flat(value) if isinstance(value, Mapping) else None
        found |= {name: value} if inner is None else {f"{name}.{below}": v for below, v in inner.items()}
    return found


def _depth(value: Any) -> int:
    """Return how many lists lie in one another, up to one more than `DEEPEST`."""
    depth, inside = 0, [value]
    while depth <= DEEPEST and any(isinstance(v, list) for v in inside):
        depth, inside = depth + 1, [v for part in inside if isinstance(part, list) for v in part]
    return depth


def assignments(texts: Iterable[str], alone: str = "") -> dict[str, Any]:
    """Read NAME=VALUE texts: plant.J=[[..]], plant.J[1,1]=500, *.J=..., controller.rho_inf=0.005 deg.

    alone: the only instance that there is, whose name may be left out.
    """
    values: dict[str, Any] = {}
    for text in texts:
        name, equals, value = text.partition("=")
        if alone and equals and not name.strip().startswith((f"{alone}.", "*.")):
            name = f"{alone}.{name.strip()}"
        if alone and not equals:
            raise ParameterError(text, "it is not NAME=VALUE, as in J[1,1]=500 or rho_inf='0.005 deg'")
        if not equals or "." not in name:
            raise ParameterError(
                text, "it is not INSTANCE.NAME=VALUE, as in plant.J[1,1]=500 or controller.rho_inf='0.005 deg'"
            )
        values[name.strip()] = value_of(value.strip(), name.strip())
    return values


def parse_degrees(text: str, name: str) -> float:
    """Read "0.005 deg" or "1e-4 rad", the answer is in deg; raises `ParameterError`, for a bare number too."""
    angle = Value(text)
    number = angle.value
    if isinstance(number, bool) or not isinstance(number, int | float) or not 0 < number < math.inf:
        advice = advice_on_numbers(text)
        raise ParameterError(name, f"{text!r} is no positive angle. Write it as 0.005 deg or 1e-4 rad{advice}")
    if angle.unit is None:
        raise ParameterError(name, f"{text!r} has no unit. Write {text.strip()} deg or {text.strip()} rad")
    factor = {"deg": 1.0, "rad": math.degrees(1.0)}.get(angle.unit)
    if factor is None:
        raise ParameterError(name, f"{text!r} is no positive angle. Write it as 0.005 deg or 1e-4 rad")
    return factor * number


Describe = Callable[[Any], ModelDescription]


def with_swaps(system: System, uses: Sequence[str], describe: Describe) -> tuple[System, list[SwapReport]]:
    """Return the system with the FMUs of `INSTANCE=REFERENCE` texts in place of its own, and what each swap did.

    describe: reference of an FMU -> what it says.
    """
    reports: list[SwapReport] = []
    for text in uses:
        instance, equals, reference = text.partition("=")
        if not equals:
            raise ParameterError(text, "it is not INSTANCE=FMU, as in controller=AdaptiveTracking")
        if instance not in system.components:
            raise UnknownName("component", instance, f'system "{system.name}"', list(system.components))
        references = {instance: reference} | system.components | {instance: reference}  # a wrong name is told first
        descriptions = {name: describe(r) for name, r in references.items()}
        system, report = replace(system, instance, reference, descriptions)
        reports.append(report)
    return system, reports


def with_changes(
    system: System,
    swaps: Sequence[str],
    files: Sequence[Path],
    values: Sequence[str],
    locate: Callable[[str], Path],
    tell: Callable[[SwapReport], None],
    describe: Describe | None = None,
) -> tuple[System, list[SwapReport]]:
    """Return the system with other FMUs, then parameters of files, then single ones, and what each swap did.

    `tell` is given each report before parameters can be refused. describe: reference -> what the FMU says; None: what
    the one that `locate` finds says.
    """
    system, reports = with_swaps(system, swaps, describe or (lambda reference: read_description(locate(reference))))
    for report in reports:
        tell(report)
    for file in files:
        system = with_parameters(system, parameter_file(file))
    return with_parameters(system, assignments(values)), reports


def with_experiment(
    experiment: Experiment,
    step: str | None = None,
    stop: str | None = None,
    every: int | None = None,
    master: str | None = None,
    inputs: str | None = None,
    extrapolation: int | None = None,
    tolerance: float | None = None,
    announce_stop_time: bool = False,
    master_tolerance: float | None = None,
    pending_timeout: float | None = None,
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
    if pending_timeout is not None:
        changes["pending_timeout"] = pending_timeout
    if announce_stop_time:
        changes["announce_stop_time"] = True
    if any(option is not None for option in (master, inputs, extrapolation, master_tolerance)):
        changes["master"] = masters.choose(experiment.master, master, inputs, extrapolation, master_tolerance)
    return changed(experiment, **changes)
