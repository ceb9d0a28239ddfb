"""What another tool or a hand changes in a package of ours counts, or is refused by name."""

import re
import shutil
import zipfile
from dataclasses import replace
from pathlib import Path

import pytest

from cosim import Experiment, Library, System, load, simulate
from cosim.cli.instances import read_descriptions
from cosim.cli.packing import export

from .packages import edited, line, refused

pytestmark = pytest.mark.usefixtures("unbuilt")


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
