"""A loop by this project: ours_loop.py LOOP.json record kernel|python plain|jacobi [loop]; record 1: rows in a file.

plain: as the others do it, every output one step old; jacobi: outputs with feedthrough answer the inputs of their time.
loop: only the loop that flies, with its rows in the stream on the disk, but not the set-up and the parquet at the end.
"""

import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

from loop import Loop, report

from cosim import Connection, Experiment, Explicit, Result, System, flight, prepare
from cosim.flights import Prepared

loop, record = Loop.told()
kernel, preset = {"kernel": "always", "python": "never"}[sys.argv[3]], sys.argv[4]
in_loop = sys.argv[5:] == ["loop"]
system = System(
    name=loop.name,
    components={name: Path(path) for name, path in loop.fmus.items()},
    connections=[Connection(f"{s}.{o}", f"{t}.{v}", "at_point") for (s, o), (t, v) in loop.wires],
    hold_unconnected=True,
)
ports = dict.fromkeys([source for source, _ in loop.wires] + loop.shown)
experiment = Experiment(
    stop_time=loop.steps * loop.step,
    communication_step_size=loop.step,
    every=1 if record else loop.chunk,
    record=tuple(f"{instance}.{variable}" for instance, variable in ports),
    master=Explicit(preset, kernel=kernel),
)


FLIGHTS = 3  # of each length; the least time counts


class CpuClock:
    """In place of the module `time` in flight.py."""

    perf_counter = staticmethod(time.process_time)


def fly(prepared: Prepared, steps: int, out: Path | None) -> tuple[float, Result]:
    """Return the CPU seconds of a flight, set-up and all, or of its loop; and what it gave."""
    flown = replace(experiment, stop_time=steps * loop.step, every=1 if record else min(steps, loop.chunk))
    began = time.process_time()
    result = prepared.fly(flown, out=out, overwrite=True)
    return result.info["wall_time"]["loop"] if in_loop else time.process_time() - began, result


flight.time = CpuClock


few = max(loop.steps // 10, 10)
with prepare(system) as prepared, tempfile.TemporaryDirectory() as place:
    out = Path(place) / "run" if record else None
    fly(prepared, loop.steps, out)  # what is loaded and compiled once
    short = min(fly(prepared, few, out)[0] for _ in range(FLIGHTS))
    flights = [fly(prepared, loop.steps, out) for _ in range(FLIGHTS)]
taken = (min(seconds for seconds, _ in flights) - short) * loop.steps / (loop.steps - few)
shown = [flights[-1][1][f"{i}.{v}"] for i, v in loop.shown]
every = loop.chunk if record else 1
report(loop, taken, [[column[k * every] for column in shown] for k in range(1, loop.samples + 1)])
