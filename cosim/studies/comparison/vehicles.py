"""The attitude plants of the papers, each with a cluster that takes a torque command.

A paper's own cluster is used where it takes torques. Rates alone: the weighted pseudo-inverse steers it. No cluster in
the paper (an ideal torque): three reaction wheels on the body axes.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from cosim.flights import Locate
from cosim.studies import papers
from cosim.studies.comparison.mission import TORQUE_LIMIT
from cosim.system import Connection, System
from fmus.description.description import ModelDescription
from fmus.description.names import split_port
from fmus.description.read import read_description

PLANT_INPUTS = {"tau_B", "h_B", "tau_dist_B"}
OTHERS = ("guidance", "environment", "controller", "observer", "plant")  # instances that are no cluster
STANDARD = ("tau_command_B", "attitude_error")  # what a cluster may take from any controller
NO_LIMIT = 1e9  # N m, in a parameter


@dataclass(frozen=True)
class Plant:
    """A vehicle: its plant, its cluster's FMUs by instance with connections and parameters, vehicle parameters."""

    name: str
    reference: str
    vehicle: Mapping[str, Any]
    components: Mapping[str, str]
    connections: Sequence[Connection]
    parameters: Mapping[str, Any]
    cluster: str

    @property
    def modes(self) -> int:
        """How many modes the vehicle has."""
        return len(_plain(self.vehicle["Omega"])) if "Omega" in self.vehicle else 0


def find_plants(locate: Locate) -> dict[str, Plant]:
    """Return one attitude plant a paper, by the paper's key."""
    found: dict[str, Plant] = {}
    for key, paper in papers.PAPERS.items():
        for name in paper.experiments:
            system, _ = paper.make(name)
            reference = system.components.get("plant", "")
            if reference and set(read_description(locate(reference)).base_names("input")) >= PLANT_INPUTS:
                found.setdefault(key, _plant(key, system, locate))
    return found


def _plant(key: str, system: System, locate: Locate) -> Plant:
    own = {name: ref for name, ref in system.components.items() if name not in OTHERS}
    fmus = {name: read_description(locate(reference)) for name, reference in own.items()}
    links = [c for c in system.connections if _within(c, own)]
    vehicle = dict(system.vehicle)
    if not own:
        own = {"actuators": "ReactionWheels"}
        links = [
            Connection("controller.tau_command_B", "actuators.tau_command_B"),
            Connection("actuators.h_B", "plant.h_B", "ramp"),
        ]
        words = f"3 reaction wheels of {TORQUE_LIMIT:g} N m on the body axes; the paper has an ideal torque"
    elif not any("tau_command_B" in fmu.base_names("input") for fmu in fmus.values()):
        reference, steered = _steering(fmus["actuators"])
        own = {"steering": reference, **own}
        links += steered
        words = f"{', '.join(own.values())}: the paper's cluster, its rates from a weighted pseudo-inverse"
    else:
        words = f"{', '.join(own.values())}: the paper's cluster"
    parameters = _of_cluster(system.parameters, fmus)
    motor = next((v for k, v in parameters.items() if k.endswith(".wheel_torque_limit")), None)
    vehicle.setdefault("torque_limit", [TORQUE_LIMIT] * 3 if motor is None else motor)
    return Plant(key, system.components["plant"], vehicle, own, links, parameters, words)


def _within(connection: Connection, cluster: Mapping[str, str]) -> bool:
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
