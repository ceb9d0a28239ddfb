"""A loop in cofmupy, Jacobi: cofmupy_loop.py LOOP.json record; record 1: its CSV storage."""

import json
import tempfile
from pathlib import Path

from cofmupy import Coordinator
from loop import Clock, Loop, report

loop, record = Loop.told()


def end_of(instance: str, variable: str) -> dict[str, str]:
    return {"type": "fmu", "id": instance, "variable": variable, "unit": ""}


with tempfile.TemporaryDirectory() as place:
    system = {
        "fmus": [{"id": n, "path": p, "name": n, "initialization": {}} for n, p in loop.fmus.items()],
        "connections": [{"source": end_of(*source), "target": end_of(*target)} for source, target in loop.wires],
        "root": place,
        "cosim_method": "jacobi",
        "edge_sep": " -> ",
        "iterative": False,
    }
    if record:
        system["data_storages"] = [{"name": "rows", "type": "file", "config": {"path": f"{place}/rows.csv"}}]
    described = Path(place) / "system.json"
    described.write_text(json.dumps(system))
    coordinator = Coordinator()
    coordinator.start(str(described))
    clock, rows = Clock(), []
    for _ in range(loop.samples):
        for part in loop.parts:
            with clock.running():
                for _ in range(part):
                    coordinator.do_step(loop.step, save_data=bool(record))
        rows.append([float(coordinator.get_variable(shown)[0]) for shown in loop.shown])
report(loop, clock.seconds, rows)
