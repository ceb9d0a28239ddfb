"""Signals, events and isolation in a package: here as they were declared, for others FMUs that follow the tables."""

import json
import re
import shutil
import zipfile
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import fmpy
import numpy as np
import pytest
from fmpy.fmi2 import FMU2Slave
from numpy.testing import assert_allclose

from cosim import At, Component, Connection, Experiment, Explicit, Library, Signal, System, Value, load, simulate
from cosim.cli.packing import export
from cosim.errors import WiringErrors
from cosim.ssp.errors import SspError
from cosim.ssp.write import write

from ..c_fmu import boolean, build, enumeration, integer, real
from .packages import ITEMS, edited, line, refused, same

TIME = [0.0, 0.3, 1.1, 2.0]
RAMP, STEPS = [0.5, -1.0, 2.0, 4.0], [0.0, 2.0, -1.0, 3.0]
FLIGHT = Experiment(stop_time=2.0, communication_step_size=0.1)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("fmus")


@pytest.fixture(scope="module")
def angle(folder):
    return line(folder, "Angle", "rad")


@pytest.fixture(scope="module")
def mixed(folder):
    """An FMU that takes Reals and inputs of the other types, and shows what it was given."""
    taken = [real("u", "input"), real("v", "input"), real("w", "input"), integer("n", "input", start=0)]
    taken += [boolean("on", "input", start=False), enumeration("mode", "input", start=1, items=ITEMS)]
    shown = [real("y"), real("n_out"), real("on_out"), real("mode_out")]
    step = "m->state[0] += h * (u + 10 * v + 100 * w);"
    outputs = "y = m->state[0]; n_out = n; on_out = on; mode_out = mode;"
    return build(folder, "Mixed", taken + shown, outputs=outputs, step=step)


def of_angle(angle, **more):
    """A signal in degrees feeds an angle, whose output feeds another one."""
    return System(
        name="s",
        components={"a": str(angle), "b": str(angle)},
        connections=[Connection("a.y", "b.u", "after_step")],
        **{"inputs": {"a.u": Signal((TIME, RAMP), unit="deg")}, **more},
    )


def of_mixed(mixed):
    both = {"time": TIME, "v": RAMP, "w": STEPS}
    inputs = {"m.u": Signal((TIME, STEPS), interpolation="previous")}
    inputs |= {f"m.{name}": Signal(both, name, interpolation="cubic") for name in "vw"}
    for name, values in {"n": [1, -7, 3, 2], "on": [0, 1, 0, 1], "mode": [1, 5, 2, 1]}.items():
        inputs[f"m.{name}"] = Signal((TIME, values), interpolation="previous")
    return System(name="mixed", components={"m": str(mixed)}, inputs=inputs)


@pytest.fixture
def exported(tmp_path):
    def call(system, experiment=FLIGHT, **more):
        path = tmp_path / f"{system.name}.ssp"
        call.notes = export(path, system, experiment, Library(), **more)
        return path

    return call


@pytest.mark.parametrize("ssp", ["1.0", "2.0"])
@pytest.mark.parametrize("kind", ["angle", "mixed"])
def test_what_was_declared_comes_back_and_flies_to_the_same_bits(kind, ssp, exported, angle, mixed):
    system = of_angle(angle) if kind == "angle" else of_mixed(mixed)
    path = exported(system, ssp=ssp)
    found, flown = load(path)
    assert same(system, found) and flown == FLIGHT
    rows = [simulate(s, e).table for s, e in ((system, FLIGHT), (found, flown))]
    assert rows[0].equals(rows[1], check_metadata=False) and rows[0].num_rows == 21
    told = simulate(found, flown).info["inputs"]
    file = told["a.u" if kind == "angle" else "m.u"]["file"]
    assert file == f"{path}#resources/{'a' if kind == 'angle' else 'm'}_signals-1.csv"
    again = exported(found, flown, ssp=ssp)
    assert same(system, load(again)[0])


def test_events_isolation_and_a_held_value_beneath_a_signal_come_back(exported, angle):
    parts = {"a": Component(angle, isolated=True), "b": Component(angle)}
    fmu = {"components": parts, "held": {"a.u": 0.25}, "parameters": {"b.k": 2.0}}
    system = replace(of_angle(angle), **fmu)
    path = exported(system, replace(FLIGHT, stop_time=1.0))
    found, _ = load(path)
    assert found.isolated == ("a",) and same(system, found)
    every = replace(system, isolated=["*"])
    assert load(exported(every))[0].isolated == ("*",)


def test_events_come_back_and_are_told(exported):
    system = System(name="s", components={"a": "LowPass"}, held={"a.u": [1.0]}, isolated=["a"])
    events = [At(0.5, {"a.bandwidth": Value([0.5], "Hz")}), At(Fraction(4, 3), {"*.bandwidth": [7.0]})]
    experiment = replace(FLIGHT, events=events)
    path = exported(system, experiment)
    assert "only adcs-cosim reads the events and processes of their own in it, in its own annotation" in exported.notes
    found, flown = load(path)
    assert flown == experiment and same(system, found)
    rows = [simulate(replace(s, isolated=()), e).table for s, e in ((system, experiment), (found, flown))]
    assert rows[0].equals(rows[1], check_metadata=False)


def test_events_and_isolation_of_an_instance_that_is_gone_are_passed_over(exported, angle):
    """As steps and parameters are: another tool has renamed it."""
    system = of_angle(angle, inputs={}, held={"a.u": 1.0}, isolated=["b", "a"])
    path = exported(system)
    experiment = '"communication_step_size": 0.1'
    two = [{"time": 1.0, "values": {"b.k": 3.0, "*.c": 1.0}}, {"time": 1, "values": {"b.k": 3}}]
    at = f'"events": {json.dumps([{"!At": one} for one in two])}'
    path = edited(path, experiment, f"{experiment}, {at}")
    assert len(load(path)[1].events) == 2
    path = edited(edited(path, 'name="b"', 'name="c"'), 'endElement="b"', 'endElement="c"')
    found, flown = load(path)
    assert found.isolated == ("a",) and flown.events == (At(1.0, {"*.c": 1.0}),)


# ---- elsewhere ---------------------------------------------------------------------------------------------------


def flown_elsewhere(path, folder, step, steps, outputs):
    """Rows of outputs by a loop over fmpy that reads the structure alone, as other masters do."""
    from xml.etree import ElementTree

    ssd = "{http://ssp-standard.org/SSP1/SystemStructureDescription}"
    with zipfile.ZipFile(path) as archive:
        archive.extractall(folder)
    root = ElementTree.parse(folder / "SystemStructure.ssd").getroot()
    slaves, variables = {}, {}
    for component in root.iter(f"{ssd}Component"):
        name, fmu = component.get("name"), folder / component.get("source")
        said = fmpy.read_model_description(fmu)
        variables |= {(name, v.name): v for v in said.modelVariables}
        slaves[name] = FMU2Slave(
            guid=said.guid,
            unzipDirectory=fmpy.extract(fmu),
            modelIdentifier=said.coSimulation.modelIdentifier,
            instanceName=name,
        )
        slaves[name].instantiate()
        slaves[name].setupExperiment(startTime=0.0)
        slaves[name].enterInitializationMode()
    calls = {"Enumeration": "Integer", "Real": "Real", "Integer": "Integer", "Boolean": "Boolean"}

    def exchange():
        for link in root.iter(f"{ssd}Connection"):
            assert not len(link)  # values are in the units of the inputs: no factor that a tool could pass over
            a, y, b, u = (link.get(k) for k in ("startElement", "startConnector", "endElement", "endConnector"))
            source, target = variables[a, y], variables[b, u]
            value = getattr(slaves[a], f"get{calls[source.type]}")([source.valueReference])
            getattr(slaves[b], f"set{calls[target.type]}")([target.valueReference], value)

    exchange()
    for slave in slaves.values():
        slave.exitInitializationMode()
    rows = []
    for k in range(steps):
        exchange()
        for slave in slaves.values():
            slave.doStep(k * step, step)
        rows.append([slaves[i].getReal([variables[i, v].valueReference])[0] for i, v in outputs])
    for slave in slaves.values():
        slave.terminate()
        slave.freeInstance()
    return np.array(rows)


def test_another_master_flies_the_table(exported, mixed, tmp_path):
    """It holds each value over a step: y(t_k+1) = y(t_k) + h (u + 10 v_1 + 100 v_2)(t_k); by numpy and scipy.

    State and sums are doubles: 20 sums of terms below 100 lose some 20 * 20 * 1e-16 * 100.
    """
    from scipy.interpolate import CubicSpline

    path = exported(of_mixed(mixed))
    assert "signals are FMUs for other tools (m_signals), which hold each value" in " ".join(exported.notes)
    names = [("m", "y"), ("m", "n_out"), ("m", "on_out"), ("m", "mode_out")]
    found = flown_elsewhere(path, tmp_path / "open", 0.1, 20, names)
    t = np.arange(20) * 0.1
    i = np.searchsorted(np.array(TIME) - 1e-9, t, side="right") - 1
    u = np.array(STEPS)[i]
    v = [CubicSpline(TIME, y)(t) for y in (RAMP, STEPS)]
    assert_allclose(found[:, 0], np.cumsum(0.1 * (u + 10 * v[0] + 100 * v[1])), rtol=0, atol=1e-11)
    for column, values in enumerate(([1, -7, 3, 2], [0, 1, 0, 1], [1, 5, 2, 1]), 1):
        assert found[:, column].tolist() == np.array(values)[i].tolist()


def test_here_it_flies_as_an_fmu_too(exported, angle):
    """Without our annotation: the table is an instance, and `plain` jacobi gives what holding its values gives."""
    path = exported(of_angle(angle))
    ssd = zipfile.ZipFile(path).read("SystemStructure.ssd").decode()
    whole = re.search(r"<ssd:Annotations>.*</ssd:Annotations>", ssd, re.DOTALL)[0]
    system, _ = load(edited(path, whole, ""), step=0.1)
    assert list(system.components) == ["a", "b", "a_signals"] and not system.inputs
    result = simulate(system, replace(FLIGHT, master=Explicit("jacobi")))
    wanted = np.radians(np.interp(result.time, TIME, RAMP))
    assert_allclose(result["a_signals.u"], wanted, rtol=0, atol=4e-16 * np.radians(4) * 10)
    assert_allclose(result["a.u"], result["a_signals.u"], rtol=0, atol=0)


# ---- what another tool has changed -------------------------------------------------------------------------------


class TestEdits:
    """Where structure, FMU or samples are not those that were written, the FMU flies: the structure is the truth."""

    @pytest.fixture(scope="class")
    @staticmethod
    def written(angle, tmp_path_factory):
        path = tmp_path_factory.mktemp("written") / "s.ssp"
        export(path, of_angle(angle), FLIGHT, Library())
        return path

    @pytest.fixture
    def path(self, written, tmp_path):
        return Path(shutil.copy(written, tmp_path))

    def table(self, path):
        system, flown = load(path)
        assert not system.inputs and system.components["a_signals"].endswith("#resources/a_signals.fmu")
        return system, flown

    def test_a_connection_to_something_else(self, path):
        ssd = zipfile.ZipFile(path).read("SystemStructure.ssd").decode()
        old = re.search(r'<ssd:Connection [^>]*startElement="a_signals"[^>]*/>', ssd)[0]
        path = edited(path, old, old.replace('endElement="a"', 'endElement="b"'))
        ssd = zipfile.ZipFile(path).read("SystemStructure.ssd").decode()
        other = re.search(r'<ssd:Connection startElement="a" [^>]*/>', ssd)[0]
        system, flown = self.table(edited(path, other, ""))
        assert [str(c.target) for c in system.connections] == ["b.u"]
        assert simulate(system, flown)["b.u"][-1] == np.radians(4.0)

    def test_a_factor(self, path):
        ssd = zipfile.ZipFile(path).read("SystemStructure.ssd").decode()
        old = re.search(r'<ssd:Connection [^>]*startElement="a_signals"[^>]*/>', ssd)[0]
        new = old.replace("/>", '><ssc:LinearTransformation factor="2.0"/></ssd:Connection>')
        system, flown = self.table(edited(path, old, new))
        assert simulate(system, flown)["a.u"][-1] == 2 * np.radians(4.0)

    def test_one_connection_more(self, path):
        ssd = zipfile.ZipFile(path).read("SystemStructure.ssd").decode()
        other = re.search(r'<ssd:Connection startElement="a" [^>]*/>', ssd)[0]
        system, _ = self.table(edited(path, other, other.replace('"a"', '"a_signals"').replace('"y"', '"u"')))
        assert {c.source for c in system.connections} == {"a_signals.u"}

    def test_samples(self, path, caplog):
        self.table(edited(path, "2.0,4.0", "2.0,5.0", "resources/a_signals-1.csv"))
        assert "a_signals flies as the FMU that it is: resources/a_signals-1.csv is not what was written" in caplog.text

    def test_no_samples(self, path, caplog):
        with zipfile.ZipFile(path) as archive:
            files = {n: archive.read(n) for n in archive.namelist() if not n.endswith(".csv")}
        with zipfile.ZipFile(path, "w") as archive:
            for name, data in files.items():
                archive.writestr(name, data)
        self.table(path)
        assert "resources/a_signals-1.csv is not there" in caplog.text

    def test_another_fmu(self, path, exported, angle):
        other = exported(replace(of_angle(angle, inputs={"a.u": Signal((TIME, STEPS))}), name="other"))
        with zipfile.ZipFile(path) as a, zipfile.ZipFile(other) as b:
            files = {n: (b if n.endswith("a_signals.fmu") else a).read(n) for n in a.namelist()}
        with zipfile.ZipFile(path, "w") as archive:
            for name, data in files.items():
                archive.writestr(name, data)
        self.table(path)

    @pytest.mark.parametrize("old", ['"guid"', '"inputs"', '"file"', '"sha256"', '"columns"', '"interpolation"'])
    def test_an_annotation_that_lacks_something(self, path, old):
        new = '"lost"'
        assert "its annotation org.adcs-cosim is damaged" in refused(edited(path, old, new))

    @pytest.mark.parametrize("told", ["[]", "{", '{"a_signals": 3}', '{"a_signals": {"guid": "", "inputs": []}}', "3"])
    def test_an_annotation_that_is_something_else(self, path, told):
        ssd = zipfile.ZipFile(path).read("SystemStructure.ssd").decode()
        old = re.search(r"<adcs:Signals>(.*)</adcs:Signals>", ssd)[1]
        guid = json.loads(old)["a_signals"]["guid"]
        said = refused(edited(path, old, told.replace('"guid": ""', f'"guid": "{guid}"')))
        assert "its annotation org.adcs-cosim is damaged" in said

    def test_an_interpolation_that_there_is_not(self, path):
        said = refused(edited(path, '"interpolation": "linear"', '"interpolation": "smooth"'))
        assert 'a_signals-1.csv: its interpolation is "smooth"' in said


# ---- what is asked for -------------------------------------------------------------------------------------------


def test_names_that_are_taken(exported, angle):
    system = of_angle(angle)
    parts = {"a": str(angle), "a_signals": str(angle)}
    named = replace(system, components=parts, connections=[Connection("a.y", "a_signals.u")])
    path = exported(named)
    assert "resources/a_signals_.fmu" in zipfile.ZipFile(path).namelist()
    assert same(named, load(path)[0])


def test_the_same_bytes(exported, angle, monkeypatch):
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1700000000")
    assert exported(of_angle(angle)).read_bytes() == exported(of_angle(angle)).read_bytes()


def test_signals_that_end_before_the_flight_and_events_that_cannot_be(exported, angle, tmp_path):
    experiment = replace(FLIGHT, stop_time=3.0, events=[At(1.0, {"a.k": 2.0}), At(5.0, {})][:1])
    with pytest.raises(WiringErrors) as caught:
        exported(of_angle(angle), experiment)
    assert "it reaches from 0 to 2 s, the flight from 0 to 3 s" in str(caught.value)
    assert "a.k is a fixed parameter, which cannot change after the start" in str(caught.value)
    assert not list(tmp_path.glob("*.ssp"))


def test_signals_without_their_fmus(angle, tmp_path):
    from cosim.cli.instances import read_descriptions
    from cosim.system.expand import wire

    system = of_angle(angle)
    wiring = wire(system, read_descriptions(system, Library()))
    with pytest.raises(SspError, match=r"signals feed a: they need FMUs in it, tables=\{'a \(signals\)': \.\.\.\}"):
        write(tmp_path / "a.ssp", system, FLIGHT, wiring, {"a": angle, "b": angle})
