"""A step of the python back end against one of the native back end, both in fmpy.

FlexibleSpacecraft with 8 modes (23 states), 1 ms, one internal step. Budget: at most 25 us where the native one costs
9 us, a ratio of 2.8. A step of a host is three calls, by fmpy's functions with lists: set all inputs, fmi2DoStep, get
all outputs. Both back ends must end in the same bits. For information: fmi2DoStep alone.
"""

import tempfile
from pathlib import Path

import bench
import fmpy
from fmpy.fmi2 import FMU2Slave
from fmpy.model_description import read_model_description

from components.plants.flexible_spacecraft import FlexibleSpacecraft
from fmus.export.build import BACKENDS, build

STEPS, ROUNDS, H = 2_000, 15, 1e-3
BUDGET = 25 / 9


class Host:
    """One instance in fmpy, after initialization."""

    def __init__(self, path: Path):
        description = read_model_description(str(path))
        variables = description.modelVariables
        self.inputs = [v.valueReference for v in variables if v.causality == "input"]
        self.outputs = [v.valueReference for v in variables if v.causality == "output"]
        self.slave = FMU2Slave(
            guid=description.guid,
            modelIdentifier=description.coSimulation.modelIdentifier,
            unzipDirectory=fmpy.extract(str(path), str(path.with_suffix(""))),
            instanceName=path.stem,
        )
        self.slave.instantiate()
        self.slave.setupExperiment(startTime=0.0)
        self.slave.enterInitializationMode()
        self.slave.exitInitializationMode()
        self.values = self.slave.getReal(self.inputs)
        self.done = 0

    def step(self) -> None:
        for k in range(self.done, self.done + STEPS):
            self.slave.doStep(k * H, H)
        self.done += STEPS

    def exchange(self) -> None:
        for k in range(self.done, self.done + STEPS):
            self.slave.setReal(self.inputs, self.values)
            self.slave.doStep(k * H, H)
            self.slave.getReal(self.outputs)
        self.done += STEPS

    def end(self) -> list[float]:
        values = self.slave.getReal(self.outputs)
        self.slave.terminate()
        self.slave.freeInstance()
        return values


def main(folder: Path) -> None:
    component = FlexibleSpacecraft(modes=8)
    hosts = {b: Host(build(component, folder / b / "FlexibleSpacecraft.fmu", b)) for b in BACKENDS}
    native, python = hosts["native"], hosts["python"]
    contestants = {
        "native fmi2DoStep": native.step,
        "python fmi2DoStep": python.step,
        "native set + step + get": native.exchange,
        "python set + step + get": python.exchange,
    }
    times = bench.rounds({name: bench.clocked(call, STEPS) for name, call in contestants.items()}, ROUNDS)
    assert native.end() == python.end()
    sizes = f"{len(native.inputs)} inputs, {len(native.outputs)} outputs"
    budgets = dict.fromkeys(("python fmi2DoStep", "python set + step + get"), BUDGET)
    bench.compare(f"python step in fmpy, {sizes}", times, "native set + step + get", budgets)


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as place:
        main(Path(place))
