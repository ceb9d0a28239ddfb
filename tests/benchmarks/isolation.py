"""What an FMU in a process of its own costs a step: set an input, step, get an output, in this process and in its own.

python tests/benchmarks/isolation.py [STEPS [ROUNDS]]

The FMU's step costs nothing, so that the difference is the isolation alone. Rounds are interleaved and the median step
counts. It takes two cores that are free: one looks for the answer while the other steps. Where cores are busy both
sides sleep and are woken, which costs what the scheduler takes.
"""

import statistics
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2]))

from cosim.slaves.opening import open_fmu, open_isolated
from tests.cosim import c_fmu
from tests.cosim.c_fmu import real


def main(steps: int = 2_000, rounds: int = 7) -> None:
    """Print the median costs per step, us."""
    with tempfile.TemporaryDirectory() as folder:
        path = c_fmu.build(
            Path(folder), "I", [real("u", "input"), real("y")], outputs="y = m->state[0];", step="m->state[0] += h * u;"
        )
        kinds = {"in this process": open_fmu, "in its own process": open_isolated}
        slaves = {kind: make("a", path) for kind, make in kinds.items()}
        costs: dict[str, list[float]] = {kind: [] for kind in kinds}
        for slave in slaves.values():
            slave.instantiate()
            slave.setup_experiment(0.0)
            slave.enter_initialization_mode()
            slave.exit_initialization_mode()
        u = np.array([1.0])
        for i in range(rounds):
            for kind, slave in slaves.items():
                for k in range(i * steps, (i + 1) * steps):
                    begun = time.perf_counter()
                    slave.set_real((0,), u)
                    slave.do_step(k * 1e-3, 1e-3)
                    slave.get_real((1,))
                    costs[kind].append((time.perf_counter() - begun) * 1e6)
        medians = {kind: statistics.median(found) for kind, found in costs.items()}
        for kind, found in costs.items():
            tenth = statistics.quantiles(found, n=10)
            print(f"{kind}: {medians[kind]:.1f} us a step (one in ten below {tenth[0]:.1f}, above {tenth[-1]:.1f})")
        here, there = medians.values()
        print(f"the isolation costs {there - here:.1f} us a step")
        for slave in slaves.values():
            slave.free()


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
