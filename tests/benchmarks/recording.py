"""What recording every step costs: CPU time of the loop that flies, with the file on the disk that grows in it.

Two small FMUs (kernel_step.py) against the C loop that keeps the same columns in memory, budget 3 times that loop; and
zhang2018-ppatc at 1 ms with all its columns, budget 1 us a row more than the same flight with its last row only. Rows
can be read after a kill -9 as they are written (tests/cosim/test_killed.py). Making a parquet of the file at the end
is no part of it.
"""

import ctypes
import tempfile
import time
from dataclasses import replace
from pathlib import Path
from statistics import median

import bench
import kernel_step
from parts import Controller, Plant

from cosim import flight, load, prepare
from cosim.cli.library import Library
from cosim.masters.run import run
from cosim.results.recorder import Recorder
from cosim.time import Schedule
from fmus.export.build import build
from fmus.toolchain import compile_library

STEPS, ROUNDS, SYSTEM = 300_000, 15, "zhang2018-ppatc"


def by_hand(folder: Path, loops: ctypes.CDLL) -> float:
    import numpy as np

    flown = kernel_step.Flight(folder, STEPS)
    pair, rows = flown.pair(*flown.names[0]), np.empty((STEPS, 7))
    rate, steps = ctypes.c_double(1 / kernel_step.H), ctypes.c_long(STEPS)
    seconds = flown.clocked(lambda: loops.loop_rows(ctypes.byref(pair), steps, rate, ctypes.c_void_p(rows.ctypes.data)))
    flown.end()
    return seconds


def recorded(folder: Path, *, to_file: bool) -> float:
    """Fly two FMUs; return the CPU seconds a step. Rows that go to no file are let go."""
    flown = kernel_step.Flight(folder, STEPS)
    schedule = Schedule.of(0.0, STEPS * kernel_step.H, kernel_step.H, 1)
    flown.course = replace(flown.course, turns=replace(flown.course.turns, schedule=schedule))
    flown.watch.schedule = schedule
    with tempfile.TemporaryDirectory() as place:
        recorder = Recorder(Path(place), flown.course.layout.columns, flown.point.texts)
        flown.watch.block = recorder.block

        def fly() -> None:
            with recorder:
                for _ in run(kernel_step.kernel(flown), flown.course.control(), flown.point, flown.watch):
                    if to_file:
                        recorder.look()
                    else:
                        recorder.block.count = 0

        seconds = flown.clocked(fly)
    flown.end()
    return seconds


def two_fmus(folder: Path) -> None:
    for component in (Plant(), Controller()):
        build(component, folder / f"{component.name}.fmu")
    source = Path(kernel_step.__file__).with_suffix(".c")
    compile_library(source.parent, source.name, folder / "loops.so")
    loops = ctypes.CDLL(str(folder / "loops.so"))
    flights = {
        "C loop, rows in memory": lambda: by_hand(folder, loops),
        "kernel, rows in its block": lambda: recorded(folder, to_file=False),
        "kernel, rows in the file": lambda: recorded(folder, to_file=True),
    }
    times = bench.rounds(flights, ROUNDS)
    title = f"2 native FMUs, delayed exchange, {STEPS} steps, each recorded, 7 columns"
    bench.compare(title, times, "C loop, rows in memory", {"kernel, rows in the file": 3.0})


def paper(folder: Path) -> None:
    system, experiment = load(SYSTEM)
    steps = 30_000
    every_step = replace(experiment, stop_time=steps * 1e-3, communication_step_size=1e-3, every=1)
    loops: dict[int, list[float]] = {1: [], steps: []}
    columns = 0
    with prepare(system, locate=Library("native")) as prepared:
        for round in range(ROUNDS):
            for every, found in loops.items():
                result = prepared.fly(replace(every_step, every=every), out=folder / f"{round}-{every}")
                found.append(result.info["wall_time"]["loop"])
                columns = len(result.table.column_names)
    more = [(a - b) / steps * 1e6 for a, b in zip(loops[1], loops[steps], strict=True)]
    figures = [
        ("a step, median", median(loops[steps]) / steps * 1e6, "us", None),
        ("a row more, median", median(more), "us", 1.0),
        ("a row more, by the least times", (min(loops[1]) - min(loops[steps])) / steps * 1e6, "us", 1.0),
    ]
    bench.limits(f"{SYSTEM}, {steps} steps of 1 ms, {columns} columns, CPU time of the loop", figures)


class CpuClock:
    """In place of the module `time` in flight.py: this thread's CPU time."""

    perf_counter = staticmethod(time.thread_time)


if __name__ == "__main__":
    flight.time = CpuClock
    with tempfile.TemporaryDirectory() as place:
        two_fmus(Path(place))
        paper(Path(place))
