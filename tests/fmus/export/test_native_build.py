"""Native FMUs: what is in them, how they are built again."""

import ctypes
import shutil
import subprocess
import zipfile

import fmpy
import pytest
from fmpy.build import build_platform_binary
from numpy.testing import assert_array_equal

from components.framework import Component, Condition, Output, Parameter, State
from fmus.errors import BuildError
from fmus.export.native.native_fmu import build_native, describe_native, native_sources
from fmus.toolchain import find_compiler, host_platform

from .compiling import complaints
from .parts import Braces, Gain, Integrator, Modes, Plain, Sum, Swing, Wheel, every
from .slaves import Slave, unpack

PARTS = every()
all_parts = pytest.mark.parametrize("name", PARTS)


@pytest.mark.parametrize("name", ["Swing", "Sum"])
def test_rebuild_is_byte_identical(fmus, tmp_path, name):
    again = build_native(type(PARTS[name])(), tmp_path / "elsewhere" / f"{name}.fmu")
    assert again.read_bytes() == fmus(name).read_bytes()


def test_guid_follows_interface_and_equations():
    class Doubled(Gain):
        """Another equation."""

        def outputs(self, t, x, u, p):
            return {"y": 2 * p.k * u.u * (1 + t)}

    def guid(component, name="Gain"):
        header = native_sources(component, describe_native(component, name))["model.h"].decode()
        return header.partition("MODEL_GUID ")[2]

    guids = [guid(Gain()), guid(Gain(k=4.0)), guid(Gain(), "Other"), guid(Doubled())]
    assert len(set(guids)) == 4
    assert guid(Gain()) == guids[0]


def test_content_of_an_fmu(fmus):
    with zipfile.ZipFile(fmus("Swing")) as archive:
        names = archive.namelist()
        assert all(entry.date_time == (1980, 1, 1, 0, 0, 0) for entry in archive.infolist())
        headers = [archive.read(n).decode() for n in names if n.startswith("sources/fmi2") and n.endswith(".h")]
    suffix = {"linux64": "so", "win64": "dll", "darwin64": "dylib"}[host_platform()]
    assert names[0] == "modelDescription.xml"
    assert f"binaries/{host_platform()}/Swing.{suffix}" in names
    assert len(headers) == 3
    assert all("2-Clause BSD License" in text and "Modelica Association" in text for text in headers)


@all_parts
def test_sources_compile_without_a_warning(fmus, tmp_path, name):
    sources = fmus(name).with_suffix("") / "sources"
    assert complaints(sources, "-o", str(tmp_path / "out"), "-lm") == ""


@pytest.mark.skipif(host_platform() != "linux64" or not shutil.which("nm"), reason="nm reads the libraries of Linux")
@all_parts
def test_symbols(fmus, name):
    """Only fmi2 functions are exported; nothing is needed but libc and libm."""
    library = fmus(name).with_suffix("") / "binaries" / "linux64" / f"{name}.so"
    listed = subprocess.run(["nm", "-D", str(library)], capture_output=True, text=True, check=True).stdout.split("\n")
    entries = [line.split()[-2:] for line in listed if line]
    exported = {n for kind, n in entries if kind not in "Uw"}
    assert {n[:4] for n in exported} == {"fmi2"}
    co_simulation = {n for n in dir(fmpy.fmi2.FMU2Slave) if n.startswith("fmi2")}
    assert co_simulation <= exported
    needed = {n.partition("@")[0] for kind, n in entries if kind == "U"}
    own = ctypes.CDLL(None)
    maths = ctypes.CDLL("libm.so.6")
    assert [n for n in needed if not (hasattr(own, n) or hasattr(maths, n))] == []
    assert not needed & {"realloc", "printf", "abort", "exit"}


def test_sources_rebuild_the_binary(fmus, tmp_path):
    """With fmpy and CMake where there is one, else by hand: the same numbers come out."""
    folder = tmp_path / "Swing"
    shutil.copytree(fmus("Swing").with_suffix(""), folder)
    shutil.rmtree(folder / "binaries")
    if shutil.which("cmake"):
        build_platform_binary(folder, all_warnings=True)
    else:
        library = folder / "binaries" / host_platform() / f"Swing{fmpy.sharedLibraryExtension}"
        library.parent.mkdir(parents=True)
        command = [*find_compiler(), "-shared", "-fPIC", "-O1", "sources/fmi2.c", "-o", str(library), "-lm"]
        subprocess.run(command, cwd=folder, check=True)
    rows = []
    for place in (folder, fmus("Swing").with_suffix("")):
        slave = Slave(place).start()
        slave.doStep(0.0, 0.5)
        rows.append(slave.everything())
        slave.freeInstance()
    assert_array_equal(*rows)


def test_only_existing_functions_are_generated():
    code = {n: native_sources(c, describe_native(c, n))["model.c"].decode() for n, c in PARTS.items()}
    assert " rates(" not in code["Gain"] and " advance(" not in code["Gain"]
    assert " outputs(" not in code["Autonomous"]
    assert " update(" in code["Sum"] and " update(" not in code["Swing"]
    assert code["Swing"].count("/* rates:") == 1  # advance calls the one that is exported


def test_refusals(tmp_path):
    with pytest.raises(BuildError, match=r"Plain is written in plain Python.*--backend python"):
        build_native(Plain(), tmp_path / "Plain.fmu")
    with pytest.raises(BuildError, match=r'unknown platform "beos". Platforms: host, all, linux64, win64, darwin64'):
        build_native(Gain(), tmp_path / "Gain.fmu", platforms=("beos",))
    assert list(tmp_path.iterdir()) == []


class Numbers(Braces):
    """A text with another number of fields than numbers."""

    def check(self, t, x, u, p):
        return [Condition(p.k, "{} and {}", (p.k,))]


class Momentless(Component):
    """A step mean without a continuous state."""

    y = Output(unit="1/s", step_mean=True, doc="rate of nothing")

    def step_means(self, t, x, p):
        return {"y": t}


def test_components_that_contradict_themselves(tmp_path):
    with pytest.raises(BuildError, match=r"has not one \{\} for each of the 1 numbers"):
        build_native(Numbers(), tmp_path / "Numbers.fmu")
    with pytest.raises(BuildError, match="there are no continuous states"):
        build_native(Momentless(), tmp_path / "Momentless.fmu")


def test_an_fmu_may_have_another_name(tmp_path):
    slave = Slave(unpack(build_native(Gain(), tmp_path / "small.fmu", model_name="Amplifier"))).start()
    assert slave.description.modelName == slave.description.coSimulation.modelIdentifier == "Amplifier"
    slave.freeInstance()


def test_zero_size_arrays_are_nowhere(fmus):
    """Modes_0 has states, parameters, inputs and outputs of size zero, and solver.step, which is automatic."""
    slave = Slave(fmus("Modes_0").with_suffix("")).start()
    slave.doStep(0.0, 1.0)
    assert slave.everything() == [0.0]
    slave.freeInstance()


def test_parts_cover_what_can_be_declared():
    """A reminder for whoever adds a kind of variable: Sum, Wheel and Swing are what is tested above."""
    assert {
        type(v) for c in (Swing(), Wheel(), Sum(), Integrator(), Modes(modes=1)) for v in c._variables.values()
    } == {
        Parameter,
        Output,
        State,
        *{type(v) for v in (*Swing().calculated_parameters, *Swing().inputs)},
    }
