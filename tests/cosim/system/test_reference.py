"""What names an FMU: a text, a path, a class; and what run.json, swaps and tables call it."""

import dataclasses
import shutil
from pathlib import Path

import pytest

from components.environment.harmonic_torque import HarmonicTorque
from cosim import Experiment, Library, System, load, simulate
from cosim.errors import FmuError, WiringError
from cosim.flights import find
from cosim.results.result import Result
from cosim.system.reference import name_of, reference_of
from cosim.system.swap import replace
from fmus.description.read import read_description
from fmus.export.build import build_reference

EXPERIMENT = Experiment(stop_time=0.2, communication_step_size=0.1)
OWN = '''
from pathlib import Path
from components.environment.harmonic_torque import HarmonicTorque
from cosim import Experiment, System


class Mine(HarmonicTorque):
    """A torque of my own."""


def system():
    """A class of this file, a class of the catalog, a path, a file whose suffix is in capitals."""
    components = {"a": Mine, "b": HarmonicTorque, "c": Path("REP.FMU"), "d": "REP.FMU"}
    return System(name="own", components=components), Experiment(stop_time=0.2, communication_step_size=0.1)
'''


@pytest.fixture
def home(folder, monkeypatch):
    """The user's home, the folder that the test is in, with REP.FMU in it."""
    monkeypatch.setenv("HOME", str(folder))
    monkeypatch.setenv("USERPROFILE", str(folder))
    shutil.copy(build_reference("HarmonicTorque"), folder / "REP.FMU")
    return folder


@pytest.mark.parametrize("given", [HarmonicTorque, Path("REP.FMU"), "REP.FMU", "~/REP.FMU", Path("~/REP.FMU")], ids=str)
def test_all_fly_and_are_called_by_a_name_that_says_which(home, given):
    system = System(name="one", components={"unit": given})
    result = simulate(system, EXPERIMENT)
    assert len(result) == 3 and result.info["status"] == "finished"
    reference = result.info["components"]["unit"]["reference"]
    expected = {
        HarmonicTorque: "components.environment.harmonic_torque.HarmonicTorque",
        Path("REP.FMU"): "REP.FMU",
        "REP.FMU": "REP.FMU",
    }
    assert reference == expected.get(given, str(home / "REP.FMU"))


def test_a_system_has_texts_and_classes(home):
    components = System(name="s", components={"a": Path("x.fmu"), "b": "~/y.fmu", "c": HarmonicTorque}).components
    assert components == {"a": "x.fmu", "b": str(home / "y.fmu"), "c": HarmonicTorque}


def test_what_names_no_fmu_is_refused():
    advice = r"Give FILE\.fmu, NAME:modes=6, FILE\.py:Class, a Path, or a component's class\."
    with pytest.raises(WiringError, match=rf"^component plant is int 3, which names no FMU\. {advice}"):
        System(name="s", components={"plant": 3})
    with pytest.raises(WiringError, match=rf"^a component is HarmonicTorque .*, which names no FMU\. {advice}"):
        reference_of(HarmonicTorque())


def test_without_a_library_only_files_are_found(home):
    assert find("REP.FMU") == find(Path("REP.FMU")) == Path("REP.FMU")
    assert find("~/REP.FMU") == Library()("~/REP.FMU") == home / "REP.FMU"
    with pytest.raises(FmuError, match=r"harmonic_torque\.HarmonicTorque: it is no path of a \.fmu file"):
        find(HarmonicTorque)


def test_a_swap_takes_them_all_and_names_them(home):
    system = System(name="one", components={"unit": "HarmonicTorque"})
    fmu = read_description(home / "REP.FMU")
    for given in (HarmonicTorque, Path("~/REP.FMU")):
        changed, report = replace(system, "unit", given, {"unit": fmu})
        assert changed.components["unit"] == reference_of(given)
        assert report.reference == name_of(reference_of(given)) == dataclasses.asdict(report)["reference"]


def test_a_file_of_the_users_has_classes_and_paths(home, adcs):
    (home / "own.py").write_text(OWN)
    done = adcs("run", "own.py", "--use", "d=~/REP.FMU", "--out", "out")
    assert done.status == 0, done.err
    assert f"d = {home / 'REP.FMU'}" in done.out
    result = Result.read("out")
    found = {name: c["reference"] for name, c in result.info["components"].items()}
    assert found == {
        "a": f"{home / 'own.py'}:Mine",
        "b": "components.environment.harmonic_torque.HarmonicTorque",
        "c": "REP.FMU",
        "d": str(home / "REP.FMU"),
    }
    assert result.info["swaps"][0]["reference"] == str(home / "REP.FMU")
    assert f"{home / 'own.py'}:Mine" in adcs("show", "own.py").out.replace("\n", "")
    assert (result["a.tau_dist_B"] == result["b.tau_dist_B"]).all()
    built = adcs("build", "own.py", "-o", "made")
    assert built.status == 0 and "c is REP.FMU as it is" in built.err
    assert sorted(p.name for p in (home / "made").iterdir()) == ["own_a.fmu", "own_b.fmu"]


def test_files_beside_the_file_that_names_them(home, monkeypatch):
    (home / "own.py").write_text(OWN)
    (home / "elsewhere").mkdir()
    monkeypatch.chdir(home / "elsewhere")
    assert load("~/own.py")[0].components["c"] == str(home / "REP.FMU")


@pytest.mark.parametrize("name", ["REP.FMU", "~/REP.FMU"])
def test_one_fmu_alone(home, adcs, name):
    shown = adcs("show", name)
    assert shown.status == 0 and shown.out.startswith("HarmonicTorque: ")
    assert adcs("run", name, "--stop", "0.01").status == 0
    assert Result.read("results/REP").info["components"]["REP"]["reference"] == str(Path(name).expanduser())
