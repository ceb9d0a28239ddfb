"""Three first weeks, by the files of examples/: each runs from an empty folder, and writes into no other."""

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pandas as pd
import pytest
from lxml import html

from cosim import Result

EXAMPLES = Path(__file__).parents[1] / "examples"


@pytest.fixture
def read_only(tmp_path):
    """A copy of examples/ that nobody may write into; what is in it before and after must be the same."""
    place = tmp_path / "examples"
    place.mkdir()
    for path in EXAMPLES.iterdir():
        if path.is_file():
            (place / path.name).write_bytes(path.read_bytes())
    place.chmod(0o555)
    before = {path: path.stat().st_mtime_ns for path in place.rglob("*")}
    yield place
    assert {path: path.stat().st_mtime_ns for path in place.rglob("*")} == before
    place.chmod(0o755)


@pytest.fixture
def empty(tmp_path):
    place = tmp_path / "empty"
    place.mkdir()
    return place


def run(arguments: list[str], folder: Path) -> str:
    done = subprocess.run(
        [sys.executable, *arguments],
        cwd=folder,
        capture_output=True,
        text=True,
        env=os.environ | {"SOURCE_DATE_EPOCH": "1700000000"},
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.mark.slow
class TestOwnVehicle:
    @pytest.fixture
    def result(self, read_only, empty):
        run([str(read_only / "own_vehicle.py")], empty)
        return Result.read(empty / "results" / "own_vehicle")

    def test_the_slew_goes_on_without_the_wheel(self, result, empty):
        """The wheel gives no torque from 50 s on; the error stays below 0.1 deg, and the filter within its 3 sigma."""
        late = result.time > 50.05
        assert abs(result["wheels.motor_torque"][late, 1]).max() == 0.0
        assert abs(result["wheels.motor_torque"][~late, 1]).max() > 0.05
        assert result.metrics["APE max (deg)"] < 0.1 and result.metrics["settling time (s)"] == 0.0
        settled = result.time > 120.0
        off = abs(result["filter.bias"][settled] - result["gyro.bias"][settled])
        assert (off < 3 * result["filter.sigma_bias"][settled]).mean() > 0.95
        events = result.info["events"]
        assert [event["time"] for event in events] == [50.0, 52.0]
        figures = {path.name for path in (empty / "results" / "own_vehicle").glob("*.png")}
        assert {"attitude_error.png", "cluster.png", "estimate_filter.png"} <= figures

    def test_it_takes_under_80_lines(self):
        assert len((EXAMPLES / "own_vehicle.py").read_text(encoding="utf-8").splitlines()) < 80


@pytest.mark.slow
def test_one_paper(read_only, empty):
    """Figures of the paper as PDF over the published run, rows as CSV, one table."""
    lines = (read_only / "one_paper.sh").read_text(encoding="utf-8").splitlines()
    printed = [run(["-m", "cosim", *shlex.split(line)[1:]], empty) for line in lines if line.startswith("adcs ")]
    figures = {path.name for path in (empty / "results" / "figures").iterdir()}
    assert {"fig02-04_tracking_error.pdf", "fig02-04_tracking_error.png", "attitude_error.pdf"} <= figures
    assert (empty / "results" / "figures" / "fig02-04_tracking_error.pdf").read_bytes().startswith(b"%PDF")
    rows = pd.read_csv(empty / "results" / "weak_csv" / "result.csv")
    same = Result.read(empty / "results" / "weak")
    assert abs(rows["plant.q_BN[1]"].to_numpy() - same["plant.q_BN"][:, 0]).max() == 0.0
    head, *table = printed[-1].splitlines()
    assert head.split(",")[-2:] == ["weak", "weak_csv"] or "weak" in head
    assert any("peak torque" in line for line in table)


@pytest.mark.slow
def test_fmus_elsewhere(read_only, empty):
    """Built with own values, looked into, documented, flown by fmpy alone to the reference."""
    text = run([str(read_only / "fmus_elsewhere.py")], empty)
    assert text.count("problems: none") == 2 and text.count("documentation/index.html") == 2
    error = float(re.search(r"deg at 0 s, (\S+) deg at 60 s", text)[1])
    assert 0 < error < 0.01
    page = html.fromstring((empty / "fmus" / "plant.html").read_text(encoding="utf-8"))
    assert "kg.m2" in page.text_content() and "420" in page.text_content()
