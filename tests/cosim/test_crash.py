"""An FMU that ends the process: which one, in which call, when stands on standard error and in run.json."""

import json
import os
import subprocess
import sys
import textwrap
from pathlib import Path

import numpy as np
import pytest

from cosim.results.result import Result
from cosim.slaves import breadcrumb

from . import both, c_fmu
from .c_fmu import real

ROOT = Path(__file__).parents[2]
pytestmark = pytest.mark.skipif(os.name != "posix", reason="there are no signals")

DIE = r"""
#include <sys/wait.h>
#include <unistd.h>
static int deeper(volatile char *from) { char room[4096]; room[0] = *from; return deeper(room) + room[1]; }
static void die(const char *where)
{
    const char *how = getenv("DIE_HOW"), *there = getenv("DIE_WHERE");
    volatile int zero = 0;
    if (!how || !there || strcmp(there, where) != 0) return;
    if (!strcmp(how, "SIGSEGV")) *(volatile int *)8 = 1;
    if (!strcmp(how, "SIGABRT")) abort();
    if (!strcmp(how, "SIGFPE")) zero = 10 / zero;
    if (!strcmp(how, "SIGILL")) __builtin_trap();
    if (!strcmp(how, "exit")) exit(0);
    if (!strcmp(how, "overflow")) exit(deeper("x"));
    if (!strcmp(how, "fork")) { pid_t child = fork(); if (!child) exit(0); waitpid(child, NULL, 0); }
}
__attribute__((constructor)) static void load(void) { die("dlopen"); }
static void start(Memory *m);
"""

PROGRAM = """
import os, sys, threading
from cosim import flights
from tests.cosim import both

FMU = {fmu!r}

def fly(out="out", start=0.0, stop=1.0, name="a"):
    system = both.of({{name: {fmu!r}, "b": {fmu!r}}}, [(name + ".y", "b.u")], held={{name + ".u": 0.0}})
    setup = both.experiment(start + stop, loop={loop!r}, start_time=start)
    return flights.simulate(system, setup, out=out)

"""

ALONE = """
from cosim import Experiment, System

def alone():
    return System(name="alone", components={{"unit": {fmu!r}}}, held={{"unit.u": 0.0}}), Experiment(
        stop_time=1.0, communication_step_size=0.1
    )
"""

DEATHS = {
    "SIGSEGV": (-11, "SIGSEGV, a segmentation fault"),
    "SIGABRT": (-6, "SIGABRT, abort() was called"),
    "SIGFPE": (-8, "SIGFPE, an arithmetic error"),
    "SIGILL": (-4, "SIGILL, an illegal instruction"),
    "overflow": (-11, "SIGSEGV, a segmentation fault"),
    "exit": (1, "it called exit()"),
}
HELP = " Fly another FMU in its place (--use INSTANCE=FMU).\n"
KEPT = " The rows that were written before are in out/result.arrows."


@pytest.fixture(scope="module")
def mortal(tmp_path_factory):
    """y = t, until the environment has it die: DIE_HOW in DIE_WHERE."""
    template = c_fmu.C.replace("static void start(Memory *m);\n", DIE, 1)
    template = template.replace(
        "fmi2Terminate(fmi2Component c) {", 'fmi2Terminate(fmi2Component c) { die("terminate");'
    )
    template = template.replace("FreeInstance(fmi2Component c) {", 'FreeInstance(fmi2Component c) { die("free");')
    template = template.replace("    Instance *c = calloc", '    die("instantiate"); Instance *c = calloc')
    return c_fmu.build(
        tmp_path_factory.mktemp("mortal"),
        "Mortal",
        [real("u", "input"), real("y")],
        template=template,
        step='if (t - m->state[0] > 0.25) die("step"); m->whole[0]++; y = t + h;',
        initialized='die("initialized"); m->state[0] = m->now;',
        on_set='if (m->whole[0] > 2) die("set");',
        on_get='if (m->whole[0] > 2) die("get");',
        refresh=False,
    )


@pytest.fixture
def dies(mortal, tmp_path):
    """Run a program in which the FMU dies; returns the exit status and what it said."""

    def call(code, how="", where="step", loop="always", options=()):
        program = PROGRAM.format(fmu=str(mortal), loop=loop) + textwrap.dedent(code)
        environment = os.environ | {"PYTHONPATH": str(ROOT), "DIE_HOW": how, "DIE_WHERE": where}
        done = subprocess.run(
            [sys.executable, *options, "-c", program],
            cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=60, check=False,
        )  # fmt: skip
        return done.returncode, done.stderr

    return call


@pytest.mark.parametrize("loop", both.LOOPS)
@pytest.mark.parametrize("how", DEATHS)
def test_in_a_step(dies, tmp_path, loop, how):
    status, said = DEATHS[how]
    story = f"a ended the process in fmi2DoStep at communication point 0.3 s: {said}."
    assert dies("fly()", how, loop=loop) == (status, f"FmuCrashed: {story}{KEPT}{HELP}")
    result = Result.read(tmp_path / "out")
    assert [result.info[key] for key in ("status", "error", "why")] == ["crashed", "FmuCrashed", story]
    assert result.info["failure"] == {"component": "a", "function": "fmi2DoStep", "time": 0.3}
    assert result.time[0] == 0.0 and result["a.y"][0] == 0.0 and result.names == ["a.u", "a.y", "b.u", "b.y"]


@pytest.mark.parametrize("loop", both.LOOPS)
@pytest.mark.parametrize("how", ["SIGSEGV", "exit"])
@pytest.mark.parametrize(
    ("where", "function", "time"),
    [
        ("dlopen", "dlopen", None),
        ("instantiate", "fmi2Instantiate", 0.0),
        ("initialized", "fmi2ExitInitializationMode", 0.0),
        ("set", "fmi2SetReal", 0.3),
        ("get", "fmi2GetReal", 0.2),
        ("terminate", "fmi2Terminate", 1.0),
        ("free", "fmi2FreeInstance", None),
    ],
)
def test_in_every_other_call(dies, tmp_path, loop, how, where, function, time):
    """Before the first row nothing is on the disk, and when instances are freed all is written."""
    status, said = DEATHS[how]
    code, text = dies("fly()", how, where, loop)
    when = "" if time is None else f" at communication point {time:g} s"
    story = f"{'b' if where == 'set' else 'a'} ended the process in {function}{when}: {said}."  # a's input is held
    kept = KEPT if where in ("set", "get", "terminate") else ""
    assert (code, text) == (status, f"FmuCrashed: {story}{kept}{HELP}")
    if kept:
        result = Result.read(tmp_path / "out")
        assert (result.info["status"], result.info["why"], result.info["failure"]["time"]) == ("crashed", story, time)
        assert where != "terminate" or result.time[-1] == 1.0
    elif where == "free":
        assert Result.read(tmp_path / "out").info["status"] == "finished"
    else:
        assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("loop", both.LOOPS)
def test_in_a_thread_beside_another_flight(dies, loop):
    """Each thread has its breadcrumb: the one that crashes is told."""
    code = """
        def other():
            while True: fly(out=None, stop=0.2, name="other")
        threading.Thread(target=other, daemon=True).start()
        thread = threading.Thread(target=fly)
        thread.start(); thread.join()
    """
    status, text = dies(code, "SIGSEGV", loop=loop)
    assert (status, text.split(" at ")[0]) == (-11, "FmuCrashed: a ended the process in fmi2DoStep")


def test_times_and_names(dies, tmp_path):
    """To the nanosecond, of a name what JSON and a terminal take."""
    for start, told in ((123456.7, "123457"), (-2.0, "-1.7"), (1 / 8, "0.425")):
        text = dies(f"fly(start={start!r}, name='ü\\'')", "SIGSEGV")[1]
        assert f"ü' ended the process in fmi2DoStep at communication point {told} s" in text
        assert json.loads((tmp_path / "out" / "run.json").read_text())["failure"]["time"] == float(told)
        (tmp_path / "out" / "run.json").unlink()
        (tmp_path / "out" / "result.arrows").unlink()


def test_a_program_s_own_end_is_its_own(dies):
    assert dies("fly(); sys.exit(3)") == (3, "")
    assert dies("fly(out=None); os.abort()") == (-6, "")
    code = """
        threading.Thread(target=lambda: [fly(out=None) for _ in range(10**6)], daemon=True).start()
        sys.exit(4)
    """
    assert dies(code)[0] == 4


def test_a_child_that_an_fmu_forks_is_not_the_process(dies, tmp_path):
    assert dies("print(fly().info['status'])", "fork") == (0, "")
    assert Result.read(tmp_path / "out").info["status"] == "finished"


def test_who_handled_signals_before_still_does(dies):
    status, text = dies("fly()", "SIGSEGV", options=["-X", "faulthandler"])
    assert status == -11
    assert text.startswith("FmuCrashed: a ended the process in fmi2DoStep at communication point 0.3 s")
    assert "\nFatal Python error: Segmentation fault\n" in text and 'kernel.py", line ' in text


def test_a_run_within_a_run_leaves_the_outer_s_story(dies, tmp_path):
    code = """
        inner = []
        def progress(t, stop):
            if not inner:
                inner.append(fly(out="inner", stop=0.2))
        system = both.of({"b": FMU}, [], held={"b.u": 0.0})
        flights.simulate(system, both.experiment(1.0), out="out", progress=progress)
    """
    status, text = dies(code, "SIGSEGV")
    assert (status, text.split(" at ")[0]) == (-11, "FmuCrashed: b ended the process in fmi2DoStep")
    stories = {name: json.loads((tmp_path / name / "run.json").read_text())["status"] for name in ("inner", "out")}
    assert stories == {"inner": "finished", "out": "crashed"}


def test_a_thread_too_many_flies_without(monkeypatch):
    monkeypatch.setattr(breadcrumb, "_free", [])
    with breadcrumb.left():
        assert breadcrumb.here() not in list(breadcrumb.ALL)
    monkeypatch.setattr(breadcrumb, "_free", [5])
    with breadcrumb.left():
        assert np.isnan(breadcrumb.here().time) and breadcrumb.ALL[5].process == os.getpid()
        with breadcrumb.left():
            assert breadcrumb.ALL[5].process == os.getpid()
        assert breadcrumb.ALL[5].process == os.getpid()
    assert breadcrumb.ALL[5].process == 0


@pytest.mark.parametrize(("how", "status"), [("exit", 1), ("SIGSEGV", -11)])
def test_at_the_command_line(mortal, tmp_path, how, status):
    """Never status 0; what Python was doing is told too."""
    (tmp_path / "alone.py").write_text(ALONE.format(fmu=str(mortal)))
    command = [sys.executable, "-m", "cosim", "run", "alone.py"]
    environment = os.environ | {"PYTHONPATH": str(ROOT), "DIE_HOW": how, "DIE_WHERE": "step"}
    done = subprocess.run(
        [*command, "--out", "out"], cwd=tmp_path, env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == status
    assert done.stderr.startswith("FmuCrashed: unit ended the process in fmi2DoStep at communication point 0.3 s: ")
    assert ("Fatal Python error: Segmentation fault" in done.stderr) == (how == "SIGSEGV")
    assert Result.read(tmp_path / "out").info["status"] == "crashed"
