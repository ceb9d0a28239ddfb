"""A loop by this project: ours_loop.py LOOP.json record kernel|python; record 1: what is shown or wired, in a file."""

import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

from loop import Loop, report

from cosim import Connection, Experiment, Explicit, Result, System, prepare
from cosim.flights import Prepared

loop, record = Loop.told()
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
    every=1 if record else loop.steps,
    record=tuple(f"{instance}.{variable}" for instance, variable in ports),
    master=Explicit("jacobi", kernel={"kernel": "always", "python": "never"}[sys.argv[3]]),
)


def fly(prepared: Prepared, steps: int, out: Path | None) -> tuple[float, Result]:
    """Return the CPU seconds of a flight, set-up and all, and what it gave."""
    flight = replace(experiment, stop_time=steps * loop.step, every=1 if record else steps)
    began = time.process_time()
    result = prepared.fly(flight, out=out)
    return time.process_time() - began, result


few = max(loop.steps // 10, 10)
with prepare(system) as prepared, tempfile.TemporaryDirectory() as place:
    outs = [Path(place) / name if record else None for name in ("first", "short", "long")]
    fly(prepared, few, outs[0])  # what is loaded once
    short, _ = fly(prepared, few, outs[1])
    long, result = fly(prepared, loop.steps, outs[2])
taken = (long - short) * loop.steps / (loop.steps - few)
report([taken], loop, [result[f"{i}.{v}"][-1] for i, v in loop.shown])
