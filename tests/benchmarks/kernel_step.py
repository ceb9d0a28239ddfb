"""A communication step of the C kernel against C loops written by hand for the same native FMUs and their wiring.

Plants (second order) and PD controllers of parts.py in pairs, 10 ms, one internal step a communication step, nothing
recorded between the first and the last row; with delayed exchange (jacobi), and with slopes (smooth inputs and
extrapolation). The loops are in kernel_step.c; all must end in the same bits. Budgets: 1.2 times the loop that makes
the same calls, with slopes 1.5, of 40 and 400 FMUs 1.3, and a cost that grows as that of the loop within 20 %. For
information: the leanest loop, and the Python loop. All times are CPU times.
"""

import ctypes
import tempfile
import time
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
from cosim.system.wiring import Port
from cosim.time import Schedule
from fmus.export.build import build
from fmus.toolchain import compile_library

STEPS, PYTHON_STEPS, ROUNDS, H = 200_000, 1_000, 15, 0.01
FUNCTIONS = ("SetReal", "GetReal", "DoStep", "SetRealInputDerivatives", "GetRealOutputDerivatives")
DELAYED, SLOPES = Explicit("jacobi"), Explicit(inputs="smooth", extrapolation=1)


class Fmu(ctypes.Structure):
    """As kernel_step.c has it."""

    _fields_ = [(name, ctypes.c_void_p) for name in ("instance", "set", "get", "step", "set_slopes", "get_slopes")]
    _fields_ += [(name, ctypes.c_uint * 2) for name in ("inputs", "outputs")]


class Pair(ctypes.Structure):
    """As kernel_step.c has it."""

    _fields_ = [("plant", Fmu), ("pd", Fmu), ("y", ctypes.c_double * 2), ("u", ctypes.c_double)]
    _fields_ += [("dy", ctypes.c_double * 2), ("du", ctypes.c_double), ("next", ctypes.c_double * 2)]


class Flight:
    """Pairs of FMUs, wired and initialized."""

    def __init__(self, folder: Path, steps: int, pairs: int = 1, master: Explicit = DELAYED):
        self.names = [(f"plant{i}", f"controller{i}") for i in range(pairs)]
        paths = {n: folder / f"{kind}.fmu" for pair in self.names for n, kind in zip(pair, KINDS, strict=True)}
        self.slaves = {name: FmuSlave(name, path) for name, path in paths.items()}
        wires = [
            wire
            for plant, controller in self.names
            for wire in (
                Connection(f"{plant}.angle", f"{controller}.angle", "after_step"),
                Connection(f"{plant}.rate", f"{controller}.rate", "after_step"),
                Connection(f"{controller}.tau", f"{plant}.tau", "at_point"),
            )
        ]
        system = System(name="loop", components=dict.fromkeys(paths, ""), connections=wires)
        wiring = wire(system, {n: slave.description for n, slave in self.slaves.items()})
        timed = master.timed(wiring)
        self.course = master.course(timed, Schedule.of(0.0, steps * H, H, steps), ("*",))
        self.point = Initialization.of(timed, self.course.layout).start(self.slaves, 0.0)
        self.watch = Watch(self.course.layout, self.course.schedule, Block(8, len(self.course.layout.columns.names)))

    def take(self, algorithm) -> float:
        """Fly by the kernel or by the Python loop; return the seconds a step."""
        going = run(algorithm(self), self.course.control(), self.point, self.watch)
        return self.clocked(lambda: list(going))

    def by_hand(self, function) -> float:
        """Fly by a loop of kernel_step.c; return the seconds a step."""
        pairs = (Pair * len(self.names))(*(self.pair(*names) for names in self.names))
        steps = ctypes.c_long(self.course.schedule.steps)
        return self.clocked(lambda: function(pairs, len(self.names), steps, ctypes.c_double(1 / H)))

    def clocked(self, call) -> float:
        began = time.thread_time()
        call()
        return (time.thread_time() - began) / self.course.schedule.steps

    def pair(self, plant: str, controller: str) -> Pair:
        made = Pair(self.fmu(plant, ("tau",), ("angle", "rate")), self.fmu(controller, ("angle", "rate"), ("tau",)))
        made.y[:] = [self.shown(plant, name) for name in ("angle", "rate")]
        made.dy[:] = [self.shown(plant, name, slope=True) for name in ("angle", "rate")]
        made.u, made.du = self.shown(controller, "tau"), self.shown(controller, "tau", slope=True)
        return made

    def shown(self, instance: str, name: str, *, slope: bool = False) -> float:
        """Return a value or a slope at the start, 0 of a slope that the exchange does not know."""
        port, layout = Port(instance, name), self.course.layout
        slot = layout.derivative_slots.get((port, 1)) if slope else layout.slots[port]
        return 0.0 if slot is None else float(self.point.values[slot])

    def references(self, instance: str, *names: str) -> tuple[int, ...]:
        return tuple(self.slaves[instance].description.variables[name].value_reference for name in names)

    def fmu(self, instance: str, inputs: tuple[str, ...], outputs: tuple[str, ...]) -> Fmu:
        found = self.slaves[instance].c_interface()
        functions = (found.functions[f"fmi2{name}"] for name in FUNCTIONS)
        pairs = ((ctypes.c_uint * 2)(*self.references(instance, *names)) for names in (inputs, outputs))
        return Fmu(found.component, *functions, *pairs)

    def end(self) -> list[float]:
        plants = [self.slaves[plant].get_real(self.references(plant, "angle", "rate")) for plant, _ in self.names]
        for slave in self.slaves.values():
            slave.free()
        return [value for found in plants for value in found.tolist()]


KINDS = ("Plant", "Controller")


def kernel(flight: Flight) -> Kernel:
    return Kernel(flight.course.turns, flight.slaves, flight.watch)


def python(flight: Flight) -> Stepping:
    return Stepping(flight.course.turns, flight.slaves, flight.watch)


def table(folder: Path, loops: ctypes.CDLL, pairs: int, master: Explicit, budget: float) -> dict[str, list[float]]:
    steps, ends = STEPS // pairs, {}

    def contestant(name: str, fly, steps: int = steps):
        def once() -> float:
            flight = Flight(folder, steps, pairs, master)
            seconds = fly(flight)
            ends[name] = flight.end()
            return seconds

        return once

    same = loops.loop_same if master == DELAYED else loops.loop_slopes
    flights = {
        "C loop, same calls": contestant("same", lambda f: f.by_hand(same)),
        "kernel": contestant("kernel", lambda f: f.take(kernel)),
    }
    if master == DELAYED:
        flights["C loop, leanest"] = contestant("lean", lambda f: f.by_hand(loops.loop_lean))
    if pairs == 1:
        flights["Python loop"] = contestant("python", lambda f: f.take(python), PYTHON_STEPS)
        contestant("short", lambda f: f.take(kernel), PYTHON_STEPS)()
    times = bench.rounds(flights, ROUNDS)
    assert ends["same"] == ends.get("lean", ends["same"]) == ends["kernel"], ends
    assert ends.get("python") == ends.get("short"), ends
    how = "delayed exchange" if master == DELAYED else "with slopes"
    bench.compare(f"{2 * pairs} native FMUs, {how}, {steps} steps", times, "C loop, same calls", {"kernel": budget})
    return times


def main(folder: Path) -> None:
    for component in (Plant(), Controller()):
        build(component, folder / f"{component.name}.fmu")
    source = Path(__file__).with_suffix(".c")
    compile_library(source.parent, source.name, folder / "loops.so")
    loops = ctypes.CDLL(str(folder / "loops.so"))
    table(folder, loops, 1, SLOPES, 1.5)
    costs = {}
    for pairs, budget in ((1, 1.2), (20, 1.3), (200, 1.3)):
        times = table(folder, loops, pairs, DELAYED, budget)
        costs[pairs] = bench.ratio(times["kernel"], times["C loop, same calls"])
    growth = [(f"from 2 to {2 * pairs} FMUs", costs[pairs] / costs[1], "", 1.2) for pairs in (20, 200)]
    bench.limits("the kernel's cost a pair, by that of the C loop of as many pairs", growth)


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as place:
        main(Path(place))
