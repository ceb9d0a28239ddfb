"""--fault FILE.toml: what goes wrong in flight.

[[fault]]
connection = "wheels.tau_B -> plant.tau_B"     # or one of its ends; or target, or source
kind = "scale"
factor = 0.5
from = "50 s"
until = "80 s"
"""

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cosim.cli.attitudes import value_of
from cosim.errors import ParameterError, SimulationError
from cosim.time import parse_seconds
from fmus.description.names import did_you_mean, did_you_mean_file

if TYPE_CHECKING:
    from cosim.system import Experiment, Fault

FaultFiles = Annotated[
    list[Path] | None,
    typer.Option("--fault", metavar="FILE.toml", help="What goes wrong in flight: a TOML file of [[fault]] tables."),
]

PLACES = {"connection": "", "target": "", "source": "", "parameter": "parameter", "component": "freeze"}
"""Where a fault is, and its kind where that follows."""


class FaultFileError(SimulationError):
    """A file of faults that cannot be read."""

    def __init__(self, path: Path, problem: str) -> None:
        super().__init__(f"{path}: {problem}")


def with_faults(experiment: "Experiment", files: Sequence[Path]) -> "Experiment":
    """Return the experiment with the faults of some files too; raises `FaultFileError`."""
    found = [fault for path in files for fault in read(path)]
    return replace(experiment, faults=(*experiment.faults, *found)) if found else experiment


def read(path: Path) -> "list[Fault]":
    """Return the faults of a file; raises `FaultFileError`."""
    try:
        tables = tomllib.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError as error:
        raise FaultFileError(path, f"there is no such file.{did_you_mean_file(path)}") from error
    except OSError as error:
        raise FaultFileError(path, f"it cannot be read: {error.strerror}") from error
    except (ValueError, RecursionError) as error:
        raise FaultFileError(path, f"it is no TOML: {error}") from error
    given = tables.get("fault")
    if isinstance(given, Mapping):
        raise FaultFileError(path, "[fault] is one table. Write [[fault]], once for each fault")
    if set(tables) != {"fault"} or not isinstance(given, list) or not all(isinstance(t, Mapping) for t in given):
        there = ", ".join(tables) or "nothing"
        raise FaultFileError(path, f"it must have [[fault]] tables and nothing else; there: {there}")
    return [_fault(path, f"fault {i}", table) for i, table in enumerate(given, start=1)]


def _fault(path: Path, where: str, table: Mapping[str, Any]) -> "Fault":
    from cosim.system.fault import QUANTITIES, Fault, Kind

    def wrong(problem: str) -> FaultFileError:
        return FaultFileError(path, f"{where}: {problem}")

    places = [name for name in PLACES if name in table]
    if len(places) != 1:
        many = f"it has {' and '.join(places)}. Leave one"
        raise wrong(many if places else f"it does not say where. Give one of {', '.join(PLACES)}")
    place = places[0]
    usual = PLACES[place]
    said = str(table.get("kind", usual))
    possible: list[Kind] = [k for k in QUANTITIES if (k == usual if usual else k not in PLACES.values())]
    kind: Kind | None = next((k for k in possible if k == said), None)
    if kind is None:
        what = f"its kind is {said!r}" if said else "it has no kind"
        raise wrong(f"{what}.{did_you_mean(said, possible)} Of a {place}: {', '.join(possible)}")
    known = ["kind", place, "from", "until", *filter(None, [QUANTITIES[kind]]), *["seed"] * (kind == "noise")]
    for name in table:
        if name not in known:
            raise wrong(f"{name} is not known.{did_you_mean(name, known)} There: {', '.join(known)}")
    if "from" not in table:
        raise wrong('it does not say from when. Write from = "50 s"')
    if not isinstance(table[place], str):
        raise wrong(f"its {place} must be a text, not {table[place]!r}")
    try:
        given = {name: table[name] for name in ("from", "until") if name in table}
        times = {name: parse_seconds(t, name) if isinstance(t, str) else t for name, t in given.items()}
        for name, time in times.items():
            if isinstance(time, bool) or not isinstance(time, int | float | Fraction):
                raise wrong(f'{name} is {time!r}. Write {name} = "50 s"')
        value = table.get(QUANTITIES[kind])
        value = value_of(value, table[place]) if isinstance(value, str) else value
        made = Fault(
            kind, table[place], value, start=times["from"], until=times.get("until"), seed=table.get("seed", 0)
        )
        _ = made.begins, made.ends
    except ParameterError as error:
        raise wrong(error.problem) from error
    except FaultFileError:
        raise
    except SimulationError as error:
        raise wrong(str(error)) from error
    return made
