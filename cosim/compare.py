"""Every torque-commanding attitude controller on every attitude plant: one slew, one disturbance, one table.

Plants are the vehicles of the papers' experiments, controllers those of the experiments with their parameters. A cell
starts with a small error, then follows a smooth slew: guidance, the controller with its observer if it has one, three
wheels on the body axes, and the plant. The vehicle's parameters are carried into plant and controller alike, gains are
not retuned. A controller that refuses, diverges or does not settle says so in place of a figure.
"""

import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from cosim import metrics, papers
from cosim.errors import InitializationFailed, SimulationError, UnknownName, WiringErrors
from cosim.interface import Interface
from cosim.masters.explicit import Explicit
from cosim.names import split_port
from cosim.result import Result
from cosim.simulate import Progress, simulate
from cosim.slave import read_interface
from cosim.system import Connection, Experiment, System, Value

Locate = Callable[[str], Path]

STOP, STEP = 400.0, 1e-3  # s
THRESHOLD = 0.01  # deg, settled below
START_ERROR = (0.2, 0.15, -0.2)  # deg, rotation vector from reference to body at the start
STEADY = 50.0  # s, at the end: the window of the steady error
TORQUE_LIMIT = 1.0  # N m, of each wheel
TURN = {  # about a skew axis, so that all axes couple; the largest vehicle needs 0.3 N m
    "guidance.axis": [1 / np.sqrt(3)] * 3,
    "guidance.angle": Value(10.0, "deg"),
    "guidance.max_rate": Value(0.15, "deg/s"),
    "guidance.max_acceleration": Value(0.01, "deg/s2"),
    "guidance.start_time": 10.0,
}
DISTURBANCE = {
    "environment.bias": [1e-3, 0.0, 1e-3],
    "environment.sine": [0.0, 1e-3, 1e-3],
    "environment.cosine": [1e-3, 1e-3, 0.0],
    "environment.frequency": 0.0011,
}
PLANT_INPUTS = {"tau_B", "h_B", "tau_dist_B"}
CONTROLLER_INPUTS = {"q_BN", "omega_BN_B", "q_RN"}
COLUMNS = (
    "settling time (s)",
    "steady error (deg)",
    "peak torque (N.m)",
    "peak eta (kg(1/2).m)",
    "torque impulse (N.m.s)",
)
HEAD = ("plant", "controller", *COLUMNS, "remark")


@dataclass(frozen=True)
class Plant:
    """A vehicle of an experiment: FMU reference and vehicle parameters."""

    name: str
    reference: str
    vehicle: Mapping[str, Any]


@dataclass(frozen=True)
class Controller:
    """A controller of an experiment: its FMUs by instance, the connections among them, and their own parameters."""

    name: str
    components: Mapping[str, str]
    connections: Sequence[Connection]
    parameters: Mapping[str, Any]


@dataclass(frozen=True)
class Cell:
    """One flight: its figures by column, or the remark that stands for them."""

    plant: str
    controller: str
    figures: Mapping[str, float]
    remark: str = ""


@dataclass(frozen=True)
class Table:
    """All flights, the parameter sets that they used, and the files written."""

    cells: tuple[Cell, ...]
    parameters: Mapping[str, Mapping[str, Any]]
    files: tuple[Path, ...]


def plants(locate: Locate) -> dict[str, Plant]:
    """Return one attitude plant a paper, by the paper's key."""
    found: dict[str, Plant] = {}
    for key, module in papers.PAPERS.items():
        for make in module.systems().values():
            system, _ = make()
            reference = system.components.get("plant", "")
            if reference and set(read_interface(locate(reference)).base_names("input")) >= PLANT_INPUTS:
                known = read_interface(locate(reference)).groups
                vehicle = {name: value for name, value in system.vehicle.items() if name in known}
                found.setdefault(key, Plant(key, reference, vehicle))
    return found


def controllers(locate: Locate) -> dict[str, Controller]:
    """Return the torque-commanding attitude controllers, by the first experiment that has each with its parameters."""
    found: dict[str, Controller] = {}
    for name, make in papers.systems().items():
        system, _ = make()
        reference = system.components.get("controller", "")
        fmu = read_interface(locate(reference)) if reference else None
        if fmu is None or "tau_command_B" not in fmu.base_names("output"):
            continue
        if not set(fmu.base_names("input")) >= CONTROLLER_INPUTS:
            continue
        mine = [n for n in ("controller", "observer") if n in system.components]
        ends = [(c, split_port(c.source)[0], split_port(c.target)[0]) for c in system.connections]
        new = Controller(
            name,
            {n: system.components[n] for n in mine},
            [c for c, source, target in ends if source in mine and target in mine],
            {k: v for k, v in system.parameters.items() if split_port(k)[0] in mine},
        )
        if not any(replace(other, name=name) == new for other in found.values()):
            found[name] = new
    return found


def cell(plant: Plant, controller: Controller, locate: Locate) -> System:
    """Return the system of one flight; raises `WiringErrors` where an input of the controller has no source."""
    fmus = {name: read_interface(locate(reference)) for name, reference in controller.components.items()}
    carried = {
        f"{name}.{key}": value for name in fmus for key, value in plant.vehicle.items() if key in fmus[name].groups
    }
    own = {k: v for k, v in controller.parameters.items() if k not in carried}
    links = [*controller.connections, *_incoming(fmus, controller, read_interface(locate(plant.reference)))]
    limited = {f"{name}.torque_limit": TORQUE_LIMIT for name in fmus if "torque_limit" in fmus[name].groups}
    return System(
        name=f"{controller.name} on {plant.name}",
        components={
            "guidance": "Slew",
            "environment": "HarmonicTorque",
            **controller.components,
            "actuators": "ReactionWheels",
            "plant": plant.reference,
        },
        connections=[
            *links,
            Connection("controller.tau_command_B", "actuators.tau_command_B"),
            Connection("actuators.tau_B", "plant.tau_B"),
            Connection("actuators.h_B", "plant.h_B", "ramp"),
            Connection("environment.tau_dist_B", "plant.tau_dist_B", "midpoint"),
        ],
        vehicle=dict(plant.vehicle),
        parameters={
            **TURN,
            **DISTURBANCE,
            "plant.q_BN": Rotation.from_rotvec(START_ERROR, degrees=True).as_quat(scalar_first=True),
            "plant.omega_BN_B": [0.0, 0.0, 0.0],
            "actuators.torque_limit": TORQUE_LIMIT,
            **own,
            **carried,
            **limited,
        },
    )


def _incoming(fmus: Mapping[str, Interface], controller: Controller, plant: Interface) -> list[Connection]:
    """Connect what controller and observer take to the unit that offers it under its standard name."""
    served = {c.target for c in controller.connections}
    offers = {n: "guidance" for n in ("q_RN", "omega_RN_R", "omega_dot_RN_R")}
    offers |= dict.fromkeys(("h_B", "tau_B", "wheel_speed"), "actuators") | {
        n: "plant" for n in plant.base_names("output")
    }
    found: list[Connection] = []
    for instance, fmu in fmus.items():
        for name in fmu.base_names("input"):
            target = f"{instance}.{name}"
            if target not in served and name in offers:
                timing = None if name == "tau_B" else "after_step"
                found.append(Connection(f"{offers[name]}.{name}", target, timing))
    return found


def compare(
    chosen_plants: Sequence[str],
    chosen_controllers: Sequence[str],
    folder: Path,
    locate: Locate,
    progress: Progress | None = None,
    announce: Callable[[str], None] = lambda _line: None,
) -> Table:
    """Fly every chosen controller on every chosen plant (none named: all); write `compare.md` and `compare.json`.

    Raises `UnknownName` for a plant or a controller that there is not.
    """
    rows = _chosen("plant", plants(locate), chosen_plants)
    columns = _chosen("controller", controllers(locate), chosen_controllers)
    cells: list[Cell] = []
    for plant in rows:
        for controller in columns:
            announce(f"{controller.name} on {plant.name}")
            cells.append(fly(plant, controller, locate, progress))
    used = {c.name: {k: _plain(v) for k, v in c.parameters.items()} for c in columns}
    used |= {p.name: {k: _plain(v) for k, v in p.vehicle.items()} for p in rows}
    folder.mkdir(parents=True, exist_ok=True)
    table, data = folder / "compare.md", folder / "compare.json"
    table.write_text(markdown(cells), encoding="utf-8")
    content = {"cells": [asdict(c) for c in cells], "parameters": used, "slew": {k: _plain(v) for k, v in TURN.items()}}
    data.write_text(json.dumps(content, indent=2) + "\n", encoding="utf-8")
    return Table(tuple(cells), used, (table, data))


def fly(plant: Plant, controller: Controller, locate: Locate, progress: Progress | None = None) -> Cell:
    """Return the figures of one flight, or what kept it from giving any."""
    experiment = Experiment(stop_time=STOP, communication_step_size=STEP, every=100, master=Explicit(centred=True))
    try:
        run = simulate(cell(plant, controller, locate), experiment, locate=locate, progress=progress)
    except InitializationFailed as error:
        words = error.messages[-1] if error.messages else error.problem
        return Cell(plant.name, controller.name, {}, f"refuses: {words.partition(': ')[2] or words}")
    except WiringErrors as error:
        return Cell(plant.name, controller.name, {}, f"does not fit: {error.mistakes[0]}")
    except SimulationError as error:
        return Cell(plant.name, controller.name, {}, f"ends at {getattr(error, 'time', 0.0):.1f} s: {_first(error)}")
    return measured(plant.name, controller.name, run)


def measured(plant: str, controller: str, run: Result) -> Cell:
    """Return the figures of a finished flight; one that is not settled at its end has only the remark."""
    error = metrics.attitude_error(run)
    if error is None or run.info["status"] != "finished":
        return Cell(plant, controller, {}, "not flown to the end")
    late = run.time >= run.time[-1] - STEADY
    settled = metrics.settling_time(run.time, error, THRESHOLD)
    steady = float(np.max(np.linalg.norm(error[late], axis=1)))
    if settled is None:
        return Cell(plant, controller, {}, f"does not settle: {steady:.3g} deg in the last {STEADY:g} s")
    eta = run["plant.eta"] if "plant.eta" in run else np.zeros((len(run), 1))
    torque = np.abs(run["actuators.tau_B"])
    values = (settled, steady, torque.max(), np.abs(eta).max(), np.trapezoid(torque, run.time, axis=0).sum())
    return Cell(plant, controller, dict(zip(COLUMNS, map(float, values), strict=True)))


def markdown(cells: Iterable[Cell]) -> str:
    """Return the table of figures in Markdown."""
    lines = [HEAD, ("---",) * len(HEAD), *map(row, cells)]
    return "".join(f"| {' | '.join(cell.replace('|', '/') for cell in line)} |\n" for line in lines)


def row(cell: Cell) -> tuple[str, ...]:
    """Return a cell of the table as a row of texts under HEAD."""
    figures = [f"{cell.figures[c]:.4g}" if c in cell.figures else "" for c in COLUMNS]
    return (cell.plant, cell.controller, *figures, cell.remark)


def _chosen(kind: str, found: Mapping[str, Any], names: Sequence[str]) -> list[Any]:
    for name in names:
        if name not in found:
            raise UnknownName(kind, name, "the papers", list(found))
    return [found[name] for name in names or found]


def _first(error: Exception) -> str:
    return str(error).partition("\n")[0]


def _plain(value: Any) -> Any:
    return f"{value.value} {value.unit or ''}".strip() if isinstance(value, Value) else value
