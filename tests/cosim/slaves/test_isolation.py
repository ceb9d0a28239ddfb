"""FMUs in processes of their own: the same numbers, and ends of all kinds that leave the master alive."""
# ruff: noqa: E501 (C)

import os
import time
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from cosim import Connection, Experiment, System, prepare, simulate
from cosim.errors import FmuError, InitializationFailed, StepFailed, TimeError, UnknownName
from cosim.masters.explicit import Explicit
from cosim.masters.iterated import Iterated

from .. import arrays_fmu, c_fmu, tiny_fmu
from ..c_fmu import real
from ..typed_fmu import ITEMS, NAMES, typed

STEPS = Experiment(stop_time=1.0, communication_step_size=0.25)

pytestmark = pytest.mark.skipif(not tiny_fmu.COMPILED, reason="these FMUs are compiled for Linux")


def ending(folder, code="", template=c_fmu.C, name="Ends"):
    """y' = u, with code in its step."""
    variables = [real("u", "input", start=2.0), real("y")]
    return c_fmu.build(
        folder, name, variables, outputs="y = m->state[0];", step=f"m->state[0] += h * u; {code}", template=template
    )


def alone(path, **more):
    return System(name="s", components={"a": str(path)}, hold_unconnected=True, isolated=["a"], **more)


def lost(path, experiment=STEPS, out=None):
    with pytest.raises(StepFailed) as caught:
        simulate(alone(path), experiment, out=out)
    return caught.value


class TestTheSameNumbers:
    def test_every_type_in_both_directions(self, tmp_path):
        path = str(typed(tmp_path))
        system = System(
            name="s",
            components={"a": path, "b": path},
            connections=[Connection(f"a.{kind}", f"b.{kind}_in") for kind in NAMES],
            hold_unconnected=True,
        )
        steps = Experiment(stop_time=2.0, communication_step_size=0.25, master=Explicit(kernel="never"))
        here, both = simulate(system, steps), simulate(_isolated(system, "*"), steps)
        one = simulate(_isolated(system, "b"), steps)
        assert here.table.equals(both.table)
        assert here.table.equals(one.table)
        assert set(here["b.e"].tolist()) <= set(ITEMS) | set(ITEMS.values())

    def test_repeated_steps_with_states_and_slopes(self, tmp_path):
        """The iterated master saves states and gives derivatives of inputs."""
        path = str(ending(tmp_path, "m->state[0] += 0.5 * h * h * m->slope[0];"))
        system = System(
            name="s",
            components={"a": path, "b": path},
            connections=[Connection("a.y", "b.u", "ramp"), Connection("b.y", "a.u", "ramp")],
        )
        steps = Experiment(stop_time=1.0, communication_step_size=0.25, master=Iterated(inputs="ramp"))
        here, there = simulate(system, steps), simulate(_isolated(system, "*"), steps)
        assert here.table.equals(there.table)

    def test_fmi3(self, tmp_path):
        path = arrays_fmu.build(tmp_path)
        held = {"a.u": [1.0, 2.0, 3.0], "a.s_in": "x", "a.Int64_in": 2**53 - 1}
        result = simulate(alone(path, held=held, parameters={"a.x0": [0, 0, 1]}), STEPS)
        assert_array_equal(result["a.x"], np.array([0.0, 0.0, 1.0]) + np.outer(result.time, [1, 2, 3]))
        assert (result["a.Int64_out"][-1], result["a.s"][-1]) == (2**53, "<x")

    def test_a_prepared_system_flies_again(self, tmp_path):
        with prepare(alone(ending(tmp_path))) as prepared:
            first, second = prepared.fly(STEPS), prepared.fly(STEPS)
        assert first.table.equals(second.table)
        assert first["a.y"].tolist() == [0.0, 0.5, 1.0, 1.5, 2.0]
        assert first.info["loop"] == {**first.info["loop"], "name": "python", "reason": "a has no interface in C"}

    def test_messages_warnings_and_errors_of_the_fmu(self, tmp_path):
        say = (
            "const fmi2CallbackFunctions *f = ((Instance *)m)->f; if (t > 0.4) { f->logger(f->componentEnvironment, "
            '"a", fmi2Error, "x", "it is %g", t); return fmi2Error; } return fmi2Warning;'
        )
        error = lost(ending(tmp_path, say))
        assert str(error) == "a returned fmi2Error at communication point 0.5 s, step 0.25 s\n    it is 0.5"
        assert error.result.info["fmi2Warning"]["a"]["fmi2DoStep"] == {"count": 2, "first": 0.0}

    def test_one_that_asks_for_the_end(self, tmp_path):
        yes = c_fmu.C.replace(
            "fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind k, fmi2Boolean *x) { return fmi2Discard; }",
            "fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind k, fmi2Boolean *x) { *x = 1; return fmi2OK; }",
        )
        result = simulate(alone(ending(tmp_path, "if (t >= 0.5) return fmi2Discard;", yes)), STEPS)
        assert (result.info["status"], result.time[-1]) == ("finished", 0.5)


def _isolated(system, *names):
    from dataclasses import replace

    return replace(system, isolated=names)


class TestEnds:
    @pytest.mark.parametrize(
        ("code", "words"),
        [
            ("*(volatile int *)0 = 1;", "was ended by SIGSEGV"),
            ("abort();", "was ended by SIGABRT"),
            ("exit(3);", "has ended itself, with exit status 3"),
            ("exit(0);", "has ended itself, with exit status 0"),
        ],
    )
    def test_in_a_step(self, tmp_path, code, words):
        error = lost(ending(tmp_path, f"if (t >= 0.5) {code}"), out=tmp_path / "out")
        assert str(error) == f"a was lost at communication point 0.5 s, step 0.25 s: in fmi2DoStep its process {words}"
        assert error.result["a.y"].tolist() == [0.0, 0.5, 1.0]
        assert (tmp_path / "out" / "run.json").is_file()

    def test_a_hang_is_ended_after_the_timeout(self, tmp_path):
        begun = time.monotonic()
        error = lost(
            ending(tmp_path, "while (t >= 0.5) { struct timespec s = {1, 0}; nanosleep(&s, 0); }"),
            Experiment(stop_time=1.0, communication_step_size=0.25, isolation_timeout=0.6),
        )
        assert "in fmi2DoStep it has not returned within 0.6 s (isolation_timeout), and was ended" in str(error)
        assert error.result.time[-1] == 0.5
        assert time.monotonic() - begun < 30

    def test_in_instantiate(self, tmp_path):
        template = c_fmu.C.replace("Instance *c = calloc", "if (a) abort(); Instance *c = calloc")
        with pytest.raises(InitializationFailed) as caught:
            simulate(alone(ending(tmp_path, template=template)), STEPS)
        assert str(caught.value) == "a cannot be initialized: in fmi2Instantiate its process was ended by SIGABRT"

    def test_in_the_end_of_initialization(self, tmp_path):
        template = c_fmu.C.replace("{ MEMORY; (void)i; return initialized(m); }", "{ exit(1); }")
        with pytest.raises(InitializationFailed, match="in fmi2ExitInitializationMode its process has ended itself"):
            simulate(alone(ending(tmp_path, template=template)), STEPS)

    def test_in_free(self, tmp_path, caplog):
        template = c_fmu.C.replace("{ free(c); }", "{ abort(); }")
        result = simulate(alone(ending(tmp_path, template=template)), STEPS)
        assert (result.info["status"], result["a.y"][-1]) == ("finished", 2.0)
        assert "a: in fmi2FreeInstance its process was ended by SIGABRT" in caplog.text

    def test_while_its_library_is_loaded(self, tmp_path):
        template = c_fmu.C + "\n__attribute__((constructor)) static void dies(void) { abort(); }\n"
        with pytest.raises(FmuError, match="its binary cannot be loaded: its process was ended by SIGABRT"):
            simulate(alone(ending(tmp_path, template=template)), STEPS)

    def test_after_a_loss_the_system_flies_again(self, tmp_path):
        flag = tmp_path / "flag"
        code = f'FILE *f = fopen("{flag}", "r"); if (f && t >= 0.5) abort(); if (f) fclose(f);'
        with prepare(alone(ending(tmp_path, code))) as prepared:
            flag.write_text("die")
            with pytest.raises(StepFailed):
                prepared.fly(STEPS)
            flag.unlink()
            assert prepared.fly(STEPS)["a.y"][-1] == 2.0

    def test_what_is_not_isolated_is_not_touched(self, tmp_path):
        """b dies in its own process; a flies in this one, whose run is told, and ends."""
        folders = [tmp_path / name for name in "ab"]
        for folder in folders:
            folder.mkdir()
        dies = ending(folders[1], "if (t >= 0.5) abort();", name="Dies")
        system = System(
            name="s",
            components={"a": str(ending(folders[0])), "b": str(dies)},
            connections=[Connection("a.y", "b.u")],
            hold_unconnected=True,
            isolated=["b"],
        )
        with pytest.raises(StepFailed, match=r"b was lost at communication point 0\.5 s") as caught:
            simulate(system, STEPS)
        assert caught.value.result["a.y"].tolist() == [0.0, 0.5, 1.0]

    def test_its_process_goes_with_it(self, tmp_path):
        pids = tmp_path / "pids"
        code = f'FILE *f = fopen("{pids}", "w"); fprintf(f, "%ld", (long)getpid()); fclose(f);'
        template = c_fmu.C.replace("#include <time.h>", "#include <time.h>\n#include <unistd.h>")
        simulate(alone(ending(tmp_path, code, template)), STEPS)
        pid = int(pids.read_text())
        assert pid != os.getpid()
        assert not Path(f"/proc/{pid}").exists()


class TestWhatIsAskedFor:
    def test_an_unknown_instance(self, tmp_path):
        system = _isolated(alone(ending(tmp_path)), "b")
        with pytest.raises(UnknownName, match=r'unknown component "b" in isolated\. There: a\.'):
            simulate(system, STEPS)

    def test_a_timeout_that_is_none(self, tmp_path):
        steps = Experiment(stop_time=1.0, communication_step_size=0.25, isolation_timeout=0.0)
        with pytest.raises(TimeError, match=r"isolation_timeout is 0\.0: it must be above 0 and finite"):
            simulate(alone(ending(tmp_path)), steps)


CLASHING = """
import helper
from pythonfmu import Fmi2Causality, Fmi2Slave, Real

class {name}(Fmi2Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.y = 0.0
        self.register_variable(Real("y", causality=Fmi2Causality.output))

    def do_step(self, t, h):
        self.y += helper.RATE * h
        return True
"""


def clashing(folder, name, rate):
    """An FMU of pythonfmu whose helper has the name of another FMU's helper."""
    from pythonfmu.builder import FmuBuilder

    folder.mkdir()
    (folder / f"{name.lower()}.py").write_text(CLASHING.format(name=name))
    (folder / "helper.py").write_text(f"RATE = {rate}\n")
    FmuBuilder.build_FMU(folder / f"{name.lower()}.py", dest=folder, project_files=[folder / "helper.py"])
    return str(folder / f"{name}.fmu")


@pytest.mark.slow
def test_fmus_of_pythonfmu_whose_modules_clash(tmp_path):
    from concurrent.futures import ThreadPoolExecutor

    components = {"one": clashing(tmp_path / "1", "One", 1.0), "two": clashing(tmp_path / "2", "Two", 2.0)}
    system = System(name="s", components=components, isolated=["*"])
    with prepare(system) as prepared, ThreadPoolExecutor(2) as pool:
        results = list(pool.map(lambda _: prepared.fly(STEPS), range(2)))
    for result in results:
        assert (result["one.y"][-1], result["two.y"][-1]) == (1.0, 2.0)
