"""Exported packages in other masters: ecos and libcosim fly the file as it is, and agree with a loop of a few lines.

The loop reads the package by itself and does what those masters do: outputs go to inputs at communication points, then
every FMU takes a step. Equal are the same sums of the same doubles; what may differ is the order in which FMUs are
initialized, and how each tool makes its times (t + h, or counted), some roundings a step of h w = 1e-3 1e-2 rad.
"""

import os
import subprocess
import sys
import zipfile
from importlib.util import find_spec
from xml.etree import ElementTree

import fmpy
import numpy as np
import pytest
from fmpy.fmi2 import FMU2Slave
from numpy.testing import assert_allclose

from cosim import Explicit, Library, load
from cosim.cli.packing import export

SSD = "{http://ssp-standard.org/SSP1/SystemStructureDescription}"
SSV = "{http://ssp-standard.org/SSP1/SystemStructureParameterValues}"
STEPS = {"zhang2018-ppatc": 1000, "xiao2011-pid": 200, "geng2012-compensated": 200}
NAMES = [f"plant.q_BN[{i}]" for i in range(1, 5)] + [f"plant.omega_BN_B[{i}]" for i in range(1, 4)]

pytestmark = pytest.mark.peers


@pytest.fixture(scope="module", params=STEPS)
def flight(request, tmp_path_factory):
    """A package, its folder unpacked, its step in s, how many of them."""
    tmp_path = tmp_path_factory.mktemp("flight")
    system, experiment = load(request.param)
    path = tmp_path / f"{request.param}.ssp"
    export(path, system, experiment, Library())
    with zipfile.ZipFile(path) as archive:
        archive.extractall(tmp_path / "unpacked")
    return path, tmp_path / "unpacked", float(experiment.communication_step_size), STEPS[request.param]


def flown_by_hand(folder, step, steps, *, refreshed):
    """The last values of NAMES, by fmpy's calls; `refreshed`: read after the inputs are set once more."""
    root = ElementTree.parse(folder / "SystemStructure.ssd").getroot()
    slaves, references = {}, {}
    for component in root.iter(f"{SSD}Component"):
        name, fmu = component.get("name"), folder / component.get("source")
        description = fmpy.read_model_description(fmu)
        references[name] = {v.name: v.valueReference for v in description.modelVariables}
        slave = FMU2Slave(
            guid=description.guid,
            unzipDirectory=fmpy.extract(fmu),
            modelIdentifier=description.coSimulation.modelIdentifier,
            instanceName=name,
        )
        slave.instantiate()
        slave.setupExperiment(startTime=0.0)
        binding = component.find(f"{SSD}ParameterBindings/{SSD}ParameterBinding")
        if binding is not None:
            for p in ElementTree.parse(folder / binding.get("source")).iter(f"{SSV}Parameter"):
                reference, value = references[name][p.get("name")], p[0]
                if value.tag == f"{SSV}Real":
                    slave.setReal([reference], [float(value.get("value"))])
                elif value.tag == f"{SSV}Integer":
                    slave.setInteger([reference], [int(value.get("value"))])
                else:
                    slave.setBoolean([reference], [value.get("value") == "true"])
        slaves[name] = slave
    links = [
        [c.get(k) for k in ("startElement", "startConnector", "endElement", "endConnector")]
        for c in root.iter(f"{SSD}Connection")
    ]

    def exchange():
        values = [slaves[a].getReal([references[a][y]])[0] for a, y, _, _ in links]
        for (_, _, b, u), value in zip(links, values, strict=True):
            slaves[b].setReal([references[b][u]], [value])

    for slave in slaves.values():
        slave.enterInitializationMode()
    for _ in slaves:  # as often as anything can depend on anything
        exchange()
    for slave in slaves.values():
        slave.exitInitializationMode()
    for k in range(steps):
        exchange()
        for slave in slaves.values():
            slave.doStep(k * step, step)
    if refreshed:
        exchange()
    found = [slaves[n.partition(".")[0]].getReal([references["plant"][n.partition(".")[2]]])[0] for n in NAMES]
    for slave in slaves.values():
        slave.terminate()
        slave.freeInstance()
    return np.array(found)


ECOS = """
from ecospy import EcosSimulation
sim = EcosSimulation(step_size={step}, ssp_path={path!r})
sim.init(parameter_set="initialValues")
sim.step({steps})
print(*[repr(sim.get_real(name.replace(".", "::", 1))) for name in {names}])
"""

LIBCOSIM = """
from libcosimpy.CosimExecution import CosimExecution
from libcosimpy.CosimObserver import CosimObserver
execution = CosimExecution.from_ssp_file(ssp_path={path!r}, step_size=round({step} * 1e9))
observer = CosimObserver.create_last_value()
execution.add_observer(observer)
assert execution.step({steps})
slave = execution.slave_index_from_instance_name("plant")
references = {{v.name.decode(): v.reference for v in execution.slave_variables(slave_index=slave)}}
names = [name.partition(".")[2] for name in {names}]
print()
print(*[repr(observer.last_real_values(slave, [references[name]])[0]) for name in names], flush=True)
import os; os._exit(0)
"""


def flown_elsewhere(script, **where):
    """The last values that a script prints; in a process of its own, for some tools end it."""
    code = script.format(names=NAMES, **where)
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=os.environ)
    assert done.returncode == 0, done.stdout + done.stderr
    return np.array([float(text) for text in done.stdout.splitlines()[-1].split()])


def importable(module):
    """Whether a tool can be loaded, libraries of the system's too."""
    if find_spec(module) is None:
        return False
    return subprocess.run([sys.executable, "-c", f"import {module}.lib"], capture_output=True).returncode == 0


def test_ecos(flight):
    if not importable("ecospy"):
        pytest.skip("ecospy, or libtbb12 that it needs, is not installed")
    path, folder, step, steps = flight
    found = flown_elsewhere(ECOS, path=str(path), step=step, steps=steps)
    assert_allclose(found, flown_by_hand(folder, step, steps, refreshed=True), rtol=0, atol=1e-11)


def test_libcosim(flight):
    pytest.importorskip("libcosimpy")
    path, folder, step, steps = flight
    found = flown_elsewhere(LIBCOSIM, path=str(path), step=step, steps=steps)
    assert_allclose(found, flown_by_hand(folder, step, steps, refreshed=False), rtol=0, atol=1e-11)


def test_jacobi_here_is_near_that(flight):
    """`adcs run FILE.ssp --master jacobi` refreshes what follows inputs at once, so that it is not the same."""
    from dataclasses import replace

    from cosim import simulate

    path, folder, step, steps = flight
    system, experiment = load(path)
    result = simulate(system, replace(experiment, stop_time=steps * step, master=Explicit("jacobi")))
    here = np.concatenate([result["plant.q_BN"][-1], result["plant.omega_BN_B"][-1]])
    assert_allclose(here, flown_by_hand(folder, step, steps, refreshed=True), atol=1e-4)
