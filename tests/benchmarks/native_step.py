"""fmi2DoStep of native FMUs called from C against the same CasADi function `advance` in a C loop, same flags.

FlexibleSpacecraft with 8 modes (23 states) and PrescribedPerformance, 1 ms, one internal step, from rest at the start
inputs; both must end in the same bits. Budget: 1.2. For information: a step with all inputs set before and all outputs
read after it.
"""

import ctypes
import tempfile
from pathlib import Path

import bench
import casadi as ca
import numpy as np

from components.controllers.prescribed_performance import PrescribedPerformance
from components.framework import Component
from components.framework.component import start_vector
from components.plants.flexible_spacecraft import FlexibleSpacecraft
from cosim.slaves.fmi2 import FmuSlave
from fmus.description.annotations import SOLVER_STEP
from fmus.export.build import build
from fmus.export.native.native_fmu import describe_native, native_sources
from fmus.export.regions import regions_of
from fmus.toolchain import compile_library

STEPS, ROUNDS, H = 20_000, 15, 1e-3
POINTER, LONG, DOUBLE, SIZE = ctypes.c_void_p, ctypes.c_long, ctypes.c_double, ctypes.c_size_t


class Fmu(ctypes.Structure):
    _fields_ = [(name, ctypes.c_void_p) for name in ("instance", "set", "get", "step")]


def measure(component: Component, folder: Path) -> None:
    name = component.name
    generator = ca.CodeGenerator("whole.c", {"with_header": True, "casadi_int": "int"})
    generator.add(component.functions.advance)
    generator.generate(f"{folder}/")
    sizes = [line for line in (folder / "whole.h").read_text().splitlines() if line.startswith("#define advance_SZ")]
    (folder / "whole.c").write_text("\n".join([(folder / "whole.c").read_text(), *sizes, ""]))
    for file, data in native_sources(component, describe_native(component, name)).items():
        (folder / file).write_bytes(data)
    here = Path(__file__).with_suffix(".c")
    (folder / here.name).write_bytes(here.read_bytes())
    compile_library(folder, here.name, folder / f"{name}.so")
    loops = ctypes.CDLL(str(folder / f"{name}.so"))
    loops.direct.argtypes = [LONG, LONG, DOUBLE, LONG, *[POINTER] * 5]
    loops.step.argtypes = [POINTER, LONG, LONG, DOUBLE]
    loops.exchange.argtypes = [*loops.step.argtypes, SIZE, POINTER, POINTER, SIZE, POINTER, POINTER]

    slave = FmuSlave(name, build(component, folder / f"{name}.fmu"))
    variables = slave.description.variables.values()
    references = {
        cause: np.array([v.value_reference for v in variables if v.causality == cause], np.uint32)
        for cause in ("input", "output")
    }
    solver_step = (slave.description.variables[SOLVER_STEP].value_reference,)
    regions = regions_of(component, derivatives=True)
    states = range(regions.offset["x"], regions.offset["x"] + regions.size["x"])
    u, p = start_vector(component.inputs), start_vector(component.parameters)
    x, zero, y = np.zeros(len(states)), 0 * u, np.zeros(len(references["output"]))
    c = component.functions.calculate(p).full().ravel()

    def begin() -> None:
        """Put both at their start."""
        slave.free()
        slave.instantiate()
        slave.setup_experiment(0.0)
        slave.set_real(solver_step, np.array([H]))
        slave.enter_initialization_mode()
        slave.exit_initialization_mode()
        x[:] = slave.get_real(tuple(states))

    def direct() -> None:
        loops.direct(0, STEPS, H, len(x), *(a.ctypes.data for a in (x, u, zero, p, c)))

    def fmu() -> object:
        c = slave.c_interface()
        assert c is not None
        return ctypes.byref(
            Fmu(c.component, *(c.functions[f"fmi2{name}"] for name in ("SetReal", "GetReal", "DoStep")))
        )

    def exchange() -> None:
        inputs, outputs = references["input"], references["output"]
        arrays = (len(u), inputs.ctypes.data, u.ctypes.data, len(y), outputs.ctypes.data, y.ctypes.data)
        assert loops.exchange(fmu(), 0, STEPS, H, *arrays) == 0

    def fresh(call) -> bench.Callable[[], float]:
        def run() -> float:
            begin()
            seconds = bench.clocked(call, STEPS)()
            if call is direct:
                ends["direct"] = x.copy()
            else:
                ends[call.__name__] = slave.get_real(tuple(states))
            return seconds

        return run

    def step() -> None:
        assert loops.step(fmu(), 0, STEPS, H) == 0

    ends: dict[str, np.ndarray] = {}
    contestants = {"advance in a C loop": direct, "fmi2DoStep": step, "set + fmi2DoStep + get": exchange}
    times = bench.rounds({what: fresh(call) for what, call in contestants.items()}, ROUNDS)
    assert all(np.array_equal(end, ends["direct"]) for end in ends.values()), ends
    sizes = f"{len(x)} states, {len(u)} inputs, {len(y)} outputs"
    bench.compare(f"native step: {name}, {sizes}", times, "advance in a C loop", {"fmi2DoStep": 1.2})
    slave.free()


if __name__ == "__main__":
    for made in (FlexibleSpacecraft(modes=8), PrescribedPerformance()):
        with tempfile.TemporaryDirectory() as place:
            measure(made, Path(place))
