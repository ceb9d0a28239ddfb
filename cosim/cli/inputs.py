"""What feeds inputs, as the command line says it: files of time series, constants."""

import re
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from cosim.cli import console
from cosim.errors import SignalError, WiringError
from fmus.description.names import canonical

if TYPE_CHECKING:
    from cosim.system import Signal, System

Interpolation = Literal["linear", "previous", "cubic"]

Input = Annotated[
    list[str] | None,
    typer.Option(
        "--input",
        metavar="NAME=FILE[:COLUMN]",
        help="Feed an input from CSV, parquet or .mat, as in plant.tau_dist_B=gust.csv:tau or =gust.csv:x,y,z.",
    ),
]
Interpolated = Annotated[
    Interpolation, typer.Option(help="What the signals of --input are between their samples: linear, previous, cubic.")
]
Hold = Annotated[
    list[str] | None,
    typer.Option(metavar="NAME=VALUE", help="Hold an input, as in 'plant.tau_dist_B=[0,0,1e-3]'."),
]

_FILE = re.compile(r"(?P<file>.*\.[A-Za-z]+)(?::(?P<column>.*))?$", re.DOTALL)


def with_fed(
    system: "System", given: Sequence[str], interpolation: Interpolation, hold: Sequence[str]
) -> "tuple[System, bool]":
    """Return the system with the inputs of NAME=FILE[:COLUMN] texts fed, and those of NAME=VALUE texts held.

    The answer's second part is whether anything was given. Raises `SignalError`, `WiringError`, `ParameterError`.
    """
    from cosim.cli.overrides import assignments
    from cosim.system.overrides import with_inputs

    signals: dict[str, Any] = {}
    for text in given:
        name, equals, source = text.partition("=")
        if not equals or "." not in name or not source.strip():
            raise WiringError(f"{text!r} is not INSTANCE.INPUT=FILE", "Write it as plant.tau_dist_B=gust.csv:column.")
        signals[name.strip()] = _signal(source.strip(), interpolation)
    held = assignments(hold)
    if both := {*map(canonical, signals)} & {*map(canonical, held)}:
        raise WiringError(f"{', '.join(sorted(both))} is fed by a signal and held", "Leave out --input or --hold.")
    for connection in system.connections:
        if canonical(connection.target) in {*map(canonical, signals), *map(canonical, held)}:
            console.note(f"{connection.target} is no more connected to {connection.source}")
    return with_inputs(system, signals, held), bool(signals or held)


def _signal(source: str, interpolation: Interpolation) -> "Signal":
    """Read FILE or FILE:COLUMN; a colon in the file's own name counts where there is such a file."""
    from cosim.system import Signal

    match = _FILE.match(source)
    if match is None and not Path(source).exists():
        raise SignalError(source, "it names no file", "Write FILE.csv, FILE.parquet or FILE.mat, as gust.csv:column.")
    if match is None or Path(source).is_file():
        return Signal(source, interpolation=interpolation)
    return Signal(match["file"], match["column"], interpolation=interpolation)
