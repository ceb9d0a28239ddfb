"""The survey of other people's FMUs, tests/benchmarks/foreign_fmus.py, on FMUs whose outcomes are known."""

import subprocess
import sys
from pathlib import Path

import fmpy
import pytest

from .. import c_fmu, tiny_fmu
from ..c_fmu import real

SCRIPT = Path(__file__).parents[2] / "benchmarks" / "foreign_fmus.py"

pytestmark = [pytest.mark.slow, pytest.mark.skipif(not tiny_fmu.COMPILED, reason="these FMUs are compiled for Linux")]


def surveyed(folder, *options):
    done = subprocess.run([sys.executable, SCRIPT, folder, *options], capture_output=True, text=True, check=True)
    lines = [line.split(" | ") for line in done.stdout.splitlines() if line.count(" | ") == 4]
    return {line[0]: line[3:] for line in lines}, done.stdout


def integrator(folder, name, step, template=c_fmu.C, **more):
    variables = [real("u", "input", start=2.0), real("y")]
    return c_fmu.build(folder, name, variables, outputs="y = m->state[0];", step=step, template=template, **more)


def test_outcomes_and_causes(tmp_path):
    step = "m->state[0] += h * u;"
    integrator(tmp_path, "Same", "m->state[0] += u;")
    integrator(tmp_path, "Times", "m->state[0] += t;")  # the times differ in their last bits
    integrator(tmp_path, "Dies", f"{step} if (t > 0.5) abort();")
    integrator(tmp_path, "Hangs", "for (;;) nanosleep(&(struct timespec){1, 0}, 0);")
    integrator(tmp_path, "Chance", "struct timespec s; clock_gettime(CLOCK_REALTIME, &s); m->state[0] = s.tv_nsec;")
    asked = c_fmu.C.replace("static int set(Memory *m);", "static int set(Memory *m);\n#define WAS_SET m->whole[7] = 1")
    integrator(tmp_path, "Inputs", "m->state[0] += m->whole[7];", asked, on_set="WAS_SET;")
    windows = f"{fmpy.platform}/Same.so", "win64/Same.dll"
    tiny_fmu.changed(tmp_path / "Same.fmu", tmp_path / "Other.fmu", rename=lambda n: n.replace(*windows))
    whole = c_fmu.C.replace(" fmi2CancelStep(", " lost_CancelStep(")
    integrator(tmp_path, "More", step, whole)
    lines, text = surveyed(tmp_path, "--timeout", "10", "--out", tmp_path / "survey.md")
    assert lines["Same.fmu"] == ["same", "1 columns, 501 rows"]
    assert lines["Times.fmu"][0] == "differs" and "t + h, fmpy sums up its times" in lines["Times.fmu"][1]
    assert lines["Dies.fmu"][0] == "both refuse" and lines["Dies.fmu"][1].count("SIGABRT") >= 2
    assert lines["Hangs.fmu"] == ["both refuse", "here: no end after 10 s; fmpy: no end after 10 s"]
    assert lines["Chance.fmu"][0] == "differs" and "not the same twice in fmpy" in lines["Chance.fmu"][1]
    assert lines["Inputs.fmu"][0] == "differs" and "its inputs are set here" in lines["Inputs.fmu"][1]
    assert lines["Other.fmu"][0] == "other platform" and "there: win64" in lines["Other.fmu"][1]
    assert lines["More.fmu"][0] == "more" and "fmi2CancelStep" in lines["More.fmu"][1]
    assert "by hand" in text.splitlines()[-2]
    assert (tmp_path / "survey.md").read_text().count("\n") > 12


def test_references(tmp_path):
    """y = 2 t, and a reference that is off by a thousandth; the tolerance is 1e-9, for the FMU has none."""
    for name, factor in (("Good", 2.0), ("Bad", 2.002)):
        integrator(tmp_path, name, "m->state[0] += h * u;")
        rows = "".join(f"{k / 4},{factor * k / 4}\n" for k in range(5))
        (tmp_path / f"{name}_ref.csv").write_text("time,y\n" + rows)
    integrator(tmp_path, "None", "")
    lines, _ = surveyed(tmp_path, "--references")
    assert lines["Good.fmu"] == ["within", "1 columns, 5 rows, 0.0e+00 of y, tolerance 1e-09"]
    assert lines["Bad.fmu"] == ["BEYOND", "1 columns, 5 rows, 1.0e-03 of y, tolerance 1e-09"]
    assert lines["None.fmu"] == ["no reference", "no None_ref.csv beside it"]
