"""What is written comes back as it was declared and flies to the same bits."""

import zipfile
from dataclasses import replace
from fractions import Fraction
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import pyarrow as pa
import pytest

from cosim import Connection, ErrorControlled, Experiment, Iterated, System, Value, load, simulate
from cosim.cli.packing import export
from cosim.ssp.write import write
from cosim.studies import papers
from cosim.system.expand import wire
from fmus.description.read import read_description

from .packages import edited, line, refused, same

pytestmark = pytest.mark.usefixtures("unbuilt")

CHEAP = ("zhang2018-ppatc", "xiao2011-pid", "geng2012-compensated")


@cache
def described(fmu: bytes):
    """The description of an FMU, by its bytes."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "any.fmu"
        path.write_bytes(fmu)
        return read_description(path)


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


def test_rows_are_tables():
    """`equals` of two tables compares bits but for NaN, which none of these flights has."""
    assert not pa.table({"a": [0.1]}).equals(pa.table({"a": [0.1 + 2**-56]}))
