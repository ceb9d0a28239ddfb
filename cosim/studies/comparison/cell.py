"""One flight of the table: the system of a controller on a plant, and the figures of its run.

A controller that refuses, diverges, does not settle or leaves the domain of its own law says so in place of figures.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from cosim.errors import InitializationFailed, SimulationError, WiringErrors
from cosim.flights import Locate, Progress, simulate
from cosim.masters.explicit import Explicit
from cosim.results.result import Result
from cosim.studies import metrics
from cosim.studies.comparison import mission
from cosim.studies.comparison.laws import Controller
from cosim.studies.comparison.vehicles import Plant
from cosim.system import Connection, Experiment, System
from fmus.description.description import ModelDescription
from fmus.description.read import read_description

COLUMNS = (
    "settling time (s)",
    "steady error (deg)",
    "peak torque (N.m)",
    "peak eta (kg(1/2).m)",
    "torque impulse (N.m.s)",
)
INTERRUPTED = "interrupted"


@dataclass(frozen=True)
class Cell:
    """One flight: its figures by column, or the remark that stands for them."""

    plant: str
    controller: str
    figures: Mapping[str, float]
    remark: str = ""


def make_system(plant: Plant, controller: Controller, locate: Locate) -> System:
    """Return the system of one flight, of a controller that was made to `fit` the plant.

    Raises `WiringErrors` where an input has no source.
    """
    components = {
        "guidance": "Slew",
        "environment": "HarmonicTorque",
        **controller.components,
        **plant.components,
        "plant": plant.reference,
    }
    fmus = {name: read_description(locate(reference)) for name, reference in components.items()}
    links = [*controller.connections, *plant.connections]
    known = {name for fmu in fmus.values() for name in fmu.groups}  # an ideal torque has no limit to be told
    return System(
        name=f"{controller.name} on {plant.name}",
        components=components,
        connections=[
            *links,
            *_incoming(controller, plant, fmus, {c.target for c in links}),
            Connection("environment.tau_dist_B", "plant.tau_dist_B", "midpoint"),
        ],
        vehicle={name: value for name, value in plant.vehicle.items() if name in known},
        parameters={
            **mission.TURN,
            **mission.DISTURBANCE,
            "plant.q_BN": Rotation.from_rotvec(mission.START_ERROR, degrees=True).as_quat(scalar_first=True),
            "plant.omega_BN_B": [0.0, 0.0, 0.0],
            **plant.parameters,
            **controller.parameters,
        },
        held={f"{name}.tau_B": [0.0] * 3 for name in components if _takes_momentum(fmus[name])},
    )


def _takes_momentum(fmu: ModelDescription) -> bool:
    """Whether an FMU has the torque of a cluster from its momentum: then none comes in beside it."""
    return bool(fmu.rates_act) and "tau_B" in fmu.base_names("input")


def _incoming(
    controller: Controller, plant: Plant, fmus: Mapping[str, ModelDescription], served: set[str]
) -> list[Connection]:
    """Connect what controller and observer take to the instance that offers it under its standard name."""
    offers: dict[str, str] = {}
    for instance in ("plant", *plant.components, "guidance"):
        offers |= {name: instance for name in fmus[instance].base_names("output") if name != "tau_planned_B"}
    offers["tau_B"] = offers["h_B"] = "actuators"
    found: list[Connection] = []
    for instance in controller.components:
        for name in fmus[instance].base_names("input"):
            target = f"{instance}.{name}"
            held = name == "tau_B" and _takes_momentum(fmus[instance])
            if target not in served and name in offers and not held:
                timing = None if name == "tau_B" else "after_step"
                found.append(Connection(f"{offers[name]}.{name}", target, timing))
    return found


def fly(plant: Plant, controller: Controller, locate: Locate, progress: Progress | None = None) -> Cell:
    """Return the figures of one flight of a fitted controller, or what kept it from giving any."""
    experiment = Experiment(
        stop_time=mission.STOP,
        communication_step_size=mission.STEP,
        every=mission.EVERY,
        record=("plant.*", "guidance.*", "actuators.*", "controller.*"),
        master=Explicit(),
    )
    try:
        system = make_system(plant, controller, locate)
        run = simulate(system, experiment, locate=locate, progress=progress, advise=False)
    except InitializationFailed as error:
        words = error.messages[-1] if error.messages else error.problem
        return Cell(plant.name, controller.name, {}, f"refuses: {words.partition(': ')[2] or words}")
    except WiringErrors as error:
        return Cell(plant.name, controller.name, {}, f"does not fit: {error.mistakes[0]}")
    except SimulationError as error:
        time = float(error.result.time[-1]) if error.result is not None and len(error.result) else 0.0
        return Cell(plant.name, controller.name, {}, f"ends at {time:.1f} s: {str(error).partition(chr(10))[0]}")
    return measure(plant.name, controller.name, run)


def measure(plant: str, controller: str, run: Result) -> Cell:
    """Return the figures of a flight; one without figures has a remark: not finished, not settled, out of domain."""
    error = metrics.attitude_error(run)
    if error is None or run.info["status"] != "finished":
        return Cell(plant, controller, {}, INTERRUPTED)
    late = run.time >= run.time[-1] - mission.STEADY
    settled = metrics.settling_time(run.time, error, mission.THRESHOLD)
    steady = float(np.max(np.linalg.norm(error[late], axis=1)))
    if settled is None:
        remark = f"does not settle: {steady:.3g} deg in the last {mission.STEADY:g} s"
        return Cell(plant, controller, {}, remark)
    outside = metrics.out_of_domain(run)
    if outside:
        return Cell(plant, controller, {}, outside)
    eta = run["plant.eta"] if "plant.eta" in run else np.zeros((len(run), 1))
    torque = np.abs(run["actuators.tau_B"])
    values = (settled, steady, torque.max(), np.abs(eta).max(), np.trapezoid(torque, run.time, axis=0).sum())
    return Cell(plant, controller, dict(zip(COLUMNS, map(float, values), strict=True)))
