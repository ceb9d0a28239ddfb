"""adcs export: a system as a system structure package."""

from pathlib import Path
from typing import Annotated, Literal

import typer

from cosim.cli import console
from cosim.cli.options import Backend, Params, Set, Step, Stop, Use, reported, times
from cosim.ssp.package import is_package


def export_(
    name: Annotated[str, typer.Argument(metavar="NAME", help="SYSTEM, FILE.py[:function] or FILE.ssp.")],
    out: Annotated[Path, typer.Option("--out", "-o", metavar="FILE.ssp", help="The package; replaced if it is there.")],
    ssp: Annotated[Literal["1.0", "2.0"], typer.Option(help="Version of SSP. Most tools read 1.0.")] = "1.0",
    use: Use = None,
    set_: Set = None,
    params: Params = None,
    stop: Stop = None,
    step: Step = None,
    trace: Annotated[
        bool, typer.Option("--trace", help="Fly it, and put metrics and the paper's claims with their verdicts inside.")
    ] = False,
    backend: Backend = "native",
    platform: Annotated[
        str, typer.Option(help="Of native FMUs that are built: host, win64, ... or all; several with commas.")
    ] = "host",
) -> None:
    """Write a system with its FMUs as a system structure package (SSP), which other tools fly."""
    from cosim.cli import overrides, scenario
    from cosim.cli.library import Library
    from cosim.cli.packing import export
    from fmus.toolchain import SUFFIXES

    with reported():
        if not is_package(str(out)):
            raise typer.BadParameter(f"{out} is no FILE.ssp", param_hint="--out")
        system, experiment = scenario.load(name, *times(stop, step))
        platforms = tuple(SUFFIXES) if platform == "all" else tuple(platform.split(","))
        locate = Library(backend, console.note)
        system, _ = overrides.with_changes(system, use or [], params or [], set_ or [], locate, console.write_swap)
        experiment = overrides.with_experiment(experiment, step, stop)
        published = not any((use, set_, params, stop, step))
        traced = (name if published else "") if trace else None
        told = export(out, system, experiment, locate, ssp=ssp, traced=traced, platforms=platforms, note=console.note)
        for line in told:
            console.note(line)
        console.write_files([out])
