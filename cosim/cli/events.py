"""Events as the command line says them: --at 50s controller.kp=30."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated

import typer

from cosim.cli import completion
from cosim.errors import EventError

if TYPE_CHECKING:
    from cosim.system import Experiment

AtTime = Annotated[
    list[str] | None,
    typer.Option(
        "--at", metavar="TIME NAME=VALUE", help="A parameter changes in flight, as in --at 50s controller.kp=30."
    ),
]
Changes = Annotated[
    list[str] | None,
    typer.Argument(metavar="", autocompletion=completion.swapped, help="What changes at the times of --at, in order."),
]


def with_events(experiment: "Experiment", times: Sequence[str], changes: Sequence[str]) -> "Experiment":
    """Return the experiment with further events: each time with the change that stands behind it, in one text or two.

    Raises `EventError`, `TimeError`, `ParameterError`.
    """
    from dataclasses import replace

    from cosim.cli.overrides import assignments
    from cosim.system import At
    from cosim.time import parse_seconds

    left = list(changes)
    events: list[At] = []
    for text in times:
        time, _, change = text.strip().partition(" ") if "=" in text else (text, "", "")
        if not change and not left:
            raise EventError(text, "nothing is said to change then", "Write --at 50s controller.kp=30.")
        events.append(At(parse_seconds(time, "--at"), assignments([change or left.pop(0)])))
    if left:
        raise EventError("no time", f"{' '.join(left)} has no --at before it", "Write --at 50s controller.kp=30.")
    return replace(experiment, events=(*experiment.events, *events))
