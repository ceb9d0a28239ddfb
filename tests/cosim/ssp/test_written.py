"""What stands in a written package, and what cannot be written."""

import re
import zipfile
from dataclasses import replace
from math import radians

import pytest

from components.numbers.zhang2018 import RHO_0, J
from cosim import Connection, Experiment, Library, System, load
from cosim.cli.packing import export
from cosim.errors import WiringErrors
from cosim.ssp.errors import SspError

from .packages import line, same

pytestmark = pytest.mark.usefixtures("unbuilt")


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
