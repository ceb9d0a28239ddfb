"""adcs show FILE.fmu: types, ranges, items, experiment, platforms, licences, and what keeps it from running."""

import zipfile

import fmpy
import pytest

from .. import arrays_fmu, ball_fmu, c_fmu, tiny_fmu

pytestmark = pytest.mark.skipif(not tiny_fmu.COMPILED, reason="these FMUs are compiled for Linux")


def test_an_fmu_of_fmi3(adcs, folder):
    path = arrays_fmu.build(folder)
    with zipfile.ZipFile(path, "a") as archive:
        archive.writestr("documentation/licenses/license.txt", "do as you like")
    done = adcs("show", "Arrays.fmu")
    assert done.status == 0, done.err
    table = {line.split()[0]: line.split() for line in done.out.splitlines() if line.strip()}
    assert table["G[2,3]"][1:4] == ["Float64", "parameter", "tunable"]
    assert table["size"][1:3] == ["UInt64", "structuralParameter"]
    assert table["size"][-3:] == ["3", "from", "1"]
    for line in (
        "FMI 3.0, co-simulation",
        "e_in, e: off (1), on (4)",
        "proposed experiment: from 0 s, to 1 s, step 0.25 s",
        f"platforms: {fmpy.platform}",
        "licence: documentation/licenses/license.txt",
        "not exchanged: blob (Binary), tick (Clock)",
        "  nothing that was found",
    ):
        assert line in done.out.splitlines()


def test_a_model(adcs, folder):
    ball_fmu.build(folder)
    lines = adcs("show", "Ball.fmu").out.splitlines()
    assert "FMI 2.0, model exchange (integrated here by CVode)" in lines
    assert "proposed experiment: from 0 s, to 2 s, tolerance 1e-09" in lines
    assert lines[:2] == ["Ball", "made by by hand, GUID {ball}"]


def test_a_tool_that_is_not_named(adcs, folder):
    tiny_fmu.changed(
        ball_fmu.build(folder), folder / "b.fmu", xml=lambda text: text.replace('generationTool="by hand"', "")
    )
    assert "made by a tool that it does not name, GUID {ball}" in adcs("show", "b.fmu").out.splitlines()


def test_what_keeps_it_from_running(adcs, folder):
    """It needs its tool, an input has no start, and its binary dies when an instance is made: adcs does not."""
    template = c_fmu.C.replace("Instance *c = calloc", "if (a) abort(); Instance *c = calloc")
    variables = [c_fmu.real("u", "input"), c_fmu.real("y")]
    path = c_fmu.build(folder, "Dies", variables, template=template, needsExecutionTool=True)
    tiny_fmu.changed(path, folder / "dies.fmu", xml=lambda text: text.replace(' start="0.0"', ""))
    done = adcs("show", "dies.fmu")
    assert done.status == 0, done.err
    told = done.out[done.out.index("what would keep it from running here:") :]
    assert "it needs its tool, by hand" in told
    assert "inputs without a start value, which are held at 0 where nothing is connected: u" in told
    assert "in fmi2Instantiate its process was ended by SIGABRT" in told


def test_a_binary_of_another_platform(adcs, folder):
    path = c_fmu.build(folder, "Other", [c_fmu.real("y")])
    tiny_fmu.changed(
        path, folder / "o.fmu", rename=lambda name: name.replace(fmpy.platform, "win64").replace(".so", ".dll")
    )
    told = adcs("show", "o.fmu").out
    assert "platforms: win64" in told
    assert f"it has no binary for this platform: needed {fmpy.platform}, there: win64" in told
