"""A co-simulation loop of a few lines on fmpy alone, without any of this project: what most tools do with a package.

Outputs go to inputs at communication points, then every FMU takes a step. The wires are those of the package; its
parameter sets are left alone, for the FMUs have the values as their start values.
"""

import zipfile
from xml.etree import ElementTree

import fmpy
import numpy as np
from fmpy.fmi2 import FMU2Slave

SSD = "{http://ssp-standard.org/SSP1/SystemStructureDescription}"


class Unit:
    """An FMU of the package, instantiated, and its variables."""

    def __init__(self, name, file, folder):
        self.name, self.description = name, fmpy.read_model_description(str(file))
        self.references = {v.name: v.valueReference for v in self.description.modelVariables}
        self.outputs = [v.name for v in self.description.modelVariables if v.causality == "output"]
        self.numbers = [self.references[output] for output in self.outputs]
        self.wires = []  # reference of an input, unit and position of its source
        self.slave = FMU2Slave(
            guid=self.description.guid,
            unzipDirectory=fmpy.extract(str(file), str(folder / name)),
            modelIdentifier=self.description.coSimulation.modelIdentifier,
            instanceName=name,
        )
        self.slave.instantiate()
        self.slave.setupExperiment(startTime=0.0)

    def of_states(self):
        """Names of the outputs that follow no input directly, by ModelStructure."""
        inputs = {v.name for v in self.description.modelVariables if v.causality == "input"}
        told = {unknown.variable.name: unknown.dependencies for unknown in self.description.outputs}
        return [o for o in self.outputs if told[o] is not None and not inputs & {v.name for v in told[o]}]


class Package:
    """An exported package, unpacked, with its units wired."""

    def __init__(self, path, folder):
        with zipfile.ZipFile(path) as archive:
            archive.extractall(folder / "package")
        root = ElementTree.parse(folder / "package" / "SystemStructure.ssd").getroot()
        self.files = {c.get("name"): folder / "package" / c.get("source") for c in root.iter(f"{SSD}Component")}
        names = ("startElement", "startConnector", "endElement", "endConnector")
        self.links = [tuple(map(c.get, names)) for c in root.iter(f"{SSD}Connection")]
        self.folder = folder

    def fly(self, times, *, sweeps=None):
        """Return rows, one a time (s): instance -> (n, outputs), and the units.

        sweeps: how often outputs go to inputs in initialization mode; else as often as anything can depend on anything.
        """
        units = {name: Unit(name, file, self.folder) for name, file in self.files.items()}
        for a, y, b, u in self.links:
            units[b].wires.append((units[b].references[u], a, units[a].outputs.index(y)))
        for unit in units.values():
            unit.slave.enterInitializationMode()
        for _ in units if sweeps is None else range(sweeps):
            _exchange(units, {name: unit.slave.getReal(unit.numbers) for name, unit in units.items()})
        for unit in units.values():
            unit.slave.exitInitializationMode()
        rows = {name: np.empty((len(times), len(unit.outputs))) for name, unit in units.items()}
        for k, t in enumerate(times):
            now = {name: unit.slave.getReal(unit.numbers) for name, unit in units.items()}
            for name, values in now.items():
                rows[name][k] = values
            if k + 1 < len(times):
                _exchange(units, now)
                for unit in units.values():
                    unit.slave.doStep(t, times[k + 1] - t)
        for unit in units.values():
            unit.slave.terminate()
            unit.slave.freeInstance()
        return rows, units


def _exchange(units, now):
    """Set every input to what its source has."""
    for unit in units.values():
        if unit.wires:
            unit.slave.setReal([u for u, _, _ in unit.wires], [now[a][y] for _, a, y in unit.wires])
