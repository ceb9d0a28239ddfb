"""A loop in OMSimulator 2, weakly coupled, fixed step: omsimulator_loop.py LOOP.json record; record 1: its CSV file."""

import tempfile
from pathlib import Path

from loop import Clock, Loop, report
from OMSimulator import OMSimulator

MODEL, ROOT = "loop", "loop.root"

loop, record = Loop.told()
oms = OMSimulator()


def call(name: str, *told: object) -> None:
    status = getattr(oms, name)(*told)
    if status > oms.status_warning:
        raise RuntimeError(f"OMSimulator: {name} returns {status}")


def read(cref: str) -> float:
    value, status = oms.getReal(cref)
    if status > oms.status_warning:
        raise RuntimeError(f"OMSimulator: getReal {cref} returns {status}")
    return value


with tempfile.TemporaryDirectory() as place:
    call("setTempDirectory", place)
    call("newModel", MODEL)
    call("addSystem", ROOT, oms.system_wc)
    for name, path in loop.fmus.items():
        call("addSubModel", f"{ROOT}.{name}", path)
    for (source, output), (target, variable) in loop.wires:
        call("addConnection", f"{ROOT}.{source}.{output}", f"{ROOT}.{target}.{variable}")
    call("setFixedStepSize", ROOT, loop.step)
    call("setStopTime", MODEL, loop.steps * loop.step)
    call("setResultFile", MODEL, str(Path(place) / "rows.csv") if record else "")
    call("instantiate", MODEL)
    call("initialize", MODEL)
    clock, rows, k = Clock(), [], 0
    for _ in range(loop.samples):
        for part in loop.parts:
            k += part
            with clock.running():
                call("stepUntil", MODEL, k * loop.step)
        rows.append([read(f"{ROOT}.{instance}.{variable}") for instance, variable in loop.shown])
    call("terminate", MODEL)
report(loop, clock.seconds, rows)
