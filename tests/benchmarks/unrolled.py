"""What it takes to write the steps of a run out in C and compile them, and what a call saves then.

Pairs of kernel_step.py, 10 ms, delayed exchange, nothing recorded between the first and the last row: CPU time by lists
of calls and written out, in turn, of the source and of the compiler. SAVED, MOST, COMPILER, COMPILED and LONG of
cosim/masters/kernel/unrolled.py come from here.
"""

import os
import sys
import tempfile
import time
from pathlib import Path

import bench
import kernel_step
from parts import Controller, Plant

from cosim.masters.kernel import unrolled
from fmus.export.build import build

PAIRS, STEPS, ROUNDS, CALLS = (1, 20, 100), 200_000, 9, 7
"""CALLS: of a pair in a step, three of the plant, four of the controller, whose inputs the reading before has set."""


class Compiled:
    """Stands in for `unrolled._compile` and `unrolled.source`; `seconds` of CPU that they took last."""

    def __init__(self) -> None:
        self.seconds = self.writing = 0.0
        self._compile, self._source = unrolled._compile, unrolled.source
        unrolled._compile, unrolled.source = self.compile, self.source

    def compile(self, text: str, path: Path) -> None:
        before = os.times()
        self._compile(text, path)
        after = os.times()
        self.seconds = after.children_user + after.children_system - before.children_user - before.children_system

    def source(self, *given) -> str:
        began = time.thread_time()
        text = self._source(*given)
        self.writing = time.thread_time() - began
        return text


def flown(folder: Path, pairs: int, *, written_out: bool) -> float:
    """Return the seconds of a step."""
    unrolled.LONG, unrolled.SAVED, unrolled.MOST = 0 if written_out else sys.maxsize, 1.0, sys.maxsize
    flight = kernel_step.Flight(folder, STEPS // pairs, pairs)
    seconds = flight.take(kernel_step.kernel)
    flight.end()
    return seconds


def main(folder: Path) -> None:
    os.environ["ADCS_BUILD"] = str(folder / "build")  # nothing is compiled yet
    for component in (Plant(), Controller()):
        build(component, folder / f"{component.name}.fmu")
    made = Compiled()
    rows = [("FMUs", "a call saves", "source, a call", "compiler", "compiler, a call")]
    for pairs in PAIRS:
        calls = CALLS * pairs
        contestants = {
            "lists": lambda pairs=pairs: flown(folder, pairs, written_out=False),
            "written out": lambda pairs=pairs: flown(folder, pairs, written_out=True),
        }
        contestants["written out"]()
        compiler = made.seconds
        times = bench.rounds(contestants, ROUNDS)
        saved = (min(times["lists"]) - min(times["written out"])) / calls
        each = f"{made.writing / calls * 1e6:.1f} us", f"{compiler:.2f} s", f"{compiler / calls * 1e3:.2f} ms"
        rows.append((str(2 * pairs), f"{saved * 1e9:.2f} ns", *each))
    bench.table(rows)


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as place:
        main(Path(place))
