"""adcs compare: controllers on plants, of the papers and one's own, in one table."""

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cosim.cli import console
from cosim.cli.options import Backend, Force, Stop, reported

if TYPE_CHECKING:
    from cosim.studies.comparison import Mission, Table


def compare_(
    plants: Annotated[
        str,
        typer.Option(
            metavar="PLANT,...",
            help="Papers whose vehicles are flown, or own ones: NAME, FILE.py:Class, FILE.fmu, FILE.py:function for "
            "that of a system with its cluster and parameters. All papers if none.",
        ),
    ] = "",
    controllers: Annotated[
        str,
        typer.Option(
            metavar="CONTROLLER,...",
            help="Experiments that have them, or own ones: NAME, FILE.py:Class, FILE.fmu, FILE.py:function. All of "
            "the papers if none.",
        ),
    ] = "",
    slew: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME=VALUE",
            help="Of the slew, as in 'angle=30 deg', axis=[0,0,1], 'max_rate=0.5 deg/s', 'max_acceleration=0.05 "
            "deg/s2', start_time=5, smooth=0; repeatable.",
        ),
    ] = None,
    disturbance: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME=VALUE|FMU",
            help="Of the disturbance, as in 'bias=[1e-3,0,0] N.m', sine, cosine, frequency; or the component that "
            "gives it: NAME, FILE.py:Class or FILE.fmu, and then its parameters; repeatable.",
        ),
    ] = None,
    stop: Stop = None,
    settled: Annotated[
        str | None, typer.Option(metavar="ANGLE", help="Threshold of the settling time. Default: 0.01 deg.")
    ] = None,
    out: Annotated[Path, typer.Option("--out", "-o", help="Folder for the table.")] = Path("results/compare"),
    backend: Backend = "native",
    force: Force = False,
) -> None:
    """Fly attitude controllers on attitude plants: the same slew, the same disturbance, one table.

    A plant has its system's cluster, or wheels. The vehicle's parameters are carried into the controller, gains are not
    retuned. Exit status 1 after Ctrl-C: the table has the flights that were finished.
    """
    from cosim.cli.library import Library
    from cosim.studies import comparison

    with reported(), console.progress("compare") as progress:
        names = [[name.strip() for name in text.split(",")] if text else [] for text in (plants, controllers)]
        mission = read_mission(slew or [], disturbance or [], stop, settled)
        for kind, texts in zip(("plant", "controller"), names, strict=True):
            comparison.check_names(kind, [text for text in texts if not is_system(text)])
        rows, columns = ([_given(name) for name in texts] for texts in names)
        locate = Library(backend, console.note)
        table = comparison.compare(rows, columns, out, locate, progress, console.note, mission=mission, overwrite=force)
    _write(table)
    if not table.complete:
        console.note(f"interrupted: {len(table.cells)} of {table.planned} flights flown")
        raise typer.Exit(1)


def read_mission(
    slew: Sequence[str], disturbance: Sequence[str], stop: str | None = None, settled: str | None = None
) -> "Mission":
    """Return the mission of texts NAME=VALUE; raises `ParameterError`, `UnknownName`."""
    from cosim.cli import overrides
    from cosim.studies.comparison import Mission
    from cosim.time import parse_seconds

    components = [text for text in disturbance if "=" not in text.partition(":")[0].partition("[")[0]]
    return Mission(slew=_values("slew", slew)).with_changes(
        disturbance=_values("disturbance", [text for text in disturbance if text not in components]),
        environment=os.path.expanduser(components[-1]) if components else None,
        stop=None if stop is None else parse_seconds(stop, "--stop"),
        threshold=None if settled is None else overrides.parse_degrees(settled, "--settled"),
    )


def is_system(name: str) -> bool:
    """Whether a text names a system of a file: FILE.py, or FILE.py:function, which has no capital."""
    file, found, rest = name.partition(".py:")
    return name.endswith(".py") or (bool(found) and bool(file) and not rest[:1].isupper())


def _values(what: str, texts: Sequence[str]) -> dict[str, Any]:
    from cosim.errors import ParameterError
    from cosim.system import Value

    values: dict[str, Any] = {}
    for text in texts:
        name, equals, value = text.partition("=")
        if not equals:
            raise ParameterError(text, f"it is not NAME=VALUE, as in --{what} 'angle=30 deg' or axis=[0,0,1]")
        values[name.strip()] = Value(value.strip())
    return values


def _given(name: str) -> Any:
    """Return a name as it is, a system of a file as it is loaded."""
    from cosim.cli import scenario

    return scenario.load(name) if is_system(name) else name


def _write(table: "Table") -> None:
    """Print parameter sets, the mission, and a table a plant."""
    from cosim.studies import comparison

    # what a controller is told of a vehicle is the vehicle's own; compare.json has the sets pair by pair
    sets: Mapping[str, Mapping[str, Any]] = table.parameters
    console.write_parameters({name: values for name, values in sets.items() if " on " not in name})
    for line in table.mission.words:
        console.write(line)
    for plant, cluster in table.clusters.items():
        cells = [cell for cell in table.cells if cell.plant == plant]
        if not cells:
            continue
        console.write(f"\n{plant} with {cluster}")
        rows = [comparison.make_row(cell)[1:-1] for cell in cells if cell.figures]
        console.write_table(("controller", *comparison.COLUMNS), rows, whole=(0,))
        for cell in cells:
            if cell.remark:
                console.write(f"{cell.controller} on {plant} {cell.remark}")
    if held := [f"{cell.controller} on {cell.plant}" for cell in table.cells if cell.exchange == "held"]:
        console.write(f"\nflown with held inputs, for with slopes they diverge: {', '.join(held)}")
    console.write_files(table.files)
