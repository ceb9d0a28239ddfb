"""--checkpoint and --resume: a run that goes on where it was interrupted."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cosim.cli import completion, console, ending
from cosim.errors import NotSupported, near
from cosim.time import parse_seconds

if TYPE_CHECKING:
    from cosim.results.result import Result
    from cosim.system import System

Named = Annotated[
    str | None,
    typer.Argument(
        metavar="NAME",
        autocompletion=completion.systems,
        help="SYSTEM, FILE.py[:function], 'FILE.py:function(kp=5)', FILE.ssp or FILE.fmu.",
    ),
]
Checkpoints = Annotated[
    str | None,
    typer.Option(
        "--checkpoint",
        metavar="TIME",
        help="Save a checkpoint each time that so much has been simulated, as in 50s, and at the end or after Ctrl-C.",
    ),
]
Resume = Annotated[
    Path | None,
    typer.Option(
        "--resume",
        metavar="DIR",
        help="Go on with the run in a result folder from its checkpoint. All else stands there; --stop may be another.",
    ),
]

AGAIN = ("resume", "stop", "plot")
"""Options that may be given with --resume."""


def noted(system: "System", name: str, settled: float, as_published: bool) -> Mapping[str, Any]:
    """Return what a system was loaded from, with what the command line tells of its result beside it."""
    command = {"name": name, "settled": settled, "as_published": as_published}
    return {**system.source, "command": command}


def fly_on(context: typer.Context, folder: Path, stop: str | None, *, plot: bool) -> None:
    """Go on with the run in a folder; see `ending.fly`. Raises `CheckpointRefused`, `NotSupported`."""
    from cosim.cli.library import Library
    from cosim.resuming import Left, resume
    from cosim.studies import metrics

    left = Left(folder)
    _refuse(context, left.folder, left.info)
    stop_time = None if stop is None else parse_seconds(stop, "--stop")
    command: Mapping[str, Any] = left.system.source.get("command", {})
    threshold = command.get("settled", metrics.THRESHOLD)
    locate = Library(note=console.note)
    console.note(f"going on from the checkpoint at {left.checkpoint.time:.12g} s in {near(left.folder)}")

    def fly(progress: ending.Progress) -> "Result":
        return resume(
            folder,
            stop_time=stop_time,
            locate=locate,
            progress=progress,
            metrics=lambda run: metrics.measure(run, threshold),
        )

    name = command.get("name", left.system.name)
    ending.fly(name, left.system, fly, locate if plot else None, command.get("as_published", False))


def _refuse(context: typer.Context, folder: Path, info: Mapping[str, Any]) -> None:
    """Raise `NotSupported` for options that a run that goes on cannot have, with what it has."""
    given: list[str] = []
    for option in context.command.params:
        name = option.name or ""
        source = context.get_parameter_source(name)
        if source is not None and source.name == "COMMANDLINE" and name not in AGAIN:
            word = max(option.opts, key=len) if option.param_type_name == "option" else "NAME"
            value = context.params[name]
            values = value if isinstance(value, list | tuple) else [value]
            given.append(f"{word} {' '.join(map(str, values))}" if value is not True else word)
    if given:
        step, master = info["communication_step"], info["master"]
        settings = ", ".join(f"{k}={v!r}" for k, v in master.items() if k != "name")
        flown = f"system {info['system']}, step {step}, master {master['name']}({settings})"
        raise NotSupported(
            f"{', '.join(given)}: a run that goes on is what it was, in {near(folder)} {flown}",
            "Give --resume alone, or with --stop and --plot; or fly anew.",
        )
