"""FMU files in systems, and files that are none."""

import dataclasses
import os
import zipfile

import fmpy
import pytest
from numpy.testing import assert_allclose

from cosim import simulate
from cosim.errors import FmuError, InitializationFailed, StepFailed
from cosim.masters.explicit import Explicit
from cosim.slaves.fmi2 import FmuSlave
from cosim.system import Connection, Experiment, System
from fmus.description.read import read_description

from .. import tiny_fmu


@pytest.fixture(scope="module")
def tiny(tmp_path_factory):
    return tiny_fmu.build(tmp_path_factory.mktemp("tiny"))


@pytest.fixture(params=["never", "auto"])
def experiment(request):
    """With the loop in Python and, where there is one, in the kernel."""
    setup = {"stop_time": 1.0, "communication_step_size": 0.1, "master": Explicit(kernel=request.param)}
    return lambda **changes: Experiment(**setup | changes)


class TestRuns:
    def test_in_a_system(self, tiny, experiment):
        system = System(
            name="s",
            components={"a": str(tiny), "b": str(tiny)},
            connections=[Connection("a.y", "b.u")],
            held={"a.u": 1.0},
            parameters={"b.k": 2.0, "b.label": "x", "a.on": False, "a.n": 4},
        )
        result = simulate(system, experiment())
        assert_allclose(result["a.y"], result.time, rtol=1e-14)
        if result.info["components"]["a"]["generation_tool"] == "by hand":  # it carries the refresh mark
            assert_allclose(result["b.y_direct"], result["b.y"] + result["b.u"])
        assert result.info["components"]["a"]["path"] == str(tiny)
        assert result.info["parameters"]["a.n"]["value"] == 4

    @pytest.mark.parametrize("timing", ["at_point", "after_step", "midpoint", "ramp"])
    @pytest.mark.parametrize("steps", [{}, {"b": 2, "c": 4}, {"a": 4, "b": 2}, {"a": 3, "c": 6}])
    def test_loop_and_kernel_agree_at_all_rates(self, tiny, timing, steps):
        if not tiny_fmu.COMPILED and timing == "ramp":
            timing = "midpoint"  # pythonfmu cannot interpolate
        system = System(
            name="s",
            components=dict.fromkeys("abcd", str(tiny)),
            connections=[Connection("d.y", "a.u"), Connection("a.y", "b.u", timing), Connection("b.y", "c.u", timing)],
            held={"d.u": 1.0},
            parameters={"a.k": 0.7, "b.k": 1.3, "c.k": 1.1},
        )
        rows = []
        for kernel in ("never", "auto"):
            setup = Experiment(stop_time=2.5, communication_step_size=0.1, master=Explicit(kernel=kernel), every=3)
            rows.append(simulate(dataclasses.replace(system, steps=steps), setup).table)
        assert rows[0].equals(rows[1])
        assert rows[0]["c.y"][-1].as_py() > 0.01

    def test_failing_step(self, tiny, experiment):
        system = System(
            name="s",
            components={"a": str(tiny), "b": str(tiny)},
            connections=[Connection("a.y", "b.u")],
            held={"a.u": 99.0},
        )
        with pytest.raises(StepFailed, match=r"b returned fmi2(Error|Fatal) at communication point 1.1 s") as caught:
            simulate(system, experiment(stop_time=5.0))
        assert "u is 108.9, more than 100" in str(caught.value)
        assert caught.value.result.time[-1] == 1.1

    def test_refused_initialization_has_the_words_of_the_fmu(self, tiny, tmp_path, experiment):
        system = System(name="s", components={"a": str(tiny)}, held={"a.u": 0.0}, parameters={"a.k": -1.0})
        with pytest.raises(InitializationFailed) as caught:
            simulate(system, experiment(), out=tmp_path / "out")
        assert str(caught.value).startswith("a cannot be initialized: fmi2ExitInitializationMode returned fmi2")
        assert "k is -1, but must not be negative (n 3, label " in str(caught.value)
        assert not (tmp_path / "out").exists()

    def test_same_file_name_new_content(self, tiny, tmp_path):
        """A rebuilt FMU is read again, not taken from the cache."""
        path = tmp_path / "Tiny.fmu"
        path.write_bytes(tiny.read_bytes())
        first = FmuSlave("a", path)
        tiny_fmu.changed(tiny, path, xml=lambda text: text.replace("by hand", "by another hand"))
        os.utime(path, ns=(1, 1))
        second = FmuSlave("a", path)
        assert first._fmu.unzipDirectory != second._fmu.unzipDirectory

    def test_once_per_process_gets_its_own_copy(self, tiny, tmp_path):
        path = tiny_fmu.changed(
            tiny,
            tmp_path / "Tiny.fmu",
            xml=lambda text: text.replace('OncePerProcess="false"', 'OncePerProcess="true"'),
        )
        a, b = FmuSlave("a", path), FmuSlave("b", path)
        assert a._fmu.unzipDirectory != b._fmu.unzipDirectory


class TestBadFiles:
    def test_missing(self, tmp_path):
        with pytest.raises(FmuError, match=r"none.fmu: there is no such file"):
            read_description(tmp_path / "none.fmu")

    def test_no_archive(self, tmp_path):
        path = tmp_path / "text.fmu"
        path.write_text("hello")
        with pytest.raises(FmuError, match="it is not an FMU, for it is no readable zip archive"):
            read_description(path)

    def test_no_description(self, tiny, tmp_path):
        path = tiny_fmu.changed(tiny, tmp_path / "a.fmu", keep=lambda name: name != "modelDescription.xml")
        with pytest.raises(FmuError, match=r"it is not an FMU, for there is no modelDescription.xml inside"):
            read_description(path)

    @pytest.mark.parametrize(
        "damage",
        [
            lambda text: text[: len(text) // 2],
            lambda text: text.replace('valueReference="', 'reference="'),
            lambda text: text.replace("<ModelVariables>", "<Variables>").replace("</ModelVariables>", "</Variables>"),
            lambda text: text.replace('index="3"', 'index="99"'),
            lambda text: "",
        ],
    )
    def test_damaged_description(self, tiny, tmp_path, damage):
        path = tiny_fmu.changed(tiny, tmp_path / "a.fmu", xml=damage)
        with pytest.raises(FmuError, match=r"a.fmu: its modelDescription.xml is damaged: ."):
            read_description(path)

    def test_other_version(self, tiny, tmp_path):
        path = tiny_fmu.changed(
            tiny, tmp_path / "a.fmu", xml=lambda t: t.replace('fmiVersion="2.0"', 'fmiVersion="4.0"')
        )
        with pytest.raises(FmuError, match=r"it is of FMI version 4.0, needed is 1.0, 2.0 or 3.0"):
            read_description(path)

    def test_no_binary_for_this_platform(self, tiny, tmp_path):
        other = "win64" if fmpy.platform != "win64" else "linux64"
        end = ".dll" if other == "win64" else ".so"
        path = tiny_fmu.changed(
            tiny,
            tmp_path / "a.fmu",
            keep=lambda n: not n.startswith("binaries") or n.endswith("Tiny" + n[-3:]),
            rename=lambda n: f"binaries/{other}/Tiny{end}" if n.startswith("binaries") else n,
        )
        with pytest.raises(FmuError, match=f"no binary for this platform: needed {fmpy.platform}, there: {other}"):
            FmuSlave("a", path)

    def test_broken_binary_leaves_the_working_directory(self, tiny, tmp_path):
        path = tmp_path / "a.fmu"
        with zipfile.ZipFile(tiny) as old, zipfile.ZipFile(path, "w") as new:
            new.writestr("modelDescription.xml", old.read("modelDescription.xml"))
            for name in old.namelist():
                if name.startswith(f"binaries/{fmpy.platform}/"):
                    new.writestr(name, b"not a library")
        here = os.getcwd()
        with pytest.raises(FmuError, match="its binary cannot be loaded"):
            FmuSlave("a", path)
        assert os.getcwd() == here
