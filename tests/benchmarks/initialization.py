"""What fmi2ExitInitializationMode costs, where the eigenvalues at the start are judged: ms, best of several.

    python -m tests.benchmarks.initialization [STATES ...]

A flexible spacecraft of 23 states, then chains of the given numbers of states (default 100).
"""

import sys
import tempfile
import time
from pathlib import Path

from components.framework import Component
from components.plants.flexible_spacecraft import FlexibleSpacecraft
from cosim.slaves.fmi2 import FmuSlave
from fmus.export.build import BACKENDS, build
from tests.fmus.export.linear import Chain


def measured(component: Component, backend: str, folder: Path, times: int = 20) -> float:
    """Return the shortest of some calls, ms."""
    slave = FmuSlave("unit", build(component, folder / f"{component.name}{backend}.fmu", backend))
    best = float("inf")
    for _ in range(times):
        slave.reset()
        slave.instantiate()
        slave.setup_experiment(0.0)
        slave.enter_initialization_mode()
        begun = time.perf_counter()
        slave.exit_initialization_mode()
        best = min(best, time.perf_counter() - begun)
    return 1e3 * best


def main() -> None:
    """Print a line a component and back end."""
    chains = [Chain(n=int(n)) for n in sys.argv[1:] or ["100"]]
    for component in (FlexibleSpacecraft(modes=8), *chains):
        with tempfile.TemporaryDirectory() as folder:
            for backend in BACKENDS:
                states = component.size(component.states)
                print(
                    f"{component.name}, {states} states, {backend}: {measured(component, backend, Path(folder)):.3f} ms"
                )


if __name__ == "__main__":
    main()
