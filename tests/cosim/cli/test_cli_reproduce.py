"""adcs reproduce: the papers' experiments, their report, and what ends it early."""

import dataclasses
import json
from contextlib import contextmanager
from pathlib import Path

import pytest

from cosim.results.result import Result
from cosim.studies import papers


def test_reproduce_ends_at_ctrl_c_with_what_there_is(adcs, folder, monkeypatch):
    @contextmanager
    def progress(title):
        def interrupt(t, stop):
            if t > 0:  # with one row alone there is no settling to measure
                raise KeyboardInterrupt

        yield interrupt

    monkeypatch.setattr("cosim.cli.console.progress", progress)
    done = adcs("reproduce", "zhang2018", "--out", "all")
    assert done.status == 1
    assert "claims of zhang2018 not judged: needs " in done.out
    rows = json.loads((folder / "all" / "claims.json").read_text())
    assert {row["verdict"] for row in rows} == {"not judged"}
    assert Result.read("all/zhang2018/zhang2018-ppatc").info["status"] == "interrupted"
    assert "| zhang2018-ppatc | 0.005 |" in (folder / "all" / "report.md").read_text()
    assert not (folder / "all" / "zhang2018" / "zhang2018-atc").exists()


def give_experiments(monkeypatch, made):
    """Give zhang2018 these experiments, by name, in place of its own."""

    class Given(papers.Paper):
        experiments = dict.fromkeys(made, "")

        def make(self, experiment):
            return made[experiment]()

    monkeypatch.setitem(papers.PAPERS, "zhang2018", Given("zhang2018"))


def test_ctrl_c_between_two_experiments_keeps_the_report(adcs, folder, monkeypatch):
    from cosim.studies.papers.zhang2018 import system

    def short():
        flown, experiment = system.ppatc()
        return flown, dataclasses.replace(experiment, stop_time=0.1)

    def pressed():
        raise KeyboardInterrupt

    give_experiments(monkeypatch, {"zhang2018-ppatc": short, "zhang2018-atc": pressed})
    done = adcs("reproduce", "zhang2018", "--out", "all")
    assert (done.status, "interrupted: 1 of 2 experiments flown" in done.err) == (1, True)
    assert "| zhang2018-ppatc | 0.005 |" in (folder / "all" / "report.md").read_text()


@pytest.mark.parametrize("command", [["reproduce", "zhang2018"], ["compare", "--plants", "zhang2018"]])
def test_a_file_in_place_of_the_folder_is_refused_before_anything_flies(adcs, folder, command):
    (folder / "afile").write_text("mine")
    done = adcs(*command, "--out", "afile")
    assert done.status == 2
    assert "afile" in done.err and "cannot be written: " in done.err and "--out DIR" in done.err
    assert (folder / "afile").read_text() == "mine"


def test_a_failure_ends_reproduce_and_the_report_has_what_was_flown(adcs, folder, monkeypatch):
    from cosim.studies.papers.zhang2018 import system

    flights = [system.ppatc, system.atc]

    def other(make, gain, **changes):
        def made():
            flown, experiment = make()
            flown = dataclasses.replace(flown, parameters=flown.parameters | {"controller.K": [gain] * 3})
            return flown, dataclasses.replace(experiment, **changes)

        return made

    made = {
        "zhang2018-ppatc": other(flights[0], 0.5, stop_time=0.1),
        "zhang2018-atc": other(flights[1], 1e3, communication_step_size=0.5),  # gain times step is far above 2
        "zhang2018-atc-half": other(flights[1], 0.5),  # never begun
    }
    give_experiments(monkeypatch, made)
    done = adcs("reproduce", "zhang2018", "--out", "all")
    assert done.status == 1
    assert "StepFailed" in done.err
    text = (folder / "all" / "report.md").read_text()
    assert "| zhang2018-ppatc | 0.005 |" in text and "| failed |" in text
    assert Result.read("all/zhang2018/zhang2018-atc").info["status"] == "failed"
    assert not (folder / "all" / "zhang2018" / "zhang2018-atc-half").exists()


@pytest.mark.slow
def test_reproduce_all_papers(adcs, folder):
    """Every claim judged anew, from flights of all experiments: as docs/papers has it."""
    done = adcs("reproduce", "--out", "all")
    assert done.status == 0
    rows = json.loads((folder / "all" / "claims.json").read_text())
    said = json.loads((Path(__file__).parents[3] / "docs" / "papers" / "claims.json").read_text())
    assert rows == said["claims"], "Write it anew: adcs reproduce --docs ."
    report = (folder / "all" / "report.md").read_text()
    for row in rows:
        assert all(row[key].replace("|", "\\|") in report for key in ("measured", "claim"))
    known = json.loads((folder / "all" / "metrics.json").read_text())
    assert list(known) == [name for paper in papers.PAPERS.values() for name in paper.experiments]
    for name, metrics in known.items():
        assert Result.read(folder / "all" / name.partition("-")[0] / name).info["metrics"] == metrics
        assert f"| {name} | " in report
        assert {"settling time (s)", "APE max (deg)", "APE 99.7 % (deg)", "RPE max (deg)"} <= set(metrics)
        # a drag-free satellite has none; of PPATC in radians, 1.2e4 1/s at the start, rows 10 ms apart cannot tell it
        told = not name.startswith("li2014") and name not in ("zhang2018-ppatc-rad", "zhang2018-ppatc-half-rad")
        assert ("momentum drift (N.m.s)" in metrics) == told
    for paper, titles in said["figures"].items():
        drawn = {path.stem for path in (folder / "all" / paper).glob("*.png")}
        assert drawn == set(titles)
        assert all(f"({paper}/{name}.png)" in report for name in drawn)
    assert "plant.cage_contact at 40.5 s" in report and "plant.cage_contact" in done.out
    again = adcs("reproduce", "zhang2018", "--out", "all")
    assert (again.status, "already holds a result" in again.err) == (2, True)
