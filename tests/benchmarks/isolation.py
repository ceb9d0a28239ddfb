"""What an FMU in a process of its own costs a step: the same flights in the Python loop, with it and without it.

python tests/benchmarks/isolation.py [STEPS [ROUNDS]]

The FMU has one input, one output and a step that costs nothing, so that the difference is the isolation alone. Rounds
are interleaved and the median counts: the machine has other things to do. A second process takes a core of its own
while it looks for the next step.
"""

import statistics
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

from cosim import Connection, Experiment, System, prepare
from cosim.masters.explicit import Explicit
from tests.cosim import c_fmu
from tests.cosim.c_fmu import real


def main(steps: int = 20_000, rounds: int = 7) -> None:
    """Print the median costs per communication step, us."""
    with tempfile.TemporaryDirectory() as folder:
        path = c_fmu.build(
            Path(folder), "I", [real("u", "input"), real("y")], outputs="y = m->state[0];", step="m->state[0] += h * u;"
        )
        system = System(
            name="s",
            components={"a": str(path), "b": str(path)},
            connections=[Connection("a.y", "b.u")],
            held={"a.u": 1.0},
        )
        experiment = Experiment(
            stop_time=steps * 1e-3, communication_step_size=1e-3, every=steps, master=Explicit(kernel="never")
        )
        kinds = {"none": (), "one of two": ("b",), "both": ("a", "b")}
        flights = {kind: prepare(replace(system, isolated=names)) for kind, names in kinds.items()}
        costs: dict[str, list[float]] = {kind: [] for kind in kinds}
        for _ in range(rounds):
            for kind, prepared in flights.items():
                begun = time.perf_counter()
                prepared.fly(experiment)
                costs[kind].append((time.perf_counter() - begun) / steps * 1e6)
        here = statistics.median(costs["none"])
        for kind, names in kinds.items():
            median = statistics.median(costs[kind])
            more = f", {(median - here) / len(names):.1f} us more for each isolated FMU" if names else ""
            print(f"isolated {kind}: {median:.1f} us a step{more} (least {min(costs[kind]):.1f})")
        for prepared in flights.values():
            prepared.close()


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
