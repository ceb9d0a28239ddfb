"""A communication step of the C kernel against C loops written by hand for the same two native FMUs and their wiring.

Plant (second order) and PD controller of parts.py, Jacobi, 10 ms, one internal step a communication step, nothing
recorded between the first and the last row. The loops are in kernel_step.c; all must end in the same bits. Budget: 1.5
times the loop that makes the same calls. For information: the leanest loop, and the Python loop.
"""

import ctypes
import tempfile
from pathlib import Path

import bench
from parts import Controller, Plant

from cosim.masters.explicit import Explicit
from cosim.masters.initialization.initialize import Initialization
from cosim.masters.kernel.kernel import Kernel
from cosim.masters.run import run
from cosim.masters.stepping import Stepping
from cosim.masters.watch import Block, Watch
from cosim.slaves.fmi2 import FmuSlave
from cosim.system import Connection, System
from cosim.system.expand import wire
from cosim.time import Schedule
from fmus.export.build import build
from fmus.toolchain import compile_library

STEPS, PYTHON_STEPS, ROUNDS, H = 300_000, 3_000, 15, 0.01
CONNECTIONS = (
    Connection("plant.angle", "controller.angle"),
    Connection("plant.rate", "controller.rate"),
    Connection("controller.tau", "plant.tau"),
)


class Fmu(ctypes.Structure):
    _fields_ = [(name, ctypes.c_void_p) for name in ("instance", "set", "get", "step")]
    _fields_ += [(name, ctypes.c_uint * 2) for name in ("inputs", "outputs")]


class Flight:
    """The two FMUs, wired and initialized."""

    def __init__(self, folder: Path, steps: int):
        paths = {"plant": folder / "Plant.fmu", "controller": folder / "Controller.fmu"}
        self.slaves = {name: FmuSlave(name, path) for name, path in paths.items()}
        system = System(name="loop", components=dict.fromkeys(paths, ""), connections=CONNECTIONS)
        master, wiring = Explicit("jacobi"), wire(system, {n: slave.description for n, slave in self.slaves.items()})
        timed = master.timed(wiring)
        self.course = master.course(timed, Schedule.of(0.0, steps * H, H, steps), ("*",))
        self.point = Initialization.of(timed, self.course.layout).start(self.slaves, 0.0)
        self.watch = Watch(self.course.layout, self.course.schedule, Block(8, len(self.course.layout.columns.names)))

    def take(self, algorithm) -> float:
        """Fly by the kernel or by the Python loop; return the seconds."""
        flying = algorithm(self)
        going = run(flying, self.course.control(), self.point, self.watch)
        return bench.clocked(lambda: list(going), self.course.schedule.steps)()

    def by_hand(self, function) -> float:
        """Fly by a loop of kernel_step.c; return the seconds."""
        steps = self.course.schedule.steps
        y = (ctypes.c_double * 2)(*self.get("plant", "angle", "rate"))
        u = (ctypes.c_double * 1)(*self.get("controller", "tau"))
        plant, pd = self.fmu("plant", ("tau",), ("angle", "rate")), self.fmu("controller", ("angle", "rate"), ("tau",))
        arguments = ctypes.byref(plant), ctypes.byref(pd), ctypes.c_long(steps), ctypes.c_double(1 / H), y, u
        return bench.clocked(lambda: function(*arguments), steps)()

    def references(self, instance: str, *names: str) -> tuple[int, ...]:
        return tuple(self.slaves[instance].description.variables[name].value_reference for name in names)

    def get(self, instance: str, *names: str) -> list[float]:
        return self.slaves[instance].get_real(self.references(instance, *names)).tolist()

    def fmu(self, instance: str, inputs: tuple[str, ...], outputs: tuple[str, ...]) -> Fmu:
        slave = self.slaves[instance]
        found = slave.c_interface()
        functions = (found.functions[f"fmi2{name}"] for name in ("SetReal", "GetReal", "DoStep"))
        pairs = ((ctypes.c_uint * 2)(*self.references(instance, *names)) for names in (inputs, outputs))
        return Fmu(found.component, *functions, *pairs)

    def end(self) -> list[float]:
        values = self.get("plant", "angle", "rate")
        for slave in self.slaves.values():
            slave.free()
        return values


def kernel(flight: Flight) -> Kernel:
    return Kernel(flight.course.turns, flight.slaves, flight.watch)


def python(flight: Flight) -> Stepping:
    return Stepping(flight.course.turns, flight.slaves, flight.watch)


def main(folder: Path) -> None:
    for component in (Plant(), Controller()):
        build(component, folder / f"{component.name}.fmu")
    source = Path(__file__).with_suffix(".c")
    compile_library(source.parent, source.name, folder / "loops.so")
    loops = ctypes.CDLL(str(folder / "loops.so"))
    ends = {}

    def contestant(name: str, fly, steps: int = STEPS):
        def once() -> float:
            flight = Flight(folder, steps)
            seconds = fly(flight)
            ends[name] = flight.end()
            return seconds

        return once

    flights = {
        "C loop, same calls": contestant("same", lambda f: f.by_hand(loops.loop_same)),
        "C loop, leanest": contestant("lean", lambda f: f.by_hand(loops.loop_lean)),
        "kernel": contestant("kernel", lambda f: f.take(kernel)),
        "Python loop": contestant("python", lambda f: f.take(python), PYTHON_STEPS),
    }
    times = bench.rounds(flights, ROUNDS)
    contestant("short", lambda f: f.take(kernel), PYTHON_STEPS)()
    assert ends["same"] == ends["lean"] == ends["kernel"] and ends["python"] == ends["short"], ends
    bench.compare(f"kernel step: two small native FMUs, {STEPS} steps", times, "C loop, same calls", {"kernel": 1.5})


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as place:
        main(Path(place))
