"""A loop in ecos: ecos_loop.py LOOP.json record; record 1: its CSV writer, every variable at every step."""

import tempfile
from pathlib import Path

from ecospy import EcosSimulation, EcosSimulationStructure
from loop import Clock, Loop, report

loop, record = Loop.told()
with EcosSimulationStructure() as structure, tempfile.TemporaryDirectory() as place:
    for name, path in loop.fmus.items():
        structure.add_model(name, path)
    for (source, output), (target, variable) in loop.wires:
        structure.make_real_connection(f"{source}::{output}", f"{target}::{variable}")
    with EcosSimulation(structure=structure, step_size=loop.step) as simulation:
        if record:
            simulation.add_csv_writer(str(Path(place) / "rows.csv"))
        simulation.init()
        clock, rows = Clock(), []
        for _ in range(loop.samples):
            for part in loop.parts:
                with clock.running():
                    simulation.step(part)
            rows.append([simulation.get_real(f"{instance}::{variable}") for instance, variable in loop.shown])
        simulation.terminate()
report(loop, clock.seconds, rows)
