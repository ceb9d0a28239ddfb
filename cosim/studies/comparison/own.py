"""What a table is asked for, by name or as it is, as plants and controllers.

    a paper (plants), an experiment of a paper (controllers)
    NAME of the catalog, FILE.py:Class, FILE.fmu, or a component's class: alone, with its FMU's start values
    (System, Experiment): its plant with its cluster and parameters, or its controller
    a Plant or Controller that was made before

Instances of a system may have any names: they are found by what they are.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeVar

from components.catalog import MODULES
from cosim.errors import FmuError, SimulationError, UnknownName
from cosim.flights import Locate
from cosim.studies import papers, roles
from cosim.studies.comparison import laws, vehicles
from cosim.studies.comparison.laws import Controller
from cosim.studies.comparison.vehicles import VEHICLE, Plant
from cosim.system import Connection, Experiment, System
from cosim.system.reference import Reference, is_fmu
from fmus.description.description import ModelDescription
from fmus.description.names import split_port
from fmus.description.read import read_description

Given = str | type | tuple[System, Experiment] | Plant | Controller
"""What a plant or a controller of a table may be given as."""

NEEDED: Mapping[str, tuple[frozenset[str], frozenset[str]]] = {  # kind -> inputs, outputs
    "plant": (frozenset({"tau_B"}), frozenset({"q_BN", "omega_BN_B"})),
    "controller": (frozenset(laws.CONTROLLER_INPUTS), frozenset({"tau_command_B"})),
}
START = ("q_BN", "omega_BN_B")  # of a plant, is the mission's
_Kind = TypeVar("_Kind", Plant, Controller)


@dataclass(eq=False)
class Unsuited(SimulationError):
    """An FMU that cannot be what the table needs: `kind`, `name`, what it lacks."""

    kind: str
    name: str
    problem: str

    def __str__(self) -> str:
        """What it is, what it lacks, what is needed."""
        takes, shows = (", ".join(sorted(names)) for names in NEEDED[self.kind])
        needed = f"It needs the inputs {takes} and the outputs {shows}."
        return f"{self.name} is no {self.kind} of this table: {self.problem}. {needed}"


def check_names(kind: str, given: Iterable[Given]) -> None:
    """Raise `UnknownName` or `FmuError` for a text that names no plant or controller, before anything is built."""
    known = _published(kind)
    own = [name for name, module in MODULES.items() if module.startswith(f"components.{kind}s.")]
    for text in given:
        if not isinstance(text, str) or text in known:
            continue
        file, found, _ = text.partition(".py:")
        if is_fmu(text) or found:
            path = Path(f"{file}.py" if found else text).expanduser()
            if not path.is_file():
                raise FmuError(path, "there is no such file")
        elif text.partition(":")[0] not in MODULES:
            raise UnknownName(kind, text, "the papers and the catalog", [*known, *own])


def plants(given: Sequence[Given], locate: Locate) -> list[Plant]:
    """Return the plants of a table; none given: those of the papers."""
    if not given:
        return list(vehicles.find_plants(locate).values())
    return [_plant(thing, locate) for thing in given]


def controllers(given: Sequence[Given], locate: Locate) -> list[Controller]:
    """Return the controllers of a table; none given: those of the papers."""
    if not given:
        return list(laws.find_controllers(locate).values())
    return [_controller(thing, locate) for thing in given]


def told_apart(found: Sequence[_Kind]) -> list[_Kind]:
    """Return plants or controllers, each with a name of its own."""
    names: list[str] = []
    for thing in found:
        again = sum(name == thing.name or name.startswith(f"{thing.name} (") for name in names)
        names.append(f"{thing.name} ({again + 1})" if again else thing.name)
    return [replace(thing, name=name) for thing, name in zip(found, names, strict=True)]


def _published(kind: str) -> Sequence[str]:
    return list(papers.PAPERS if kind == "plant" else papers.describe())


def _plant(given: Given, locate: Locate) -> Plant:
    if isinstance(given, Plant):
        return given
    if isinstance(given, Controller):
        raise Unsuited("plant", given.name, "it is a controller")
    if isinstance(given, tuple):
        return _of_own_system(given[0], locate)
    if isinstance(given, str) and given in papers.PAPERS:
        of_paper = vehicles.find_plants(locate, [given])
        if given not in of_paper:
            raise Unsuited("plant", given, "no experiment of it has an attitude plant with torque inputs")
        return of_paper[given]
    _suits("plant", _name(given), read_description(locate(given)))
    return vehicles.alone(given, _name(given), locate)


def _of_own_system(system: System, locate: Locate) -> Plant:
    """Return the plant of a user's system: what is set in it is part of it, what it knows of the vehicle told."""
    system = standard(system, locate)
    if "plant" not in system.components:
        raise Unsuited("plant", system.name, "no instance of it is an attitude plant")
    fmu = read_description(locate(system.components["plant"]))
    _suits("plant", system.name, fmu)
    set_ = {split_port(k)[1]: v for k, v in system.parameters.items() if split_port(k)[0] in ("plant", "*")}
    known = {**vehicles.starts(fmu, VEHICLE), **system.vehicle, **{n: v for n, v in set_.items() if n in VEHICLE}}
    found = vehicles.of_system(replace(system, vehicle=known), system.name, locate)
    mine = {f"plant.{n}": v for n, v in set_.items() if n in fmu.groups and n not in START}
    acting = ("tau_B", "h_B", "tau_dist_B")
    held = {split_port(k)[1]: v for k, v in system.held.items() if split_port(k)[0] == "plant"}
    return replace(
        found,
        parameters={**mine, **found.parameters},
        held={name: value for name, value in held.items() if name not in acting},
    )


def _controller(given: Given, locate: Locate) -> Controller:
    if isinstance(given, Controller):
        return given
    if isinstance(given, Plant):
        raise Unsuited("controller", given.name, "it is a plant")
    if isinstance(given, tuple):
        system = standard(given[0], locate)
        found = laws.of_system(system, system.name)
    elif isinstance(given, str) and (owner := papers.find_owner(given)) is not None:
        system, _ = owner.make(given)
        found = laws.of_system(system, given, owner.key)
    else:
        found = laws.alone(given, _name(given))
    if "controller" not in found.components:
        raise Unsuited("controller", found.name, "no instance of it is an attitude controller")
    _suits("controller", found.name, read_description(locate(found.components["controller"])))
    return found


def _suits(kind: str, name: str, fmu: ModelDescription) -> None:
    takes, shows = NEEDED[kind]
    lacking = [f"the input {n}" for n in sorted(takes - set(fmu.base_names("input")))]
    lacking += [f"the output {n}" for n in sorted(shows - set(fmu.base_names("output")))]
    if lacking:
        raise Unsuited(kind, name, f"{fmu.model_name} lacks {', '.join(lacking)}")


def _name(given: Reference) -> str:
    """Return how a table calls an FMU that comes alone: a file without its folder, a class by its name."""
    if isinstance(given, type):
        return given.__name__
    file, found, rest = given.partition(".py:")
    return f"{Path(file).name}.py:{rest}" if found else Path(given).name if is_fmu(given) else given


def standard(system: System, locate: Locate) -> System:
    """Return a system with its first plant, controller, guidance and cluster called as in the papers' systems."""
    found = roles.of_descriptions({n: read_description(locate(r)) for n, r in system.components.items()})
    names: dict[str, str] = {}
    for role in roles.ROLES:
        instance = next((name for name, of in found.items() if of == role), None)
        if instance is not None and instance != role and role not in system.components:
            names[instance] = role
    return _renamed(system, names) if names else system


def _renamed(system: System, names: Mapping[str, str]) -> System:
    def port(name: str) -> str:
        instance, dot, variable = name.partition(".")
        return f"{names.get(instance, instance)}{dot}{variable}"

    def keys(values: Mapping[str, Any]) -> dict[str, Any]:
        return {port(key): value for key, value in values.items()}

    return replace(
        system,
        components={names.get(name, name): reference for name, reference in system.components.items()},
        connections=[Connection(port(c.source), port(c.target), c.timing) for c in system.connections],
        parameters=keys(system.parameters),
        held=keys(system.held),
        steps={names.get(name, name): n for name, n in system.steps.items()},
    )
