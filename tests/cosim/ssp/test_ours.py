"""What is written comes back as it was declared and flies to the same bits; what another tool changes in it counts."""

import re
import shutil
import zipfile
from dataclasses import replace
from fractions import Fraction
from functools import cache
from math import radians
from pathlib import Path
from tempfile import TemporaryDirectory

import pyarrow as pa
import pytest

from components.numbers.zhang2018 import RHO_0, J
from cosim import Connection, ErrorControlled, Experiment, Iterated, Library, System, Value, load, simulate
from cosim.cli.instances import read_descriptions
from cosim.cli.packing import export
from cosim.errors import WiringErrors
from cosim.ssp.errors import SspError
from cosim.ssp.write import write
from cosim.studies import papers
from cosim.system.expand import wire
from fmus.description.read import read_description

from .packages import line, refused

CHEAP = ("zhang2018-ppatc", "xiao2011-pid", "geng2012-compensated")


@pytest.fixture(scope="module")
def library():
    return Library()


@pytest.fixture(scope="module", autouse=True)
def unbuilt(library):
    """FMUs go out as they are in the library: to build start values into each takes seconds (test_export.py does)."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("cosim.cli.packing.build_reference", lambda reference, *_: library(reference))
        yield


@pytest.fixture
def exported(tmp_path, library):
    """Write a system and return the file."""

    def call(system, experiment, **more):
        path = tmp_path / f"{system.name}.ssp"
        export(path, system, experiment, library, **more)
        return path

    return call


@cache
def described(fmu: bytes):
    """The description of an FMU, by its bytes."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "any.fmu"
        path.write_bytes(fmu)
        return read_description(path)


def same(system, other):
    """Whether systems are equal but for where their FMUs lie."""
    return replace(other, components=system.components) == system


def edited(path, old, new, member="SystemStructure.ssd"):
    """Change a text in a package, as another tool would."""
    with zipfile.ZipFile(path) as archive:
        files = {name: archive.read(name) for name in archive.namelist()}
    text = files[member].decode()
    assert old in text
    files[member] = text.replace(old, new).encode()
    with zipfile.ZipFile(path, "w") as archive:
        for name, data in files.items():
            archive.writestr(name, data)
    return path


@pytest.mark.parametrize(
    "name", [n if n in CHEAP else pytest.param(n, marks=pytest.mark.slow) for n in papers.describe()]
)
def test_every_experiment_comes_back(name, library, tmp_path, monkeypatch):
    """Descriptions are read once for each FMU, wherever it lies: that takes longer than all else here."""
    monkeypatch.setattr("cosim.ssp.read.read_description", lambda path: described(path.read_bytes()))
    system, experiment = load(name)
    descriptions = {i: described(library(reference).read_bytes()) for i, reference in system.components.items()}
    wiring = wire(system, descriptions)
    fmus = {instance: library(reference) for instance, reference in system.components.items()}
    for version in ("1.0", "2.0"):
        path = write(tmp_path / "a.ssp", system, experiment, wiring, fmus, version=version)
        found, flown = load(path)
        assert same(system, found) and flown == experiment


@pytest.mark.parametrize("name", CHEAP)
def test_a_flight_of_what_came_back_has_the_same_bits(name, exported, library):
    system, experiment = load(name)
    experiment = replace(experiment, stop_time=2.0)
    found, flown = load(exported(system, experiment))
    rows = [simulate(s, e, locate=library).table for s, e in ((system, experiment), (found, flown))]
    assert rows[0].equals(rows[1], check_metadata=False) and rows[0].num_rows > 20


def test_once_more_written_and_read_it_is_the_same(exported, tmp_path, library):
    system, experiment = load(exported(*load("zhang2018-ppatc")))
    again = tmp_path / "again.ssp"
    export(again, system, experiment, library)
    found, flown = load(again)
    assert same(system, found) and flown == experiment


def test_the_same_bytes_for_the_same_system(exported, monkeypatch):
    declared = load("xiao2011-pid")
    first = exported(*declared).read_bytes()
    assert exported(*declared).read_bytes() == first
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1700000000")
    path = exported(*declared)
    dated = path.read_bytes()
    assert dated != first and exported(*declared).read_bytes() == dated
    with zipfile.ZipFile(path) as archive:
        assert {entry.date_time for entry in archive.infolist()} == {(2023, 11, 14, 22, 13, 20)}
        assert b'generationDateAndTime="2023-11-14T22:13:20Z"' in archive.read("SystemStructure.ssd")


class TestWhatIsWritten:
    """zhang2018: the profile that other tools read."""

    @pytest.fixture(scope="class")
    @staticmethod
    def texts(tmp_path_factory):
        path = tmp_path_factory.mktemp("ssp") / "z.ssp"
        export(path, *load("zhang2018-ppatc"), Library())
        with zipfile.ZipFile(path) as archive:
            return {name: archive.read(name) for name in archive.namelist()}

    def test_files(self, texts):
        instances = ("guidance", "environment", "controller", "plant")
        fmus = ("EulerSinusoid", "HarmonicTorque", "PrescribedPerformance", "FlexibleSpacecraft")
        names = [f"resources/{i}.ssv" for i in instances] + [f"resources/{f}.fmu" for f in fmus]
        assert set(texts) == {"SystemStructure.ssd", *names}

    def test_structure(self, texts):
        ssd = texts["SystemStructure.ssd"].decode()
        assert ssd.count("<ssd:Connection ") == 4 + 3 + 4 + 3 + 3 + 3 + 3  # element by element
        assert "LinearTransformation" not in ssd and ssd.count("<ssd:System ") == 1
        assert '<ssd:DefaultExperiment startTime="0.0" stopTime="200.0"/>' in ssd
        assert '<ssd:Connector name="omega_BN_B[1]" kind="output">' in ssd and '<ssc:Real unit="rad/s"/>' in ssd
        assert '<ssc:Unit name="N.m">' in ssd and "kg^(1/2).m" not in re.findall('unit="([^"]*)"', ssd)

    def test_values_in_the_variables_own_units(self, texts):
        """Bounds of 0.3 deg are in rad; inputs have what they start with, held or connected."""
        plant = texts["resources/plant.ssv"].decode()
        assert "<ssv:ParameterSet" in plant and 'name="initialValues"' in plant and "unit=" not in plant
        values = dict(re.findall(r'Parameter name="([^"]+)">\s*<ssv:Real value="([^"]+)"', plant))
        assert float(values["J[1,1]"]) == J[0][0]
        assert values["h_B[1]"] == "0.0" and float(values["tau_dist_B[1]"]) != 0.0
        controller = dict(
            re.findall(
                r'Parameter name="([^"]+)">\s*<ssv:Real value="([^"]+)"', texts["resources/controller.ssv"].decode()
            )
        )
        assert float(controller["rho_0[1]"]) == pytest.approx(radians(RHO_0), rel=4e-16)
        assert controller["q_BN[1]"] == values["q_BN[1]"]  # the start of what it is connected to


class TestEdits:
    """The structure is the truth, the annotation its refinement."""

    @pytest.fixture
    def path(self, exported):
        return exported(*load("zhang2018-ppatc"))

    def test_a_value(self, path):
        system, _ = load("zhang2018-ppatc")
        text = zipfile.ZipFile(path).read("resources/plant.ssv").decode()
        old = re.search(r'name="J\[1,1\]">\s*<ssv:Real value="([^"]+)"', text)
        found, _ = load(edited(path, old[0], old[0].replace(old[1], "500.0"), "resources/plant.ssv"))
        assert found.parameters == system.parameters | {"plant.J[1,1]": 500.0} and found.vehicle == system.vehicle

    def test_a_value_that_is_gone_is_the_start_value(self, path, library):
        text = zipfile.ZipFile(path).read("resources/controller.ssv").decode()
        old = re.search(r'<ssv:Parameter name="sigma">.*?</ssv:Parameter>', text, re.DOTALL)
        found, _ = load(edited(path, old[0], "", "resources/controller.ssv"))
        start = read_descriptions(found, library)["controller"].variables["sigma"].start
        assert found.parameters["controller.sigma"] == start

    def test_a_held_input(self, path):
        text = zipfile.ZipFile(path).read("resources/plant.ssv").decode()
        old = re.search(r'name="h_B\[2\]">\s*<ssv:Real value="([^"]+)"', text)
        found, _ = load(edited(path, old[0], old[0].replace(old[1], "7.0"), "resources/plant.ssv"))
        result = simulate(found, replace(load(path)[1], stop_time=0.01))
        assert list(result["plant.h_B"][0]) == [0.0, 7.0, 0.0]

    def test_a_connection_that_is_gone_leaves_its_input_at_its_start(self, path):
        """Of an array one element; the others keep the timing that was declared."""
        system, _ = load("zhang2018-ppatc")
        old = re.search(
            r'<ssd:Connection [^>]*endConnector="tau_dist_B\[2\]"/>',
            zipfile.ZipFile(path).read("SystemStructure.ssd").decode(),
        )
        found, _ = load(edited(path, old[0], ""))
        assert [c for c in found.connections if "tau_dist_B" not in c.target] == list(system.connections[:-1])
        ends = [c.target for c in found.connections if "tau_dist_B" in c.target]
        assert ends == ["plant.tau_dist_B[1]", "plant.tau_dist_B[3]"]
        assert found.held["plant.tau_dist_B[2]"] is not None

    def test_a_stop_time(self, path):
        assert load(edited(path, 'stopTime="200.0"', 'stopTime="50.0"'))[1].stop_time == 50.0

    def test_a_name(self, path):
        assert load(edited(path, 'name="zhang2018-ppatc"', 'name="mine"', "SystemStructure.ssd"))[0].name == "mine"

    def test_an_annotation_of_a_later_version(self, path):
        assert "its annotation org.adcs-cosim is of version 2, read is 1" in refused(
            edited(path, 'ssp" version="1"', 'ssp" version="2"')
        )

    @pytest.mark.parametrize(
        ("old", "new", "said"),
        [
            ('"communication_step_size"', '"step"', "has in Experiment what is not known here: step"),
            ("!Explicit", "!Other", "its annotation org.adcs-cosim is damaged: 'Other'"),
            ('"vehicle": {', '"vehicle": [', "its annotation org.adcs-cosim is damaged"),
        ],
    )
    def test_an_annotation_that_is_damaged(self, path, old, new, said):
        assert said in refused(edited(path, old, new))


class TestTypesOfFields:
    """What a hand has written into the annotation is refused by name, not by an error of Python's in flight."""

    @pytest.fixture(scope="class")
    @staticmethod
    def written(tmp_path_factory):
        folder = tmp_path_factory.mktemp("types")
        made = System(name="s", components={"a": str(line(folder))}, held={"a.u": 1.0}, isolated=["a"])
        export(folder / "s.ssp", made, Experiment(stop_time=1.0, communication_step_size=0.1), Library())
        return folder / "s.ssp"

    @pytest.mark.parametrize(
        ("field", "said"),
        [
            ('"communication_step_size": "abc"', "communication_step_size is 'abc'"),
            ('"communication_step_size": null', "communication_step_size is None"),
            ('"communication_step_size": 0.1, "start_time": [0]', "start_time is [0]"),
            ('"communication_step_size": 0.1, "every": "x"', "every is 'x'"),
            ('"communication_step_size": 0.1, "every": true', "every is True"),
            ('"communication_step_size": 0.1, "record": [1]', "record has 1"),
            ('"communication_step_size": 0.1, "tolerance": "x"', "tolerance is 'x'"),
            ('"communication_step_size": 0.1, "pending_timeout": {}', "pending_timeout is {}"),
            ('"communication_step_size": 0.1, "master": "x"', "master is 'x'"),
            ('"communication_step_size": 0.1, "master": {"!Value": {"value": 1}}', "master is Value"),
            ('"communication_step_size": 0.1, "stop_when": 3', "stop_when is 3"),
            ('"communication_step_size": 0.1, "announce_stop_time": 1', "announce_stop_time is 1"),
            ('"communication_step_size": 0.1, "events": [3]', "events has 3"),
            ('"communication_step_size": 0.1, "events": 3', "'int' object is not iterable"),
            ('"communication_step_size": 0.1, "events": [{"!At": {"time": 1, "values": 3}}]', "'int' object has no"),
            ('"communication_step_size": 0.1, "events": [{"!At": {"time": "x", "values": {}}}]', "an event is at 'x'"),
        ],
    )
    def test_of_an_experiment(self, written, tmp_path, field, said):
        path = edited(Path(shutil.copy(written, tmp_path)), '"communication_step_size": 0.1', field)
        assert "its annotation org.adcs-cosim is damaged" in refused(path) and said in refused(path)

    @pytest.mark.parametrize(
        ("field", "said"),
        [
            ('"isolated": [1]', "isolated is [1]"),
            ('"isolated": null', "'NoneType' object is not iterable"),
            ('"isolated": ["a"], "hold_unconnected": "yes"', "hold_unconnected is 'yes'"),
            ('"isolated": ["a"], "steps": {"a": "x"}', "steps of a is 'x'"),
            ('"isolated": ["a"], "held": 3', "'int' object has no attribute"),
        ],
    )
    def test_of_a_system(self, written, tmp_path, field, said):
        path = edited(Path(shutil.copy(written, tmp_path)), '"isolated": ["a"]', field)
        assert said in refused(path)

    def test_one_name_as_a_text(self, written, tmp_path):
        path = edited(Path(shutil.copy(written, tmp_path)), '"isolated": ["a"]', '"isolated": "a"')
        assert load(path)[0].isolated == ("a",)


class TestEverythingDeclared:
    """A system with all that systems and experiments can say."""

    @pytest.fixture(scope="class")
    @staticmethod
    def fmu(tmp_path_factory):
        return line(tmp_path_factory.mktemp("fmu"))

    def made(self, fmu, **more):
        return System(
            name="all of it",
            components={"a": str(fmu), "b": str(fmu), "c": str(fmu)},
            connections=[Connection("a.y", "b.u", "after_step"), Connection("b.x", "c.u", "at_point", -2.0, 0.5)],
            parameters={
                "*.c": 0.25,
                "a.k": Value(2.0),
                "b.n": Value("7"),
                "b.mode": Value("fast"),
                "b.on": True,
                "c.label": Value('"17"'),
                "c.k": -1,
            },
            steps={"b": 2},
            **{"held": {"a.u": 1.5}, **more},
        )

    def test_steps_that_are_no_number(self, fmu, exported):
        path = exported(self.made(fmu), Experiment(stop_time=1.0, communication_step_size=0.1))
        said = refused(edited(path, '"steps": {"b": 2}', '"steps": {"b": [2]}'))
        assert "its annotation org.adcs-cosim is damaged (steps of b is [2]). Without it the file is read too" in said

    def test_it_comes_back_and_flies_alike(self, fmu, exported, library):
        experiment = Experiment(
            stop_time=Fraction(4, 3),
            communication_step_size=Fraction(1, 30),
            start_time=0.1,
            every=2,
            record=("a.*", "b.x"),
            tolerance=1e-5,
            announce_stop_time=True,
            pending_timeout=5.0,
        )
        system = self.made(fmu)
        found, flown = load(exported(system, experiment))
        assert same(system, found) and flown == experiment
        assert [v.text for v in found.parameters.values() if isinstance(v, Value)] == [None, "7", "fast", "17"]
        rows = [simulate(s, e, locate=library).table for s, e in ((system, experiment), (found, flown))]
        assert rows[0].equals(rows[1], check_metadata=False)

    @pytest.mark.parametrize(
        "master",
        [Iterated("ramp", 1e-7), ErrorControlled(1e-5, tolerances={"a.*": 1e-3}, least_step=Fraction(1, 3000))],
    )
    def test_masters(self, fmu, exported, master):
        experiment = Experiment(stop_time=1.0, communication_step_size=0.1, master=master)
        assert load(exported(self.made(fmu), experiment))[1] == experiment

    def test_inputs_that_nothing_holds(self, fmu, exported):
        system = self.made(fmu, held={}, hold_unconnected=True)
        found, _ = load(exported(system, Experiment(stop_time=1.0, communication_step_size=0.1)))
        assert same(system, found)

    def test_equal_fmus_are_one_file_others_of_one_name_are_two(self, fmu, exported, tmp_path):
        other = line(tmp_path, input_derivatives=1)
        assert other.name == fmu.name
        system = replace(self.made(fmu), components={"a": str(fmu), "b": str(other), "c": str(fmu)})
        path = exported(system, Experiment(stop_time=1.0, communication_step_size=0.1))
        files = [n for n in zipfile.ZipFile(path).namelist() if n.endswith(".fmu")]
        assert files == ["resources/Line.fmu", "resources/Line-b.fmu"]
        assert same(system, load(path)[0])

    def test_units_that_differ_have_their_factor(self, tmp_path, exported):
        fmus = {name: str(line(tmp_path, name, unit)) for name, unit in (("Angle", "rad"), ("Degrees", "deg"))}
        system = System(
            name="units",
            components={"a": fmus["Angle"], "b": fmus["Degrees"]},
            connections=[Connection("a.y", "b.u")],
            parameters={"a.c": Value(90.0, "deg")},
            held={"a.u": 0.0},
        )
        path = exported(system, Experiment(stop_time=1.0, communication_step_size=0.5))
        ssd = zipfile.ZipFile(path).read("SystemStructure.ssd").decode()
        assert 'suppressUnitConversion="true"' in ssd and 'LinearTransformation factor="57.29' in ssd
        found, flown = load(path)
        assert same(system, found)
        assert simulate(found, flown)["b.u"][0] == pytest.approx(90.0, rel=4e-16)


class TestWhatCannotBeWritten:
    def test_a_mistake_in_the_system(self, exported):
        system, experiment = load("zhang2018-ppatc")
        with pytest.raises(WiringErrors):
            exported(replace(system, connections=()), experiment)

    def test_a_text_that_xml_has_not(self, tmp_path, exported):
        fmu = line(tmp_path)
        system = System(name="s", components={"a": str(fmu)}, parameters={"a.label": "\x07"}, hold_unconnected=True)
        with pytest.raises(SspError, match="it cannot be written: All strings must be XML compatible"):
            exported(system, Experiment(stop_time=1.0, communication_step_size=0.5))

    def test_a_place_that_takes_no_file(self, tmp_path, library):
        (tmp_path / "file").write_text("")
        with pytest.raises(SspError, match="it cannot be written: "):
            export(tmp_path / "file" / "a.ssp", *load("xiao2011-pid"), library)

    def test_a_version_that_there_is_not(self, tmp_path, library):
        with pytest.raises(SspError, match=r"there is no SSP 3.0 to write. Versions: 1.0, 2.0"):
            export(tmp_path / "a.ssp", *load("xiao2011-pid"), library, ssp="3.0")


def test_a_system_that_does_not_start_is_written_and_that_is_told(tmp_path, library):
    from ..c_fmu import build, real

    fmu = build(
        tmp_path, "No", [real("u", "input"), real("y", depends="u")], outputs="y = u;", initialized="return fmi2Error;"
    )
    system = System(
        name="s", components={"a": str(fmu), "b": str(fmu)}, connections=[Connection("a.y", "b.u")], held={"a.u": 0.0}
    )
    notes = export(tmp_path / "a.ssp", system, Experiment(stop_time=1.0, communication_step_size=0.5), library)
    assert notes[0].startswith("connected inputs have no start values in it, for the system does not start here: a ")
    assert same(system, load(tmp_path / "a.ssp")[0])


def test_rows_are_tables():
    """`equals` of two tables compares bits but for NaN, which none of these flights has."""
    assert not pa.table({"a": [0.1]}).equals(pa.table({"a": [0.1 + 2**-56]}))
