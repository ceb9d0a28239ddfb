"""adcs export, and FILE.ssp where a system is named."""

import zipfile
from math import radians

import pytest
from numpy.testing import assert_array_equal

from cosim import Library, Value, load
from cosim.results.result import Result
from cosim.ssp.package import extracted
from cosim.ssp.trace import FILE, SRMD, STC
from fmus.description.read import read_description

SYSTEM = """
from cosim import Connection, Experiment, System, Value

def follow():
    system = System(
        name="follow",
        components={"torque": "HarmonicTorque", "sum": "Sum", "guidance": "EulerSinusoid"},
        connections=[Connection("torque.tau_dist_B", "sum.tau_1", "after_step")],
        parameters={"torque.bias": [1, 2, 3], "guidance.amplitude": Value([2, 1, 0.5], "deg")},
        hold_unconnected=True,
    )
    return system, Experiment(stop_time=2.0, communication_step_size=0.01)
"""


@pytest.fixture
def unbuilt(monkeypatch):
    """FMUs go out as they are in the library: to build start values into each takes seconds."""
    monkeypatch.setattr("cosim.cli.packing.build_reference", lambda reference, *_: Library()(reference))


def test_a_system_goes_out_and_flies_elsewhere_as_here(adcs, folder):
    """With its values built into its FMUs, so that a tool that reads no parameter set starts right."""
    (folder / "follow.py").write_text(SYSTEM)
    done = adcs("export", "follow.py", "-o", "f.ssp")
    assert done.status == 0 and done.out == "wrote f.ssp\n"
    assert "told the communication step, 10 ms; some ask for the parameter set initialValues" in done.err
    for name, out in (("follow.py", "a"), ("f.ssp", "b")):
        assert adcs("run", name, "--out", out).status == 0
    a, b = (Result.read(folder / name) for name in ("a", "b"))
    assert a.table.equals(b.table, check_metadata=False) and len(a) == 201
    assert b.info["components"]["sum"]["reference"] == "f.ssp#resources/sum.fmu"
    values = {
        name: read_description(extracted(f"f.ssp#resources/{name}.fmu")).variables for name in ("guidance", "sum")
    }
    assert values["guidance"]["amplitude[1]"].start == radians(2)
    assert values["sum"]["tau_1[3]"].start == 3.0


def test_changes_go_out_too(adcs, folder, unbuilt):
    done = adcs(
        "export", "zhang2018-ppatc", "-o", "z.ssp", "--ssp", "2.0", "--step", "2ms", "--stop", "3",
        "--set", "plant.J[1,1]=500", "--use", "controller=AdaptiveTracking",
    )  # fmt: skip
    assert done.status == 0 and "controller = AdaptiveTracking" in done.out
    system, experiment = load("z.ssp")
    assert system.components["controller"] == "z.ssp#resources/AdaptiveTracking.fmu"
    assert (experiment.communication_step_size, experiment.stop_time) == (0.002, 3.0)
    assert system.parameters["plant.J[1,1]"] == Value(500)
    assert b'version="2.0" name="zhang2018-ppatc"' in zipfile.ZipFile("z.ssp").read("SystemStructure.ssd")


def test_show_run_and_verify_take_a_package(adcs, folder, unbuilt):
    assert adcs("export", "xiao2011-pid", "-o", "x.ssp", "--stop", "2").status == 0
    shown = adcs("show", "x.ssp").out
    assert shown.startswith("xiao2011-pid: 2 s in steps of") and "x.ssp#resources/PID.fmu" in shown
    assert adcs("run", "x.ssp", "--stop", "1").out.startswith("finished: 1 s simulated")
    done = adcs("verify", "x.ssp", "--stop", "1")
    assert done.status == 0 and "xiao2011-pid by" in done.out


def test_what_is_no_package(adcs, folder):
    done = adcs("export", "xiao2011-pid", "-o", "x.zip")
    assert done.status == 2 and "x.zip is no FILE.ssp" in done.err
    done = adcs("export", "xiao2011-pidd", "-o", "x.ssp")
    assert done.status == 2 and 'Did you mean "xiao2011-pid' in done.err and not list(folder.iterdir())


class TestTrace:
    def read(self, path):
        from lxml import etree

        root = etree.fromstring(zipfile.ZipFile(path).read(FILE))
        assert root.tag == f"{{{SRMD}}}SimulationResourceMetaData"
        return {
            part.get("type"): {entry.get("keyword"): entry.text for entry in part.iter(f"{{{STC}}}ClassificationEntry")}
            for part in root.iter(f"{{{STC}}}Classification")
        }

    def test_claims_and_verdicts_of_the_paper(self, adcs, folder, unbuilt):
        """The claims that one run decides, with what they were judged by."""
        assert adcs("export", "zhang2018-ppatc", "-o", "z.ssp", "--trace").status == 0
        said = self.read("z.ssp")
        assert said["org.adcs-cosim.flight"]["status"] == "finished"
        assert "peak torque (N.m)" in said["org.adcs-cosim.metrics"]
        claims = [entries for kind, entries in said.items() if ".claim." in kind]
        assert [claim["claim"] for claim in claims] == [
            "PPATC: steady-state error within 0.005 deg",
            "PPATC: error within its bounds, no overshoot",
        ]
        assert all(claim["verdict"] == "reproduced" and claim["criterion"] for claim in claims)
        assert load("z.ssp")[0].name == "zhang2018-ppatc"

    def test_of_a_changed_system_there_is_no_claim(self, adcs, folder, unbuilt):
        done = adcs("export", "zhang2018-ppatc", "-o", "z.ssp", "--trace", "--stop", "1")
        assert "no claims: this is no experiment of a paper as it is published" in done.err
        assert set(self.read("z.ssp")) == {"org.adcs-cosim.flight", "org.adcs-cosim.metrics"}

    @pytest.mark.slow
    def test_it_keeps_to_its_schema(self, adcs, folder, unbuilt):
        """An XML Schema 1.1, which xmlschema knows; pyssp-standard brings both."""
        import xmlschema

        from cosim.ssp.xml import schemas

        assert adcs("export", "zhang2018-ppatc", "-o", "z.ssp", "--trace").status == 0
        schema = xmlschema.XMLSchema11(str(schemas() / "SRMD11.xsd"))
        text = zipfile.ZipFile("z.ssp").read(FILE).decode()
        schema.validate(text)
        with pytest.raises(xmlschema.XMLSchemaValidationError):
            schema.validate(text.replace("keyword=", "word="))


def test_the_python_of_it(adcs, folder, unbuilt):
    """cosim.load takes a package as it takes a name."""
    from cosim import simulate

    adcs("export", "zhang2018-ppatc", "-o", "z.ssp", "--stop", "0.1")
    here, there = (simulate(*load(name, 0.1)) for name in ("z.ssp", folder / "z.ssp"))
    assert_array_equal(here["plant.q_BN"], there["plant.q_BN"])


def test_one_fmu_of_a_package_in_a_system_of_ones_own(adcs, folder, unbuilt):
    """By FILE.ssp#resources/NAME.fmu, relative to the file that names it, and on the command line."""
    adcs("export", "zhang2018-atc", "-o", "own/z.ssp")
    text = SYSTEM.replace('"HarmonicTorque"', '"z.ssp#resources/HarmonicTorque.fmu"')
    (folder / "own" / "follow.py").write_text(text)
    done = adcs("run", "own/follow.py", "--out", "a")
    assert done.status == 0 and Result.read(folder / "a")["sum.tau_dist_B"][0][2] == 3.0
    done = adcs(
        "run", "zhang2018-ppatc", "--stop", "0.1", "--use", "controller=own/z.ssp#resources/AdaptiveTracking.fmu"
    )
    assert done.status == 0 and "controller = own/z.ssp#resources/AdaptiveTracking.fmu" in done.out


FED = """
from dataclasses import replace
from cosim import At, Signal
from follow import follow

def fed():
    system, experiment = follow()
    return replace(system, inputs={"sum.tau_2": Signal(([0.0, 2.0], [[0.0] * 3, [1.0] * 3]))}), experiment

def eventful():
    system, experiment = follow()
    components = system.components | {"low": "LowPass"}
    system = replace(system, isolated=["sum"], components=components)
    return system, replace(experiment, events=[At(1.0, {"low.bandwidth": [3.0]})])

def mistaken():
    system, experiment = follow()
    return system, replace(experiment, events=[At(1.0, {"torque.bias": [0, 0, 0]})])
"""


def test_signals_go_out_as_an_fmu_and_what_is_of_this_master_alone_is_told(adcs, folder, unbuilt):
    (folder / "follow.py").write_text(SYSTEM)
    (folder / "fed.py").write_text(FED)
    done = adcs("export", "fed.py:fed", "-o", "f.ssp")
    assert done.status == 0 and "signals are FMUs for other tools (sum_signals), which hold each value" in done.err
    assert "resources/sum_signals.fmu" in zipfile.ZipFile("f.ssp").namelist()
    assert "sum.tau_2" in adcs("show", "f.ssp").out
    for name, out in (("fed.py:fed", "a"), ("f.ssp", "b")):
        assert adcs("run", name, "--out", out).status == 0
    a, b = (Result.read(folder / name) for name in ("a", "b"))
    assert a.table.equals(b.table, check_metadata=False) and list(a["sum.tau_2"][-1]) == [1.0, 1.0, 1.0]
    done = adcs("export", "fed.py:eventful", "-o", "g.ssp")
    assert done.status == 0, done.err
    assert "only adcs-cosim reads the events and processes of their own in it" in done.err
    done = adcs("export", "fed.py:mistaken", "-o", "h.ssp")
    assert done.status == 2 and not (folder / "h.ssp").exists()
    assert "torque.bias is a fixed parameter, which cannot change after the start" in done.err
