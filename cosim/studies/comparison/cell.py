"""One flight of the table: the system of a controller on a plant, and the figures of its run.

A controller that refuses, diverges, does not settle or leaves the domain of its own law says so in place of figures.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from cosim.errors import InitializationFailed, SimulationError, StepFailed, WiringErrors
from cosim.flights import Locate, Progress, simulate
from cosim.masters.explicit import Explicit
from cosim.results.result import Result
from cosim.studies import metrics
from cosim.studies.comparison.laws import Controller
from cosim.studies.comparison.mission import Mission
from cosim.studies.comparison.vehicles import Plant
from cosim.studies.roles import loops
from cosim.system import Connection, Experiment, System
from fmus.description.description import ModelDescription
from fmus.description.read import read_description

COLUMNS = (
    "settling time (s)",
    "steady error (deg)",
    "peak torque (N.m)",
    "peak eta (kg^(1/2).m)",
    "torque impulse (N.m.s)",
)
INTERRUPTED = "interrupted"
EXCHANGES = {"slopes": Explicit(inputs="smooth", extrapolation=1), "held": Explicit()}
"""What a cell is flown with: with slopes, of order two; held, where a stiff loop diverges with them."""


@dataclass(frozen=True)
class Cell:
    """One flight: its figures by column, or the remark that stands for them; `exchange`: which of `EXCHANGES` flew."""

    plant: str
    controller: str
    figures: Mapping[str, float]
    remark: str = ""
    exchange: str = ""


def make_system(plant: Plant, controller: Controller, mission: Mission, locate: Locate) -> System:
    """Return the system of one flight, of a controller that was made to `fit` the plant.

    Raises `WiringErrors` where an input has no source.
    """
    components = {
        "guidance": "Slew",
        "environment": mission.environment,
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
            *_disturbing(fmus),
        ],
        vehicle={name: value for name, value in plant.vehicle.items() if name in known},
        parameters={
            **mission.parameters,
            "plant.q_BN": mission.start,
            "plant.omega_BN_B": [0.0, 0.0, 0.0],
            **plant.parameters,
            **controller.parameters,
        },
        held={
            **{f"{name}.tau_B": [0.0] * 3 for name in components if _takes_momentum(fmus[name])},
            **{f"plant.{name}": value for name, value in plant.held.items()},
        },
    )


def _disturbing(fmus: Mapping[str, ModelDescription]) -> list[Connection]:
    """Connect the disturbance to a plant that takes one, and to what it depends on where plant or guidance shows it."""
    found: list[Connection] = []
    if "tau_dist_B" in fmus["plant"].base_names("input"):
        found.append(Connection("environment.tau_dist_B", "plant.tau_dist_B", "midpoint"))
    for name in fmus["environment"].base_names("input"):
        source = next((other for other in ("plant", "guidance") if name in fmus[other].base_names("output")), "")
        found += [Connection(f"{source}.{name}", f"environment.{name}", "after_step")] if source else []
    return found


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


def fly(
    plant: Plant, controller: Controller, mission: Mission, locate: Locate, progress: Progress | None = None
) -> Cell:
    """Return the figures of one flight of a fitted controller, or what kept it from giving any.

    The first of `EXCHANGES` at which the loop does not diverge counts.
    """
    try:
        system = make_system(plant, controller, mission, locate)
    except WiringErrors as error:
        return Cell(plant.name, controller.name, {}, f"does not fit: {error.mistakes[0]}")
    cell = Cell(plant.name, controller.name, {}, "no exchange flies it")
    for exchange, master in EXCHANGES.items():
        cell, diverged = _flown(
            system, Cell(plant.name, controller.name, {}, exchange=exchange), master, mission, locate, progress
        )
        if not diverged:
            return cell
    return cell


def _flown(
    system: System, cell: Cell, master: Explicit, mission: Mission, locate: Locate, progress: Progress | None
) -> tuple[Cell, bool]:
    """Return one flight's cell, and whether it diverged."""
    experiment = Experiment(
        stop_time=mission.stop,
        communication_step_size=mission.step,
        every=mission.every,
        record=("plant.*", "guidance.*", "actuators.*", "controller.*"),
        master=master,
    )
    try:
        run = simulate(system, experiment, locate=locate, progress=progress, advise=False)
    except InitializationFailed as error:
        words = error.messages[-1] if error.messages else error.problem
        return replace(cell, remark=f"refuses: {words.partition(': ')[2] or words}"), False
    except WiringErrors as error:
        return replace(cell, remark=f"does not fit: {error.mistakes[0]}"), False
    except SimulationError as error:
        time = float(error.result.time[-1]) if error.result is not None and len(error.result) else 0.0
        ended = replace(cell, remark=f"ends at {time:.1f} s: {str(error).partition(chr(10))[0]}")
        return ended, isinstance(error, StepFailed)
    return measure(cell, run, mission), False


def measure(cell: Cell, run: Result, mission: Mission) -> Cell:
    """Return a cell with the figures of its flight, or a remark: not finished, not settled, out of domain."""
    error = metrics.attitude_error(run)
    if error is None or run.info["status"] != "finished":
        return replace(cell, remark=INTERRUPTED)
    late = run.time >= run.time[-1] - mission.window
    end = metrics.slew_end(run, loops(run)[0])
    if end is not None and end > run.time[-1]:
        return replace(cell, remark=f"the slew ends at {end:.4g} s, after the flight's {run.time[-1]:.4g} s")
    settled = metrics.settled_after(run.time, error, mission.threshold, float(run.time[0]) if end is None else end)
    steady = float(np.max(np.linalg.norm(error[late], axis=1)))
    if settled is None:
        return replace(cell, remark=f"does not settle: {steady:.3g} deg in the last {mission.window:g} s")
    if outside := metrics.out_of_domain(run):
        return replace(cell, remark=outside)
    eta = run["plant.eta"] if "plant.eta" in run else np.zeros((len(run), 1))
    torque = np.abs(run["actuators.tau_B"])
    values = (settled, steady, torque.max(), np.abs(eta).max(), np.trapezoid(torque, run.time, axis=0).sum())
    return replace(cell, figures=dict(zip(COLUMNS, map(float, values), strict=True)))
