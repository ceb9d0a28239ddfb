"""A flight in cofmupy: in_cofmupy.py FLIGHT.json; prints what is asked for at its end. It reads no packages.

It sets every input that is not named in `initialization` to 0, before initialization ends and for the first step. Where
FMUs are in no loop it passes their outputs on at once: all are told to be one.
"""

import contextlib
import json
import sys
from pathlib import Path

from cofmupy import Coordinator

flight = json.loads(Path(sys.argv[1]).read_text())


def end_of(instance, variable):
    return {"type": "fmu", "id": instance, "variable": variable, "unit": ""}


described = Path(sys.argv[1]).with_name("cofmupy.json")
system = {
    "fmus": [{"id": n, "path": p, "name": n, "initialization": flight["inputs"][n]} for n, p in flight["fmus"].items()],
    "connections": [{"source": end_of(a, y), "target": end_of(b, u)} for a, y, b, u in flight["links"]],
    "root": str(described.parent),
    "cosim_method": "jacobi",
    "edge_sep": " -> ",
    "iterative": False,
}
described.write_text(json.dumps(system))
coordinator = Coordinator()
with contextlib.redirect_stdout(sys.stderr):
    coordinator.start(str(described))
    coordinator.master.sequence_order = [list(flight["fmus"])]
    for _ in range(flight["steps"]):
        coordinator.do_step(flight["step"])
print(json.dumps([float(coordinator.get_variable(tuple(name))[0]) for name in flight["names"]]))
