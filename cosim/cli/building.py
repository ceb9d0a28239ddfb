"""adcs build: components as FMUs, and the instances of a system, with the start values that are asked for."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from cosim.cli import completion, console
from cosim.cli.options import Params, Set, Use, reported
from cosim.errors import NotSupported
from fmus.toolchain import SUFFIXES as PLATFORMS

if TYPE_CHECKING:
    from cosim.system import Experiment, System
    from cosim.system.wiring import Port, Wiring
    from fmus.description.description import Scalar


def build_(
    names: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[NAME]...",
            autocompletion=completion.everything,
            help="NAME, FILE.py:Class, NAME:modes=6 or a SYSTEM; all NAMEs if none.",
        ),
    ] = None,
    out: Annotated[
        Path | None, typer.Option("--out", "-o", help="Folder for the FMUs. Default: for a SYSTEM one of its name.")
    ] = None,
    use: Use = None,
    set_: Set = None,
    params: Params = None,
    backend: Annotated[
        Literal["native", "python", "all"], typer.Option(help="C, Python that can be edited, or both.")
    ] = "native",
    platform: Annotated[
        str, typer.Option(help=f"Of native FMUs: host, {', '.join(PLATFORMS)} or all; several with commas.")
    ] = "host",
) -> None:
    """Build FMUs that are missing or out of date, and print their paths.

    A SYSTEM gives one FMU per instance, SYSTEM_INSTANCE.fmu, with the system's parameters as start values. --set,
    --params and --use change them as in adcs run; of a component by the variable's name alone: --set zeta=0.01.
    """
    from fmus.export import build as building

    changes = Changes(tuple(use or ()), tuple(params or ()), tuple(set_ or ()))
    with reported():
        backends = building.BACKENDS if backend == "all" else (backend,)
        platforms = tuple(PLATFORMS) if platform == "all" else tuple(platform.split(","))
        if changes and len(names or ()) != 1:
            raise NotSupported("--set, --params and --use change what one NAME stands for", "Build one NAME at a time.")
        for name in names or building.CATALOG:
            for path in _build(name, Target(tuple(backends), platforms, out), changes):
                typer.echo(path)


@dataclass(frozen=True)
class Target:
    """Back ends and platforms to build for, and the folder, None: the cache, of a system one of its name."""

    backends: tuple[str, ...]
    platforms: tuple[str, ...]
    folder: Path | None

    def place(self, backend: str, folder: Path | None) -> Path | None:
        """Return the folder of a back end's FMUs: of several each has its own."""
        return folder / backend if folder is not None and len(self.backends) > 1 else folder


@dataclass(frozen=True)
class Changes:
    """What the command line changes: FMUs of instances, files with parameters, parameters."""

    uses: tuple[str, ...] = ()
    files: tuple[Path, ...] = ()
    values: tuple[str, ...] = ()

    def __bool__(self) -> bool:
        return bool(self.uses or self.files or self.values)


def _build(name: str, target: Target, changes: Changes) -> list[Path]:
    """Build what a name stands for and return the FMUs."""
    from cosim.cli import instances, scenario
    from fmus.export.build import is_component

    if is_component(name):
        return _build_component(name, target, changes)
    try:
        with instances.components_too():
            system, experiment = scenario.load(name)
    except scenario.NoScenario:  # a file with a component alone
        return _build_component(name, target, changes)
    return _build_system(system, experiment, target, changes, f"adcs show '{name}'")


# ---- a component -----------------------------------------------------------------------------------------------


def _build_component(name: str, target: Target, changes: Changes) -> list[Path]:
    """Build a component, with the start values that are asked for."""
    from fmus.export.build import build_reference

    if changes.uses:
        raise NotSupported("--use changes an instance of a system", f"{name} is a component. Name a system.")
    values: dict[str, Any] | None = None
    folder = target.folder
    if changes:
        values, folder = _start_values(name, changes), folder or Path()  # the cache has those without changes
    return [
        build_reference(name, b, target.platforms, target.place(b, folder), values, announce=console.note)
        for b in target.backends
    ]


def _start_values(name: str, changes: Changes) -> dict[str, Any]:
    """Return start values by variable, checked as those of a system of this one component."""
    from cosim.cli import instances, overrides
    from cosim.system import System
    from cosim.system.expand import wire
    from cosim.system.overrides import with_parameters
    from fmus.export import references

    instance = references.parse(name).name
    system = System(name=instance, components={instance: name}, hold_unconnected=True)
    for file in changes.files:
        system = with_parameters(system, overrides.parameter_file(file, instance))
    system = with_parameters(system, overrides.assignments(changes.values, instance))
    wiring = wire(system, {instance: instances.describe(name)})
    return instances.as_arrays(wiring, instance, wiring.settings)


# ---- a system --------------------------------------------------------------------------------------------------


def _build_system(
    system: "System", experiment: "Experiment", target: Target, changes: Changes, look: str
) -> list[Path]:
    """Build each instance of a system, its parameters and first inputs as start values; tell how to wire them.

    `look`: the command that shows the system's connections.
    """
    from cosim.cli import instances, overrides, starts
    from cosim.cli.library import Library
    from cosim.errors import SimulationError
    from cosim.system.expand import wire

    system, _ = overrides.with_changes(
        system, changes.uses, changes.files, changes.values, Library(), console.note_swap, instances.describe
    )
    descriptions = {instance: instances.describe(reference) for instance, reference in system.components.items()}
    wiring = wire(system, descriptions)
    folder = target.folder or Path(_file_name(system.name))
    library = Library("python" if target.backends == ("python",) else "native", console.note)
    try:
        inputs = starts.of_inputs(wiring, starts.started(system, experiment, library))
    except SimulationError as error:
        inputs = {}
        console.note(starts.unknown(error))
    given = {**wiring.settings, **inputs, **wiring.held}
    paths: list[Path] = []
    for backend in target.backends:
        place = target.place(backend, folder)
        paths += _build_instances(system, experiment, wiring, given, backend, target.platforms, place)
    _tell_wiring(system, experiment, wiring, look)
    return paths


def _build_instances(
    system: "System",
    experiment: "Experiment",
    wiring: "Wiring",
    given: "Mapping[Port, Scalar]",
    backend: str,
    platforms: Sequence[str],
    folder: Path | None,
) -> list[Path]:
    from cosim.cli import instances, starts
    from cosim.system.reference import is_fmu
    from fmus.export.build import build_reference

    paths: list[Path] = []
    for instance, reference in system.components.items():
        if is_fmu(reference):
            console.note(f"{instance} is {reference} as it is")
            continue
        values = instances.as_arrays(wiring, instance, given)
        name = _file_name(f"{system.name}_{instance}")
        told = starts.default_experiment(experiment, wiring.period(instance))
        paths.append(build_reference(reference, backend, platforms, folder, values, name, console.note, told))
    return paths


def _file_name(name: str) -> str:
    """Return a name without what a file's cannot have."""
    return "".join(c if c.isalnum() or c in "-_." else "_" for c in name)


def _tell_wiring(system: "System", experiment: "Experiment", wiring: "Wiring", look: str) -> None:
    """Say what another tool has to do with the FMUs."""
    from cosim.cli.show import stepping_order
    from cosim.masters.explicit import Explicit
    from cosim.time import exact_seconds, in_words

    master = experiment.master or Explicit()
    order = ", ".join(name for name in stepping_order(master.timed(wiring), master) if name not in wiring.feeds)
    step = in_words(exact_seconds(experiment.communication_step_size, "communication_step_size"))
    console.note(f"{system.name}: communication step {step}; let the FMUs step in this order where the tool lets you")
    console.note(f"choose: {order}. What is connected to what: {look}")
