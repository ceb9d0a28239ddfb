"""adcs run --checkpoint and --resume, and what adcs show says of a checkpoint."""

import json
import re
from pathlib import Path

import pytest

from cosim.results.checkpoint import Checkpoint
from cosim.results.names import CHECKPOINT, INFO
from cosim.results.result import Result

from .. import both, own_files

SYSTEM = "zhang2018-ppatc"


@pytest.fixture
def left(adcs, folder):
    """A run of 50 ms in the folder `out`, with checkpoints every 20 ms, taken back to the one of 20 ms."""
    done = adcs("run", SYSTEM, "--stop", "20ms", "--checkpoint", "20ms", "--set", "plant.zeta=0.01", "--out", "first")
    assert done.status == 0, done.err
    assert "wrote first/checkpoint.bin" in done.out
    return Path("first")


@pytest.fixture
def straight(adcs, folder):
    assert adcs("run", SYSTEM, "--stop", "50ms", "--set", "plant.zeta=0.01", "--out", "straight").status == 0
    return Result.read("straight")


def test_further(adcs, left, straight):
    """It prints what the run would have printed, with a note where it goes on."""
    done = adcs("run", "--resume", "first", "--stop", "50ms")
    assert done.status == 0, done.err
    assert "going on from the checkpoint at 0.02 s in first\n" in done.err
    assert done.out.startswith("finished: 0.05 s simulated, ")
    assert "settling threshold, largest component (deg)  0.005 " in done.out
    found = Result.read("first")
    both.assert_same(straight, found)
    assert found.info["resumed_at"] == 0.02
    assert {**found.metrics} == {**straight.metrics}
    assert found.info["parameters"] == straight.info["parameters"]


def test_a_run_into_its_folder_says_how_to_go_on(adcs, left):
    assert adcs("run", SYSTEM, "--out", "first").err.endswith("To go on with it: adcs run --resume first\n")


def test_shown(adcs, left):
    text = adcs("show", "first").out
    assert re.search(
        r"^checkpoint of 0\.02 s with 3 rows, saved \d{4}-\d\d-\d\d \d\d:\d\d:\d\d UTC, then every 0\.02 s; "
        r"go on from it: adcs run --resume first$",
        text,
        re.MULTILINE,
    ), text
    data = (left / CHECKPOINT).read_bytes()
    (left / CHECKPOINT).write_bytes(data[:-1])
    assert "no checkpoint: first/checkpoint.bin: it is cut or damaged" in adcs("show", "first").out


def test_options_that_are_of_another_run(adcs, left):
    done = adcs("run", "--resume", "first", "--step", "2ms", "--master", "iterated", "--force")
    assert (done.status, done.out) == (2, "")
    assert done.err.startswith(
        "NotSupported: --step 2ms, --master iterated, --force: a run that goes on is what it was"
    )
    assert "in first system zhang2018-ppatc, step 1/1000 s, master Explicit(preset='declared'" in done.err
    assert done.err.endswith("Give --resume alone, or with --stop and --plot; or fly anew.\n")
    assert adcs("run", SYSTEM, "--resume", "first").err.startswith("NotSupported: NAME zhang2018-ppatc: a run that")


def test_a_run_at_its_end(adcs, left):
    done = adcs("run", "--resume", "first")
    assert (done.status, done.out) == (2, "")
    assert done.err.endswith("the run has come to 0.02 s. Fly further: --stop TIME (stop_time=...).\n")


def test_nothing_to_fly(adcs, folder):
    done = adcs("run")
    assert done.status == 2 and "--resume" in done.err and "NAME" in done.err
    assert adcs("run", "--resume", "nowhere").err == (
        "CheckpointRefused: nowhere: there is no such folder. Give that of a result.\n"
    )


def test_times_that_are_none(adcs, folder):
    for text, problem in (("0", "checkpoint is 0 s: the time between two"), ("5 parsec", "--checkpoint is '5 parsec'")):
        done = adcs("run", SYSTEM, "--checkpoint", text)
        assert (done.status, done.err.startswith(f"TimeError: {problem}")) == (2, True), done.err


def test_a_system_of_one_s_own_and_an_fmu_that_is_built_again(adcs, folder, monkeypatch):
    """Where the FMU that flew is gone, the same is built from its source; an edited one is another."""
    (folder / "pd.py").write_text(own_files.PD_EQUATIONS)
    begin = ("run", SYSTEM, "--use", "controller=pd.py:PD", "--stop", "20ms", "--checkpoint", "10ms", "--out", "out")
    assert adcs(*begin).status == 0
    path = Path(json.loads(Path("out", INFO).read_text())["flight"]["fmus"]["controller"]["path"])
    assert path.is_file() and Checkpoint.read(Path("out")).time == 0.02
    path.unlink()
    done = adcs("run", "--resume", "out", "--stop", "30ms")
    assert done.status == 0, done.err
    assert path.is_file()
    path.unlink()
    text = (folder / "pd.py").read_text()
    (folder / "pd.py").write_text(text.replace("start=40.0", "start=41.0"))
    done = adcs("run", "--resume", "out", "--stop", "40ms")
    assert done.status == 2
    assert re.search(r"fmus\.controller\.guid was '\{.*\}', and is '\{.*\}' now\. Put the FMU back", done.err), done.err


def test_figures(adcs, left):
    done = adcs("run", "--resume", "first", "--stop", "40ms", "--plot")
    assert done.status == 0 and ".png" in done.out
