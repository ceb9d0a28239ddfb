"""Torque-commanding attitude controllers, of the papers, of any system, or alone, and each made to fit a vehicle.

A controller keeps its numbers. What it knows of the vehicle is the vehicle's: J, delta, Omega, zeta, torque_limit; one
that knows modes is built for as many as the vehicle has; and what its paper's rule derives from the vehicle is derived
anew for it (`RULES`), except for the paper's own vehicle.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from cosim.flights import Locate
from cosim.studies import papers
from cosim.studies.comparison.mission import STEP
from cosim.studies.comparison.vehicles import Plant
from cosim.studies.papers.geng2012 import gains
from cosim.system import Connection, System
from cosim.system.reference import Reference, is_fmu
from fmus.description.description import ModelDescription
from fmus.description.names import split_port
from fmus.description.read import read_description

CONTROLLER_INPUTS = {"q_BN", "omega_BN_B", "q_RN"}
REFERENCE = {"q_RN", "omega_RN_R", "omega_dot_RN_R"}
RULES: Mapping[str, Callable[[Mapping[str, Any]], Mapping[str, Any]]] = {"geng2012": gains.design}


@dataclass(frozen=True)
class Controller:
    """A controller of an experiment: its FMUs by instance, the connections among them, and their own parameters."""

    name: str
    paper: str
    components: Mapping[str, Reference]
    connections: Sequence[Connection]
    parameters: Mapping[str, Any]


def find_controllers(locate: Locate) -> dict[str, Controller]:
    """Return the torque-commanding attitude controllers, by the first experiment that has each with its parameters."""
    found: dict[str, Controller] = {}
    for paper in papers.PAPERS.values():
        for name in paper.experiments:
            system, experiment = paper.make(name)
            if experiment.communication_step_size < STEP:  # held over the table's step it would be another law
                continue
            reference = system.components.get("controller", "")
            fmu = read_description(locate(reference)) if reference else None
            if fmu is None or "tau_command_B" not in fmu.base_names("output"):
                continue
            inputs = set(fmu.base_names("input"))
            if not inputs >= CONTROLLER_INPUTS or inputs & _from_elsewhere(system):
                continue
            new = of_system(system, name, paper.key)
            if not any(replace(other, name=name) == new for other in found.values()):
                found[name] = new
    return found


def of_system(system: System, name: str, paper: str = "") -> Controller:
    """Return the controller of a system of standard instance names, with its observer if it has one."""
    mine = [n for n in ("controller", "observer") if n in system.components]
    return Controller(
        name,
        paper,
        {n: system.components[n] for n in mine},
        [c for c in system.connections if {split_port(c.source)[0], split_port(c.target)[0]} <= set(mine)],
        {k: v for k, v in system.parameters.items() if split_port(k)[0] in mine},
    )


def alone(reference: Reference, name: str) -> Controller:
    """Return a controller that comes alone, with its FMU's start values."""
    return Controller(name, "", {"controller": reference}, [], {})


def _from_elsewhere(system: System) -> set[str]:
    """Return what a controller takes from its paper's guidance beyond the standard reference, which no other gives."""
    links = [(split_port(c.source)[0], *split_port(c.target)) for c in system.connections]
    return {port for source, target, port in links if (source, target) == ("guidance", "controller")} - REFERENCE


def fit(controller: Controller, plant: Plant, locate: Locate) -> Controller:
    """Return a controller for a vehicle: built for its modes, told its parameters, what follows from them derived."""
    own = {name: _sized(reference, plant.modes, locate) for name, reference in controller.components.items()}
    fmus = {name: read_description(locate(reference)) for name, reference in own.items()}
    links = [c for c in controller.connections if _there(c, fmus)]
    used = {"controller", *(split_port(end)[0] for c in links for end in (c.source, c.target))}
    known = {
        f"{name}.{key}": value
        for name in used
        for key, value in {**plant.vehicle, **plant.told}.items()
        if name in fmus and key in fmus[name].groups
    }
    rule = RULES.get(controller.paper)
    derived = rule(plant.vehicle) if rule is not None and plant.name != controller.paper else {}
    numbers = {
        key: value
        for key, value in {**controller.parameters, **derived, **known}.items()
        if split_port(key)[0] in used and split_port(key)[1] in fmus[split_port(key)[0]].groups
    }
    return replace(
        controller, components={n: r for n, r in own.items() if n in used}, connections=links, parameters=numbers
    )


def _sized(reference: Reference, modes: int, locate: Locate) -> Reference:
    """Return the reference of an FMU, with the vehicle's number of modes if it knows modes."""
    groups = read_description(locate(reference)).groups
    if "Omega" not in groups or len(groups["Omega"].elements) == modes:
        return reference
    if not isinstance(reference, str) or is_fmu(reference):
        return reference  # as it was built: System says which sizes do not agree
    head, *structure = reference.split(":")
    kept = [part for several in structure for part in several.split(",") if not part.startswith("modes=")]
    return ":".join([head, *kept, f"modes={modes}"])


def _there(connection: Connection, fmus: Mapping[str, ModelDescription]) -> bool:
    """Whether both ends of a connection exist: without modes there is no modal coordinate."""
    ends = map(split_port, (connection.source, connection.target))
    return all(variable in fmus[instance].groups for instance, variable in ends)
