"""Options that several commands have, and how what a user can cause is told."""

from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from cosim.cli import completion, console
from cosim.errors import SimulationError
from cosim.time import Seconds, parse_seconds
from fmus.errors import BuildError


def _write_version(asked: bool) -> None:
    if asked:
        import cosim

        typer.echo(f"adcs-cosim {cosim.__version__}")
        raise typer.Exit


Version = Annotated[
    bool, typer.Option("--version", callback=_write_version, is_eager=True, help="Print the version and exit.")
]
Flown = Annotated[
    str,
    typer.Argument(
        metavar="NAME",
        autocompletion=completion.systems,
        help="SYSTEM, FILE.py[:function], 'FILE.py:function(kp=5)', FILE.ssp or FILE.fmu.",
    ),
]
Backend = Annotated[
    Literal["native", "python"],
    typer.Option(help="Back end of the FMUs that are built: C, or Python that can be edited."),
]
Master = Annotated[
    str | None,
    typer.Option(
        help="explicit (timings as the system declares them), jacobi (all at_point), plain (every output one step old, "
        "as most tools pass them on), gauss-seidel (after_step where the source is declared before the target), "
        "iterated (steps repeated until they agree) or error-controlled "
        "(iterated, steps as long as an error allows). Default: the experiment's own."
    ),
]
MasterTolerance = Annotated[
    float | None,
    typer.Option(help="Of iterated: up to which part of their size values agree; of error-controlled: allowed error."),
]
Use = Annotated[
    list[str] | None,
    typer.Option(
        metavar="INSTANCE=FMU",
        autocompletion=completion.swaps,
        help="Another FMU for an instance: NAME, FILE.py:Class or FILE.fmu.",
    ),
]
Set = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="NAME=VALUE", help="As in 'plant.J[1,1]=500', '*.J=[[..]]', 'controller.k=0.2 1/s'."),
]
Params = Annotated[
    list[Path] | None, typer.Option(metavar="FILE.toml", help="Parameters, a table per instance; --set wins.")
]
Stop = Annotated[str | None, typer.Option(metavar="TIME", help="Stop time, as in 200, 90s or 5min.")]
Step = Annotated[str | None, typer.Option(metavar="TIME", help="Communication step, as in 1ms or 0.001.")]
Inputs = Annotated[
    str | None,
    typer.Option(
        help="How inputs whose sources step first are carried over a step: declared, held (at the end's value), ramp "
        "(a line), smooth (a cubic with true slopes). Of iterated: ramp or smooth."
    ),
]
Extrapolation = Annotated[
    int | None, typer.Option(help="Order to which at_point inputs follow their sources' derivatives: 0, 1 or 2.")
]
Force = Annotated[bool, typer.Option("--force", help="Replace a result that is already there.")]


def times(stop: str | None, step: str | None) -> list[Seconds | None]:
    """Return what --stop and --step say, s; raises `TimeError`."""
    given = (("--stop", stop), ("--step", step))
    return [None if text is None else parse_seconds(text, option) for option, text in given]


@contextmanager
def reported() -> Any:
    """Turn what a user can cause into one message and exit status 2, or 1 where a simulation had begun."""
    try:
        yield
    except (SimulationError, BuildError) as error:
        console.write_error(error)
        raise typer.Exit(1 if getattr(error, "result", None) is not None else 2) from error
