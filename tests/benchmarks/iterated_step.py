"""Steps of the iterated master in the kernel against its FMU calls alone, on the loop of zhang2018-ppatc.

The Python loop flies some steps and every call is recorded; a C loop (iterated_step.c) then makes the same calls again,
with the same arguments, from the same states. The kernel flies the same steps, and must end in the same bits; no row is
written. Budget: 1.5 times the calls.
"""

import ctypes
import tempfile
from collections.abc import Sequence
from pathlib import Path

import bench
import numpy as np

from cosim import Library, load
from cosim.flights import find
from cosim.masters.implicit.iterating import Iterating
from cosim.masters.initialization.initialize import Initialization
from cosim.masters.iterated import Iterated
from cosim.masters.kernel.iterated import IteratedKernel
from cosim.masters.watch import Block, Watch
from cosim.slaves.fmi2 import FmuSlave
from cosim.system.expand import wire
from cosim.time import Schedule
from fmus.toolchain import compile_library

FIRST, STEPS, ROUNDS = 20, 400, 15
SET, SET_DERIVATIVES, STEP, GET, GET_DERIVATIVES, GET_STATE, SET_STATE = range(7)
FUNCTIONS = (
    "fmi2SetReal",
    "fmi2SetRealInputDerivatives",
    "fmi2DoStep",
    "fmi2GetReal",
    "fmi2GetRealOutputDerivatives",
    "fmi2GetFMUstate",
    "fmi2SetFMUstate",
)


class Fmu(ctypes.Structure):
    _fields_ = [
        ("instance", ctypes.c_void_p),
        *((name, ctypes.c_void_p) for name in FUNCTIONS),
        ("state", ctypes.c_void_p),
    ]


class Call(ctypes.Structure):
    _fields_ = [(name, ctypes.c_long) for name in ("kind", "fmu", "count")]
    _fields_ += [(name, ctypes.c_void_p) for name in ("references", "orders", "values")]
    _fields_ += [("t", ctypes.c_double), ("h", ctypes.c_double)]


class Recorder:
    """The calls of all slaves, in their order, while it is `on`; keeps the arrays alive that they point to."""

    def __init__(self):
        self.on, self.calls, self.kept = False, [], []

    def note(self, kind: int, fmu: int, references=(), orders=(), values=None, t=0.0, h=0.0) -> None:
        if self.on:
            vr, order = np.array(references, np.uint32), np.array(orders, np.int32)
            array = np.zeros(len(references)) if values is None else np.array(values, np.float64)
            self.kept.append((vr, order, array))
            self.calls.append(Call(kind, fmu, len(vr), vr.ctypes.data, order.ctypes.data, array.ctypes.data, t, h))


class Recorded(FmuSlave):
    """A slave whose calls are noted."""

    recorder: Recorder
    number: int

    def set_real(self, references, values):
        self.recorder.note(SET, self.number, references, values=values)
        super().set_real(references, values)

    def set_input_derivatives(self, references, orders, values):
        self.recorder.note(SET_DERIVATIVES, self.number, references, orders, values)
        super().set_input_derivatives(references, orders, values)

    def do_step(self, t, h):
        self.recorder.note(STEP, self.number, t=t, h=h)
        super().do_step(t, h)

    def get_real(self, references):
        self.recorder.note(GET, self.number, references)
        return super().get_real(references)

    def get_output_derivatives(self, references, orders):
        self.recorder.note(GET_DERIVATIVES, self.number, references, orders)
        return super().get_output_derivatives(references, orders)

    def get_state(self):
        self.recorder.note(GET_STATE, self.number)
        return super().get_state()

    def set_state(self, state):
        self.recorder.note(SET_STATE, self.number)
        super().set_state(state)


class Flight:
    """The loop of zhang2018-ppatc, initialized."""

    def __init__(self, step: float, recorder: Recorder | None = None):
        system, _ = load("zhang2018-ppatc")
        library = Library()
        paths = {name: find(reference, library) for name, reference in system.components.items()}
        self.slaves = {name: (Recorded if recorder else FmuSlave)(name, path) for name, path in paths.items()}
        if recorder:
            for number, slave in enumerate(self.slaves.values()):
                slave.recorder, slave.number = recorder, number
        self.master = Iterated()
        timed = self.master.timed(wire(system, {name: s.description for name, s in self.slaves.items()}))
        count = FIRST + STEPS
        self.course = self.master.course(timed, Schedule.of(0.0, count * step, step, count), ["plant.q_BN"])
        self.point = Initialization.of(timed, self.course.layout).start(self.slaves, 0.0)
        self.watch = Watch(self.course.layout, self.course.schedule, Block(8, len(self.course.layout.columns.names)))

    def free(self) -> None:
        for slave in self.slaves.values():
            slave.free()


def recorded(step: float) -> tuple[Recorder, Flight, list, list[float]]:
    """Fly in Python; return the calls of the last STEPS steps, the flight, the states before them, the last values."""
    recorder = Recorder()
    flight = Flight(step, recorder)
    loop = Iterating(flight.course.plan, flight.slaves, flight.master.tolerance)
    point = loop.advance(flight.point, FIRST).point
    states = [slave.get_state() for slave in flight.slaves.values()]
    recorder.on = True
    point = loop.advance(point, FIRST + STEPS).point
    recorder.on = False
    return recorder, flight, states, point.values.tolist()


def structures(slaves: Sequence[FmuSlave]) -> ctypes.Array:
    found = [slave.c_interface() for slave in slaves]
    return (Fmu * len(found))(*(Fmu(f.component, *(f.functions[name] for name in FUNCTIONS), None) for f in found))


def contest(loops: ctypes.CDLL, step: float) -> None:
    recorder, flight, states, last = recorded(step)
    fmus, calls = structures(list(flight.slaves.values())), (Call * len(recorder.calls))(*recorder.calls)

    def again() -> float:
        for slave, state in zip(flight.slaves.values(), states, strict=True):
            slave.set_state(state)
        return bench.clocked(lambda: loops.replay(fmus, calls, ctypes.c_long(len(calls))), STEPS)()

    def kernel() -> float:
        other = Flight(step)
        flying = IteratedKernel(other.course.plan, other.slaves, other.watch, other.master.tolerance)
        point = other.point
        while point.index < FIRST:
            point = flying.advance(point, FIRST).point
        reached = []

        def fly() -> None:
            at = point
            while at.index < FIRST + STEPS:
                at = flying.advance(at, FIRST + STEPS).point
            reached.append(at)

        seconds = bench.clocked(fly, STEPS)()
        assert reached[0].values.tolist() == last
        other.free()
        return seconds

    evaluations = sum(call.kind == STEP for call in recorder.calls) / STEPS
    print(f"{evaluations:.2f} calls of fmi2DoStep a communication step")
    times = bench.rounds({"the FMU calls alone": again, "kernel": kernel}, ROUNDS)
    bench.compare(f"iterated step: zhang2018-ppatc, {step:g} s", times, "the FMU calls alone", {"kernel": 1.5})
    flight.free()


def main(folder: Path) -> None:
    source = Path(__file__).with_suffix(".c")
    compile_library(source.parent, source.name, folder / "replay.so")
    loops = ctypes.CDLL(str(folder / "replay.so"))
    for step in (0.01, 0.1):
        contest(loops, step)


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as place:
        main(Path(place))
