"""--isolate and --isolation-timeout: FMUs in processes of their own."""

from dataclasses import replace
from typing import Annotated

import typer

from cosim.system import Experiment, System
from cosim.system.system import isolated

Isolate = Annotated[
    list[str] | None,
    typer.Option(metavar="INSTANCE|all", help="Fly this FMU in a process of its own: a crash ends the run alone."),
]
IsolationTimeout = Annotated[
    float | None,
    typer.Option(metavar="SECONDS", help="How long a call of an isolated FMU may take before its process is ended."),
]


def with_isolation(
    system: System, experiment: Experiment, names: list[str] | None, timeout: float | None
) -> tuple[System, Experiment]:
    """Return both with what the command line says; raises `UnknownName` for an instance that there is not."""
    if names:
        named = ["*" if name == "all" and name not in system.components else name for name in names]
        system = replace(system, isolated=(*system.isolated, *named))
        isolated(system)
    return system, experiment if timeout is None else replace(experiment, isolation_timeout=timeout)
