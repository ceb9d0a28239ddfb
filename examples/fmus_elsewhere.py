"""FMUs for another tool: built with parameters of one's own, looked into, flown by a loop on fmpy alone."""

from pathlib import Path
from zipfile import ZipFile

import numpy as np
from fmpy import extract, read_model_description
from fmpy.fmi2 import FMU2Slave
from fmpy.validation import validate_fmu

from components.controllers.pid import PID
from components.plants.flexible_spacecraft import FlexibleSpacecraft
from fmus import build

STEP, STOP = 0.01, 60.0  # s

# ---- build: structure and start values are those of the call ---------------------------------------------------

plant = FlexibleSpacecraft(modes=1, J=[[420, 3, -2], [3, 310, 4], [-2, 4, 360]], q_BN=[np.cos(0.1), np.sin(0.1), 0, 0])
controller = PID(K_p=[16, 12, 14], K_i=[0, 0, 0], K_d=[160, 120, 140])
files = {"plant": build(plant, Path("fmus/plant.fmu")), "controller": build(controller, Path("fmus/controller.fmu"))}

# ---- look into them --------------------------------------------------------------------------------------------

for name, path in files.items():
    description = read_model_description(path)
    inputs = [v.name for v in description.modelVariables if v.causality == "input"]
    print(f"{name}: {description.modelName} {description.version}, {path.stat().st_size / 1e3:.0f} kB, inputs {inputs}")
    print("  problems:", validate_fmu(str(path)) or "none")
    with ZipFile(path) as fmu:
        print("  documentation:", [file for file in fmu.namelist() if file.startswith("documentation/")])
        path.with_suffix(".html").write_bytes(fmu.read("documentation/index.html"))

# ---- fly them: a loop as any tool has it -----------------------------------------------------------------------


def load(name):
    """Return an instance in initialization mode, and the value references of its variables by name."""
    description, folder = read_model_description(files[name]), extract(files[name])
    references = {v.name: v.valueReference for v in description.modelVariables}
    identifier = description.coSimulation.modelIdentifier
    fmu = FMU2Slave(guid=description.guid, unzipDirectory=folder, modelIdentifier=identifier, instanceName=name)
    fmu.instantiate()
    fmu.setupExperiment(startTime=0.0)
    fmu.enterInitializationMode()
    return fmu, references


def vector(references, name, size):
    """Return the value references of an array."""
    return [references[f"{name}[{i}]"] for i in range(1, size + 1)]


(p, of_p), (c, of_c) = load("plant"), load("controller")
c.setReal(vector(of_c, "q_RN", 4), [1, 0, 0, 0])
wires = [(vector(of_p, name, n), vector(of_c, name, n)) for name, n in (("q_BN", 4), ("omega_BN_B", 3))]
command, torque = vector(of_c, "tau_command_B", 3), vector(of_p, "tau_B", 3)
attitude_error = vector(of_c, "attitude_error", 3)


def measure():
    """Give the controller the plant's attitude and rate."""
    for source, target in wires:
        c.setReal(target, p.getReal(source))


measure()
p.setReal(torque, c.getReal(command))
for fmu in (p, c):
    fmu.exitInitializationMode()
for k in range(round(STOP / STEP)):
    p.doStep(k * STEP, STEP)
    measure()
    c.doStep(k * STEP, STEP)  # after the plant, so that its command answers the attitude at the step's end
    p.setReal(torque, c.getReal(command))

error = np.degrees(np.linalg.norm(c.getReal(attitude_error)))
print(f"attitude error: {np.degrees(0.2):.2f} deg at 0 s, {error:.2g} deg at {STOP:g} s")
for fmu in (p, c):
    fmu.terminate()
    fmu.freeInstance()
