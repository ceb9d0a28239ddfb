"""Attitude plants, each with a cluster that takes a torque command: of the papers, of any system, or alone.

A system's own cluster is used where it takes torques. Rates alone: the weighted pseudo-inverse steers it. No cluster
(an ideal torque, a plant alone): three reaction wheels on the body axes.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from cosim.flights import Locate
from cosim.studies import papers
from cosim.studies.comparison.mission import TORQUE_LIMIT
from cosim.system import Connection, System, Value
from cosim.system.reference import Reference, name_of
from fmus.description.description import ModelDescription
from fmus.description.names import nested, split_element, split_port
from fmus.description.read import read_description

PLANT_INPUTS = {"tau_B", "h_B", "tau_dist_B"}
STANDARD = ("tau_command_B", "attitude_error")  # what a cluster may take from any controller
NO_LIMIT = 1e9  # N m, in a parameter
VEHICLE = ("J", "delta", "Omega", "zeta")
"""What a controller may know of a vehicle, by the names that plants and controllers share."""
WHEELS = f"3 reaction wheels of {TORQUE_LIMIT:g} N m on the body axes"


@dataclass(frozen=True)
class Plant:
    """A vehicle: its plant, its cluster's FMUs by instance with connections and parameters, vehicle parameters.

    `held`: further inputs of the plant, with their values. `told`: what controllers know beside the vehicle.
    """

    name: str
    reference: Reference
    vehicle: Mapping[str, Any]
    components: Mapping[str, Reference]
    connections: Sequence[Connection]
    parameters: Mapping[str, Any]
    cluster: str
    held: Mapping[str, Any] = field(default_factory=dict)
    told: Mapping[str, Any] = field(default_factory=dict)

    @property
    def modes(self) -> int:
        """How many modes the vehicle has."""
        return len(_plain(self.vehicle["Omega"])) if "Omega" in self.vehicle else 0


def find_plants(locate: Locate, keys: Iterable[str] = tuple(papers.PAPERS)) -> dict[str, Plant]:
    """Return one attitude plant a paper, by the paper's key."""
    found: dict[str, Plant] = {}
    for key in keys:
        paper = papers.find(key)
        for experiment in paper.experiments:
            system, _ = paper.make(experiment)
            reference = system.components.get("plant", "")
            if reference and set(read_description(locate(reference)).base_names("input")) >= PLANT_INPUTS:
                found[key] = of_paper(system, key, locate)
                break
    return found


def of_paper(system: System, key: str, locate: Locate) -> Plant:
    """Return the plant of a paper's experiment; what the experiment sets in it alone is no part of the vehicle."""
    return of_system(system, key, locate, whose="the paper")


def of_system(system: System, name: str, locate: Locate, whose: str = "the system") -> Plant:
    """Return the plant of a system of standard instance names, with the cluster that acts on it.

    The vehicle is the system's. What is between the plant and its controller otherwise, sensors, is left out.
    """
    ahead = _ahead_of_plant(system)
    own = {instance: system.components[instance] for instance in system.components if instance in ahead}
    fmus = {instance: read_description(locate(reference)) for instance, reference in own.items()}
    links = [c for c in system.connections if _within(c, own)]
    vehicle = dict(system.vehicle)
    if not own:
        own, links = _wheels(read_description(locate(system.components["plant"])))
        words = f"{WHEELS}; {whose} has an ideal torque"
    elif not any("tau_command_B" in fmu.base_names("input") for fmu in fmus.values()):
        reference, steered = _steering(fmus["actuators"])
        own = {"steering": reference, **own}
        links += steered
        words = f"{', '.join(map(name_of, own.values()))}: {whose}'s cluster, its rates from a weighted pseudo-inverse"
    else:
        words = f"{', '.join(map(name_of, own.values()))}: {whose}'s cluster"
    parameters = _of_cluster(system.parameters, fmus)
    motor = next((v for k, v in parameters.items() if k.endswith(".wheel_torque_limit")), None)
    told = _limits(parameters, fmus)
    if not told:
        vehicle.setdefault("torque_limit", [TORQUE_LIMIT] * 3 if motor is None else motor)
    return Plant(name, system.components["plant"], vehicle, own, links, parameters, words, told=told)


def alone(reference: Reference, name: str, locate: Locate) -> Plant:
    """Return a plant that comes alone, with wheels; its vehicle is what its FMU has as start values.

    Further inputs are held at their start values.
    """
    fmu = read_description(locate(reference))
    own, links = _wheels(fmu)
    served = {"tau_B", "h_B", "tau_dist_B"}
    return Plant(
        name,
        reference,
        {"torque_limit": [TORQUE_LIMIT] * 3, **starts(fmu, VEHICLE)},
        own,
        links,
        {},
        WHEELS,
        {port: _start(fmu, port) for port in fmu.base_names("input") if port not in served},
    )


def starts(fmu: ModelDescription, names: Iterable[str]) -> dict[str, Any]:
    """Return the start values of the parameters of an FMU that have one of these names, with their units."""
    found: dict[str, Any] = {}
    for name in names:
        group = fmu.groups.get(name)
        if group is not None and group.elements and fmu.variables[group.elements[0]].is_parameter:
            found[name] = Value(_start(fmu, name), fmu.variables[group.elements[0]].unit)
    return found


def _start(fmu: ModelDescription, name: str) -> Any:
    group = fmu.groups[name]
    return nested([fmu.variables[e].start or 0.0 for e in group.elements], group.shape)


def _wheels(plant: ModelDescription) -> tuple[dict[str, Reference], list[Connection]]:
    """Return three wheels and their connections: by momentum, to a plant that has no torque from that by torque too."""
    links = [Connection("controller.tau_command_B", "actuators.tau_command_B")]
    inputs, acts = plant.base_names("input"), {split_element(n)[0] for n in plant.rates_act}
    if "h_B" in inputs:
        links.append(Connection("actuators.h_B", "plant.h_B", "ramp"))
    if "tau_B" in inputs and "h_B" not in acts:
        links.append(Connection("actuators.tau_B", "plant.tau_B"))
    return {"actuators": "ReactionWheels"}, links


def _limits(parameters: Mapping[str, Any], fmus: Mapping[str, ModelDescription]) -> dict[str, Any]:
    """Return the torque limit, about each body axis alone, of wheels that are not three; {} where they are.

    A torque tau about axis i takes A^+_ji tau of wheel j, A^+ the pseudo-inverse of the spin axes.
    """
    wheels = fmus.get("actuators")
    group = None if wheels is None else wheels.groups.get("torque_limit")
    if wheels is None or group is None or len(group.elements) == 3 or "spin_axes_B" not in wheels.groups:
        return {}
    limit, axes = (
        np.asarray(_plain(parameters.get(f"actuators.{name}", _start(wheels, name))), float)
        for name in ("torque_limit", "spin_axes_B")
    )
    shares = np.abs(np.linalg.pinv(axes))
    with np.errstate(divide="ignore"):
        return {"torque_limit": np.min(np.reshape(limit, (-1, 1)) / shares, axis=0).tolist()}


def _ahead_of_plant(system: System) -> set[str]:
    """Return the instances that act on the plant by torque or momentum, through one another, but for its controller."""
    found: set[str] = set()
    ahead = [split_port(c.source)[0] for c in system.connections if c.target in ("plant.tau_B", "plant.h_B")]
    while ahead:
        instance = ahead.pop()
        if instance not in found and instance not in ("controller", "observer", "plant", "guidance"):
            found.add(instance)
            ahead += [split_port(c.source)[0] for c in system.connections if split_port(c.target)[0] == instance]
    return found


def _within(connection: Connection, cluster: Mapping[str, Reference]) -> bool:
    """Whether a connection is one of the cluster's that any controller leaves as it is."""
    (source, port), (target, _) = split_port(connection.source), split_port(connection.target)
    if source not in cluster and target not in cluster:
        return False
    ends = {*cluster, "plant"}
    return target in ends and (source in ends or (source == "controller" and port in STANDARD))


def _steering(actuators: ModelDescription) -> tuple[str, list[Connection]]:
    """Return the steering of a cluster that takes rates and accelerations, and its connections."""
    size = {name: len(actuators.groups[name].elements) for name in ("gimbal_angle", "wheel_speed")}
    reference = f"WeightedSteering:gimbals={size['gimbal_angle']}:wheels={size['wheel_speed']}"
    return reference, [
        Connection("controller.tau_command_B", "steering.tau_command_B", "after_step"),
        Connection("actuators.gimbal_angle", "steering.gimbal_angle", "after_step"),
        Connection("steering.gimbal_rate_command", "actuators.gimbal_rate_command"),
        Connection("steering.wheel_acceleration_command", "actuators.wheel_acceleration_command"),
    ]


def _of_cluster(parameters: Mapping[str, Any], fmus: Mapping[str, ModelDescription]) -> dict[str, Any]:
    """Return the parameters of a cluster's instances; those for every instance ("*.") are written out."""
    found: dict[str, Any] = {}
    for key, value in parameters.items():
        instance, name = split_port(key)
        for own in fmus if instance == "*" else [instance] if instance in fmus else []:
            if instance != "*" or name in fmus[own].groups:
                found[f"{own}.{name}"] = value
    return found


def _plain(value: Any) -> Any:
    return getattr(value, "value", value)
