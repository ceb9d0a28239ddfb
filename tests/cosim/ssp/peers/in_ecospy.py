"""A flight in ecos: in_ecospy.py FLIGHT.json; prints its end, of the package and of its FMUs alone."""

import json
import sys
from pathlib import Path

from ecospy import EcosSimulation, EcosSimulationStructure

flight = json.loads(Path(sys.argv[1]).read_text())


def flown(simulation, **told):
    simulation.init(**told)
    simulation.step(flight["steps"])
    print(json.dumps([simulation.get_real(f"{instance}::{variable}") for instance, variable in flight["names"]]))


flown(EcosSimulation(step_size=flight["step"], ssp_path=flight["ssp"]), parameter_set="initialValues")
structure = EcosSimulationStructure()
for name, path in flight["fmus"].items():
    structure.add_model(name, path)
for a, y, b, u in flight["links"]:
    structure.make_real_connection(f"{a}::{y}", f"{b}::{u}")
flown(EcosSimulation(structure=structure, step_size=flight["step"]))
