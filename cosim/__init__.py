"""Co-simulation of attitude-control systems: FMI 2.0 FMUs wired by a master, recorded, judged.

What a script needs is here by its name, and loaded when it is first used: System, Component, Connection, Experiment,
Signal, Fault, Value, load, Library, prepare, simulate, resume, Result; the masters Explicit, Iterated, ErrorControlled.
"""

from collections.abc import Callable, Mapping, Sequence
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from adcs_cosim import refuse_strangers

if TYPE_CHECKING:
    from cosim.cli.library import Library
    from cosim.cli.scenario import load
    from cosim.flights import Prepared
    from cosim.masters.error_controlled import ErrorControlled
    from cosim.masters.explicit import Explicit
    from cosim.masters.iterated import Iterated
    from cosim.results.result import Result
    from cosim.slaves.slave import Slave
    from cosim.system import At, Component, Connection, Experiment, Fault, Signal, System, Value
    from cosim.system.swap import SwapReport
    from cosim.time import Seconds

__all__ = [
    "At",
    "Component",
    "Connection",
    "ErrorControlled",
    "Experiment",
    "Explicit",
    "Fault",
    "Iterated",
    "Library",
    "Result",
    "Signal",
    "System",
    "Value",
    "load",
    "prepare",
    "resume",
    "simulate",
]

refuse_strangers()

if TYPE_CHECKING:
    __version__: str

_HOMES = {
    "At": "cosim.system",
    "Component": "cosim.system",
    "Connection": "cosim.system",
    "ErrorControlled": "cosim.masters.error_controlled",
    "Experiment": "cosim.system",
    "Explicit": "cosim.masters.explicit",
    "Fault": "cosim.system",
    "Iterated": "cosim.masters.iterated",
    "Library": "cosim.cli.library",
    "Result": "cosim.results.result",
    "Signal": "cosim.system",
    "System": "cosim.system",
    "Value": "cosim.system",
    "load": "cosim.cli.scenario",
}


def __getattr__(name: str) -> Any:
    """Load a public name from its module."""
    if name == "__version__":
        from importlib.metadata import version  # pyproject.toml says which, and pip has noted it

        return version("adcs-cosim")
    if name in _HOMES:
        return getattr(import_module(_HOMES[name]), name)
    raise AttributeError(f"module 'cosim' has no attribute {name!r}. It offers: {', '.join(__all__)}.")


def simulate(
    system: "System",
    experiment: "Experiment",
    *,
    locate: Callable[[Any], Path] | None = None,
    slaves: "Mapping[str, Slave] | None" = None,
    swaps: "Sequence[SwapReport]" = (),
    out: Path | str | None = None,
    overwrite: bool = False,
    progress: Callable[[float, float], None] | None = None,
    format: str = "parquet",
    metrics: "Callable[[Result], Mapping[str, Any]] | None" = None,
    checkpoint: "Seconds | None" = None,
) -> "Result":
    """Run an experiment and return what it recorded: `prepare` and `Prepared.fly` (cosim.flights) in one call.

    `locate`: FMU reference -> path; None: `Library()`, which builds what is missing. `metrics` None: those of an
    attitude run. `slaves`: instances to use instead of FMUs, by instance name. `out`: the result folder. `checkpoint`:
    every so many seconds of the flight a checkpoint is saved in it, from which `resume(out)` goes on.
    """
    from cosim import flights

    return flights.simulate(
        system,
        experiment,
        locate=locate or _library(),
        slaves=slaves,
        swaps=swaps,
        out=out,
        overwrite=overwrite,
        progress=progress,
        format=format,
        metrics=metrics or _attitude,
        checkpoint=checkpoint,
    )


def resume(
    folder: Path | str,
    *,
    stop_time: "Seconds | None" = None,
    locate: Callable[[Any], Path] | None = None,
    slaves: "Mapping[str, Slave] | None" = None,
    progress: Callable[[float, float], None] | None = None,
    metrics: "Callable[[Result], Mapping[str, Any]] | None" = None,
) -> "Result":
    """Go on with the run in a folder from its checkpoint (cosim.resuming.resume); all it needs stands there.

    It ends with the bits of a run that was never interrupted. `stop_time`: another one, s, where no step so far would
    have been another with it. `locate`: FMU reference -> path, of FMUs that are no more where they were; `slaves`:
    instances, where the run was given some.
    """
    from cosim import resuming

    return resuming.resume(
        folder,
        stop_time=stop_time,
        locate=locate or _library(),
        slaves=slaves,
        progress=progress,
        metrics=metrics or _attitude,
    )


def prepare(
    system: "System", locate: Callable[[Any], Path] | None = None, *, slaves: "Mapping[str, Slave] | None" = None
) -> "Prepared":
    """Read, check, wire and load a system once, to be flown many times with `fly`; a context manager.

    `locate`: FMU reference -> path; None: `Library()`, which builds what is missing. `slaves`: instances to use
    instead of FMUs, by instance name.
    """
    from cosim import flights

    return flights.prepare(system, locate or _library(), slaves=slaves, metrics=_attitude)


def _library() -> Callable[[Any], Path]:
    """Return the default library, whose notes, what it builds and why not natively, are lines of logging."""
    import logging

    from cosim.cli.library import Library

    return Library(note=logging.getLogger(__name__).info)


def _attitude(result: "Result") -> Mapping[str, Any]:
    from cosim.studies.metrics import measure

    return measure(result)
