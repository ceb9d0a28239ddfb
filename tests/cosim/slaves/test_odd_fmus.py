"""FMUs of FMI 2.0 that are less than whole, or other than usual: they fly, or the reason is told by name."""

import gc
import subprocess
import zipfile
from pathlib import Path

import fmpy
import pytest

from cosim import Experiment, System, prepare, simulate
from cosim.errors import FmuError, InitializationFailed, StepFailed, UnknownName
from cosim.masters.explicit import Explicit
from cosim.masters.kernel import library as kernels
from fmus import places, toolchain

from .. import arrays_fmu, ball_fmu, c_fmu, tiny_fmu
from ..c_fmu import real

MORE_C = """#include <stdlib.h>
#include <string.h>
#include "own.h"
static int own = OWN;
double more(void) { char *text = strdup("yes"); double y = text[0] == 'y' ? own : 0; free(text); return y; }
"""
MORE = "static double more(void) { return 5; }"
STEP = "m->state[0] += h * u;"
OPTIONAL = ("CancelStep", "GetFMUstate", "SetFMUstate", "FreeFMUstate", "SerializedFMUstateSize", "SerializeFMUstate",
            "DeSerializeFMUstate", "GetDirectionalDerivative", "GetStatus", "GetRealStatus", "SetDebugLogging",
            "SetString", "GetString", "GetBooleanStatus", "GetIntegerStatus", "GetStringStatus", "Reset")  # fmt: skip

pytestmark = pytest.mark.skipif(not tiny_fmu.COMPILED, reason="these FMUs are compiled for Linux")


def integrator(folder, template=c_fmu.C, **more):
    """y' = u, u = 2 at its start."""
    variables = [real("u", "input", start=2.0), real("y")]
    return c_fmu.build(folder, "I", variables, outputs="y = m->state[0];", step=STEP, template=template, **more)


def lacking(*functions):
    template = c_fmu.C
    for name in functions:
        template = template.replace(f" fmi2{name}(", f" lost_{name}(")
    return template


def fly(path, master=None, **more):
    system = System(name="s", components={"a": str(path)}, hold_unconnected=True)
    return simulate(system, Experiment(stop_time=1.0, communication_step_size=0.25, master=master, **more))


@pytest.mark.parametrize("kernel", ["never", "always"])
def test_without_functions_that_it_does_not_need(tmp_path, kernel):
    path = integrator(tmp_path, lacking(*OPTIONAL), canGetAndSetFMUstate=False, canSerializeFMUstate=False)
    result = fly(path, Explicit(kernel=kernel))
    assert (result.info["loop"]["name"] == "kernel") == (kernel == "always")
    assert result["a.y"].tolist() == [0.0, 0.5, 1.0, 1.5, 2.0]


@pytest.mark.parametrize("kernel", ["never", "always"])
def test_a_function_that_it_lacks_and_needs_fails_by_name(tmp_path, kernel):
    """It says that its step is pending, and cannot be asked for how long."""
    template = lacking("GetStatus", "CancelStep").replace("int status = step(m, t, h);", "int status = fmi2Pending;")
    with pytest.raises(StepFailed, match="a returned fmi2Pending at communication point 0 s") as caught:
        fly(integrator(tmp_path, template), Explicit(kernel=kernel))
    assert "the FMU has no function fmi2GetStatus" in str(caught.value)


def test_without_the_step_itself(tmp_path):
    with pytest.raises(FmuError, match="its binary cannot be loaded: it has no function fmi2DoStep"):
        fly(integrator(tmp_path, lacking("DoStep")))


def test_a_binary_of_another_name(tmp_path):
    path = integrator(tmp_path)
    other = tiny_fmu.changed(path, tmp_path / "o.fmu", rename=lambda n: n.replace("/I.so", "/Other.so"))
    assert fly(other)["a.y"][-1] == 2.0


def test_a_model_identifier_that_is_no_identifier_of_c(tmp_path):
    path = integrator(tmp_path)
    other = tiny_fmu.changed(
        path,
        tmp_path / "o.fmu",
        xml=lambda text: text.replace('modelIdentifier="I"', 'modelIdentifier="wave-2 (old)"'),
        rename=lambda n: n.replace("/I.so", "/wave-2 (old).so"),
    )
    assert fly(other)["a.y"][-1] == 2.0


@pytest.mark.parametrize("kernel", ["never", "always"])
def test_functions_with_the_prefix_of_sources(tmp_path, kernel):
    """FMI: in sources each name follows the model identifier; some are compiled so."""
    template = "#define FMI2_FUNCTION_PREFIX I_\n" + c_fmu.C
    assert fly(integrator(tmp_path, template), Explicit(kernel=kernel))["a.y"][-1] == 2.0


def test_start_values_that_are_missing(tmp_path):
    path = integrator(tmp_path)
    bare = tiny_fmu.changed(path, tmp_path / "b.fmu", xml=lambda text: text.replace(' start="2.0"', ""))
    result = fly(bare)
    assert result["a.u"].tolist() == [0.0] * 5  # it is held at 0, and told so
    assert result.info["held"]["a.u"]["value"] == 0.0


def test_another_guid_than_the_binarys(tmp_path):
    said = (
        'const fmi2CallbackFunctions *f0 = f; if (strcmp(g, "{I}")) { f0->logger(f0->componentEnvironment, a, '
        'fmi2Error, "x", "GUID %s is not {I}", g); return 0; } Instance *c = calloc'
    )
    path = integrator(tmp_path, c_fmu.C.replace("Instance *c = calloc", said))
    assert fly(path).info["status"] == "finished"
    other = tiny_fmu.changed(path, tmp_path / "g.fmu", xml=lambda text: text.replace('guid="{I}"', 'guid="{J}"'))
    with pytest.raises(InitializationFailed) as caught:
        fly(other)
    told = str(caught.value)
    assert "a cannot be initialized: fmi2Instantiate returned no instance" in told
    assert "GUID {J} is not {I}" in told


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('name="y"', 'name="u"', "two variables have one name, 'u' and 'u'|is not unique"),
        ('valueReference="1"', 'valueReference="4294967296"', "4294967296"),
        ('valueReference="1"', 'valueReference="-1"', "-1"),
        ('index="2"', 'index="7"', "out of range"),
    ],
)
def test_names_and_references_that_cannot_be(tmp_path, old, new, words):
    path = tiny_fmu.changed(integrator(tmp_path), tmp_path / "x.fmu", xml=lambda text: text.replace(old, new))
    with pytest.raises(FmuError, match=words):
        fly(path)


class TestOncePerProcess:
    def counted(self):
        """How many folders of extracted FMUs this process has, and mappings of its library."""
        mapped = [line for line in Path("/proc/self/maps").read_text().splitlines() if "I.so" in line]
        return len(list(places.extracted().iterdir())), len(mapped)

    @pytest.mark.parametrize("kernel", ["never", "always"])
    def test_a_hundred_runs_share_one_copy(self, tmp_path, kernel):
        path = integrator(tmp_path, canBeInstantiatedOnlyOncePerProcess=True)
        folders, mappings = self.counted()
        for _ in range(100):
            assert fly(path, Explicit(kernel=kernel))["a.y"].tolist() == [0.0, 0.5, 1.0, 1.5, 2.0]
        assert self.counted() == (folders + 1, mappings)

    def test_a_library_is_mapped_while_it_flies(self, tmp_path):
        """What the count of mappings above can see."""
        system = System(
            name="s",
            components={"a": str(integrator(tmp_path, canBeInstantiatedOnlyOncePerProcess=True))},
            hold_unconnected=True,
        )
        mappings = self.counted()[1]
        with prepare(system) as prepared:
            prepared.fly(Experiment(stop_time=1.0, communication_step_size=0.25))
            assert self.counted()[1] > mappings

    def test_a_prepared_system_that_failed_and_one_that_is_given_up(self, tmp_path):
        path = integrator(tmp_path, canBeInstantiatedOnlyOncePerProcess=True)
        system = System(name="s", components={"a": str(path)}, hold_unconnected=True)
        folders = self.counted()[0]
        for _ in range(5):
            with prepare(system) as prepared, pytest.raises(UnknownName):
                prepared.fly(Experiment(stop_time=1.0, communication_step_size=0.25, record="a.none"))
        gc.collect()  # an exception and its frames know each other
        with prepare(system) as prepared:
            for _ in range(3):
                prepared.fly(Experiment(stop_time=1.0, communication_step_size=0.25))
        assert self.counted()[0] <= folders + 2

    def test_two_at_once_have_two(self, tmp_path):
        path = integrator(tmp_path, canBeInstantiatedOnlyOncePerProcess=True)
        system = System(name="s", components={"a": str(path), "b": str(path)}, hold_unconnected=True)
        before = self.counted()
        result = simulate(system, Experiment(stop_time=1.0, communication_step_size=0.25))
        assert result["b.y"].tolist() == result["a.y"].tolist()
        gc.collect()
        assert self.counted()[0] == before[0] + 2


class TestLibrariesThatItNeeds:
    def needing(self, folder, name, *, beside, flags=()):
        """The integrator, whose step asks a library, of a name that no other test loads, for the factor 3."""
        source = folder / "needed.c"
        source.write_text("double needed(void) { return 3; }")
        needed = folder / name
        compiler = toolchain.find_compiler()
        subprocess.run([*compiler, "-shared", "-fPIC", source, f"-Wl,-soname,{name}", "-o", needed], check=True)
        path = integrator(folder)
        made = folder / "I-source"
        code = (made / "fmu.c").read_text().replace(STEP, "m->state[0] += needed() * h * u;")
        (made / "more.c").write_text(f"double needed(void);\n{code}")
        include = f"-I{Path(fmpy.__file__).parent / 'c-code'}"
        command = [*compiler, "-shared", "-fPIC", "-w", include, made / "more.c", "-o", made / "I.so", needed, *flags]
        subprocess.run([*command, "-Wl,-soname,I.so"], check=True)
        target = folder / "needing.fmu"
        with zipfile.ZipFile(path) as old, zipfile.ZipFile(target, "w") as new:
            new.writestr("modelDescription.xml", old.read("modelDescription.xml"))
            new.write(made / "I.so", f"binaries/{fmpy.platform}/I.so")
            if beside:
                new.write(needed, f"binaries/{fmpy.platform}/{name}")
        needed.unlink()
        return target

    def test_beside_it_with_a_way_there(self, tmp_path):
        path = self.needing(tmp_path, "libaside.so", beside=True, flags=["-Wl,-rpath,$ORIGIN"])
        assert fly(path)["a.y"][-1] == 6.0

    def test_beside_it_without_one(self, tmp_path):
        with pytest.raises(FmuError) as caught:
            fly(self.needing(tmp_path, "liblost.so", beside=True))
        told = str(caught.value)
        assert "its binary cannot be loaded: it needs the library" in told
        assert "liblost.so: it lies beside I.so, which does not look there" in told
        assert "LD_LIBRARY_PATH=" in told

    def test_not_there_at_all(self, tmp_path):
        with pytest.raises(FmuError, match=r"libnowhere.so, which is not on this machine: install it, or set LD_LIB"):
            fly(self.needing(tmp_path, "libnowhere.so", beside=False))


class TestSources:
    @pytest.mark.parametrize("version", ["2", "3"])
    def test_without_a_binary_they_are_compiled(self, tmp_path, version):
        """The ball of FMI 2.0, listed in modelDescription.xml, and the arrays of 3.0, with a list of their own."""
        if version == "2":
            path = ball_fmu.build(tmp_path, binary=False)
            assert fly(path)["a.bounces"][-1] == 1
            return
        whole = arrays_fmu.build(tmp_path)
        path = tiny_fmu.changed(whole, tmp_path / "s.fmu", keep=lambda name: not name.startswith("binaries"))
        code = (tmp_path / "arrays-source" / "fmu.c").read_text().replace("h * m->u[i]", "FACTOR * h * m->u[i]")
        listed = (
            '<fmiBuildDescription fmiVersion="3.0"><BuildConfiguration modelIdentifier="Arrays">'
            '<SourceFileSet language="C99"><SourceFile name="fmu.c"/><PreprocessorDefinition name="FACTOR" value="2"/>'
            "</SourceFileSet></BuildConfiguration></fmiBuildDescription>"
        )
        with zipfile.ZipFile(path, "a") as archive:
            archive.writestr("sources/fmu.c", code)
            archive.writestr("sources/buildDescription.xml", listed)
        system = System(name="s", components={"a": str(path)}, hold_unconnected=True, held={"a.u": [1.0, 0.0, 0.0]})
        result = simulate(system, Experiment(stop_time=1.0, communication_step_size=0.25))
        assert result["a.x[1]"][-1] == 7.0

    def test_several_sources_each_on_its_own(self, tmp_path):
        """With names of their own that are the same, functions with a prefix, and what C99 alone does not have."""
        template = f"#define FMI2_FUNCTION_PREFIX I_\ndouble more(void);\nstatic int own = 3;\n{c_fmu.C}"
        variables = [real("u", "input", start=2.0), real("y")]
        code = {"outputs": "y = m->state[0];", "step": "m->state[0] += own * more() * h * u;"}
        path = c_fmu.build(tmp_path, "I", variables, template=template.replace("double more(void);", MORE), **code)
        files = "".join(f'<File name="{name}"/>' for name in ("fmu.c", "sub/more.c", "sub/own.h"))
        listed = f"<SourceFiles>{files}</SourceFiles></CoSimulation>"
        source = (tmp_path / "I-source" / "fmu.c").read_text().replace(MORE, "double more(void);")
        with zipfile.ZipFile(path) as old, zipfile.ZipFile(tmp_path / "s.fmu", "w") as new:
            xml = old.read("modelDescription.xml").decode()
            head, tail = xml[: (end := xml.index("/>", xml.index("<CoSimulation")))], xml[end + 2 :]
            new.writestr("modelDescription.xml", f"{head}>{listed}{tail}")
            new.writestr("sources/fmu.c", source)
            new.writestr("sources/sub/more.c", MORE_C)
            new.writestr("sources/sub/own.h", "#include <math.h>\n#define OWN (M_PI > 3 ? 5 : 0)")
        assert fly(path)["a.y"][-1] == fly(tmp_path / "s.fmu")["a.y"][-1] == 2.0 * 3 * 5

    def test_what_does_not_compile_is_told(self, tmp_path):
        path = ball_fmu.build(tmp_path, binary=False)
        with zipfile.ZipFile(path) as old, zipfile.ZipFile(tmp_path / "b.fmu", "w") as new:
            new.writestr("modelDescription.xml", old.read("modelDescription.xml"))
            new.writestr("sources/ball.c", "this is no C")
        with pytest.raises(FmuError, match=r"it has no binary for \w+, and its sources cannot be compiled"):
            fly(tmp_path / "b.fmu")

    def test_what_is_not_listed(self, tmp_path):
        text = ball_fmu.XML.replace('<SourceFiles><File name="ball.c"/></SourceFiles>', "")
        path = ball_fmu.build(tmp_path, text, binary=False)
        with pytest.raises(FmuError, match=r"and its modelDescription\.xml lists no sources"):
            fly(path)


def test_resources_are_where_it_is_told(tmp_path):
    """The FMU reads its factor from resources/factor.txt, by the URI that fmi2Instantiate gives."""
    reads = (
        'Instance *c = calloc(1, sizeof *c); char place[4096]; snprintf(place, sizeof place, "%s/factor.txt", r + 7);'
        ' FILE *file = fopen(place, "r"); if (!file || fscanf(file, "%lf", &c->all.state[0]) != 1) return 0;'
    )
    template = c_fmu.C.replace("Instance *c = calloc(1, sizeof *c);", reads)
    path = integrator(tmp_path, template)
    with zipfile.ZipFile(path, "a") as archive:
        archive.writestr("resources/factor.txt", "40")
    assert fly(path)["a.y"].tolist() == [40.0, 40.5, 41.0, 41.5, 42.0]


def test_the_kernel_is_here():
    assert kernels.library() is not None
