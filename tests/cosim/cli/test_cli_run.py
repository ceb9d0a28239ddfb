"""adcs run and plot: every option changes what it says, the terminal and run.json tell the truth."""

import dataclasses
import json
import re
import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from cosim import simulate
from cosim.masters.explicit import Explicit
from cosim.results.result import Result
from cosim.studies import papers

from .. import own_files

J = [[500.0, 4.0, -4.0], [4.0, 410.0, 9.0], [-4.0, 9.0, 690.0]]


@pytest.fixture
def run(adcs, folder):
    """Fly zhang2018-ppatc for 50 ms, return what was printed and the result."""

    def call(*arguments, system="zhang2018-ppatc", stop="50ms", out="out"):
        done = adcs("run", system, "--stop", stop, "--out", out, *arguments)
        assert done.status == 0, done.err
        return done, Result.read(folder / out)

    return call


def value(result, name):
    """A parameter of run.json, arrays whole."""
    found = {k: v["value"] for k, v in result.info["parameters"].items() if k == name or k.startswith(name + "[")}
    return [found[k] for k in sorted(found)]


class TestParameters:
    def test_array_element_unit_and_everywhere(self, run):
        _, result = run(
            "--set", f"*.J={J}", "--set", "plant.J[1,1]=505", "--set", "controller.rho_inf=0.004 deg",
            "--set", "plant.zeta=0.01",
        )  # fmt: skip
        assert_array_equal(value(result, "controller.J"), np.ravel(J))
        assert_array_equal(value(result, "plant.J"), [505.0, *np.ravel(J)[1:]])
        assert_allclose(value(result, "controller.rho_inf"), np.radians([0.004] * 3))
        assert_array_equal(value(result, "plant.zeta"), [0.01] * 8)

    def test_a_file_then_the_command_line(self, run, folder):
        (folder / "p.toml").write_text(
            f'["*"]\nJ = {J}\n[plant]\nzeta = 0.02\n[controller]\nrho_inf = "0.004 deg"\nk = [0.2, 0.2, 0.2]\n'
        )
        _, result = run("--params", "p.toml", "--set", "controller.k=0.1", "--set", "*.zeta=0.03")
        assert_array_equal(value(result, "plant.J"), np.ravel(J))
        assert_array_equal(value(result, "controller.k"), [0.1] * 3)
        assert_array_equal(value(result, "plant.zeta"), [0.03] * 8)
        assert_allclose(value(result, "controller.rho_inf"), np.radians([0.004] * 3))

    def test_everywhere_wins_over_what_the_system_sets_itself(self, run):
        _, result = run("--set", "*.angle_unit=1 rad", "--set", "*.k[2]=0.3")
        assert value(result, "controller.angle_unit") == [1.0]
        assert value(result, "controller.k") == [0.15, 0.3, 0.15]

    def test_held_inputs_whole_and_by_element(self, run):
        _, result = run("--set", "plant.h_B=[0, 0, 1]", "--set", "plant.h_B[1]=2 N.m.s")
        assert_array_equal(result["plant.h_B"][-1], [2, 0, 1])


class TestExperiment:
    def test_step_stop_and_every(self, run):
        _, result = run("--step", "2ms", "--every", "5")
        assert_array_equal(result.time, [0, 0.01, 0.02, 0.03, 0.04, 0.05])
        assert result.info["communication_step_size"] == 0.002

    def test_a_shortened_last_step_is_told(self, run):
        done, result = run("--step", "20ms", "--every", "1")
        assert_array_equal(result.time, [0, 0.02, 0.04, 0.05])
        assert "the last step is 0.01 s: 0.05 s are no multiple of the step" in done.out
        assert "last step" not in run("--step", "10ms", out="whole")[0].out

    @pytest.mark.parametrize(
        ("arguments", "master"),
        [
            ([], ("declared", "declared", 1)),
            (["--master", "explicit"], ("declared", "declared", 1)),
            (["--master", "jacobi"], ("jacobi", "declared", 0)),
            (["--master", "gauss_seidel", "--extrapolation", "2"], ("gauss_seidel", "declared", 2)),
            (["--extrapolation", "0"], ("declared", "declared", 0)),
            (["--inputs", "ramp"], ("declared", "ramp", 1)),
            (["--master", "gauss_seidel", "--inputs", "smooth"], ("gauss_seidel", "smooth", 0)),
        ],
    )
    def test_master(self, run, arguments, master):
        info = run(*arguments)[1].info["master"]
        assert (info["preset"], info["inputs"], info["extrapolation"]) == master

    @pytest.mark.parametrize(
        ("arguments", "name", "settings"),
        [
            (["--master", "iterated"], "Iterated", {"inputs": "smooth"}),
            (["--master", "iterated", "--inputs", "ramp"], "Iterated", {"inputs": "ramp"}),
            (["--master", "error-controlled", "--master-tolerance", "1e-4"], "ErrorControlled", {"relative": 1e-4}),
        ],
    )
    def test_masters_that_repeat_steps(self, run, arguments, name, settings):
        info = run(*arguments)[1].info
        assert info["master"].items() >= {"name": name, **settings}.items()
        assert info["loop"]["evaluations"] > 0

    def test_options_of_another_master(self, adcs):
        refused = adcs("run", "zhang2018-ppatc", "--master", "iterated", "--extrapolation", "1")
        words = "Iterated has no setting extrapolation. Choose --master e"
        assert refused.status == 2 and words in refused.err.replace("\n", " ")

    def test_masters_give_other_trajectories(self, run):
        ends = [
            run(*args, out=str(i))[1]["plant.q_BN"][-1].tolist()
            for i, args in enumerate([[], ["--master", "jacobi"], ["--master", "jacobi", "--extrapolation", "1"]])
        ]
        assert ends[0] != ends[1] != ends[2] != ends[0]
        assert_allclose(ends[1:], [ends[0]] * 2, atol=1e-6)

    def test_python_back_end_gives_the_same_rows(self, run):
        held = ("--inputs", "held", "--extrapolation", "0")  # FMUs of the python back end take no slopes
        native, python = run(*held, out="n")[1], run(*held, "--backend", "python", out="p")[1]
        assert {Path(c["path"]).parent.name for c in python.info["components"].values()} == {"python"}
        for name in native.names:
            assert_allclose(python[name], native[name], rtol=0, atol=1e-12 * max(1e-300, np.abs(native[name]).max()))


class TestFiles:
    @pytest.mark.parametrize("format", ["parquet", "csv", "mat"])
    def test_formats(self, run, folder, format):
        done, result = run("--format", format)
        names = sorted(p.name for p in (folder / "out").iterdir())
        assert names == sorted([f"result.{format}", "run.json"])
        assert result["plant.q_BN"].shape == (6, 4)
        assert result.units["plant.omega_BN_B"] == "rad/s"
        assert re.findall("wrote (.*)", done.out) == [f"out/result.{format}", "out/run.json"]

    def test_default_folder(self, adcs, folder):
        assert adcs("run", "zhang2018-atc", "--stop", "0.01").status == 0
        assert (folder / "results" / "zhang2018-atc" / "run.json").is_file()

    def test_an_existing_result_is_kept_unless_force(self, run, adcs):
        _, old = run()
        refused = adcs("run", "zhang2018-atc", "--out", "out")
        assert (refused.status, refused.out) == (2, "")
        assert refused.err == (
            "ResultExists: out already holds a result. Write elsewhere (out=..., --out DIR), or replace it "
            "(overwrite=True, --force).\n"
        )
        assert Result.read("out").table.equals(old.table)
        assert run("--force", "--format", "csv")[1].info["system"] == "zhang2018-ppatc"
        assert not Path("out/result.parquet").exists()

    def test_a_refused_start_leaves_the_older_result(self, run, adcs):
        _, old = run()
        assert adcs("run", "zhang2018-ppatc", "--out", "out", "--force", "--set", "plant.J[1,2]=50").status == 2
        assert Result.read("out").table.equals(old.table)

    def test_figures_of_one_run_and_of_two_overlaid(self, run, adcs, folder):
        done, _ = run("--plot", out="a/x")
        drawn = {p.name for p in (folder / "a" / "x").glob("*.png")}
        assert {"attitude_error.png", "torque.png", "fig05_attitude.png"} <= drawn
        assert {Path(line).name for line in re.findall("wrote (.*png)", done.out)} == drawn
        run("--set", "plant.zeta=0.1", out="b/x")
        both = adcs("plot", "a/x", "b/x", "--out", "both")
        assert (folder / "both" / "attitude_error.png").is_file()
        drawn = [line for line in both.out.splitlines() if line.startswith("both/")]
        assert sorted(drawn) == [f"both/{p.name}" for p in sorted((folder / "both").iterdir())]
        assert adcs("plot", "b/x").status == 0
        assert (folder / "b" / "x" / "rates.png").is_file()

    def test_nothing_to_draw_is_said(self, adcs, folder):
        (folder / "alone.py").write_text(own_files.ALONE.format(unit="HarmonicTorque", stop=0.1, kernel="auto"))
        done = adcs("run", "alone.py", "--plot")
        assert (done.status, "no figures: they show plant.q_BN" in done.err) == (0, True)
        assert "no figures" in adcs("plot", "results/alone").err


class TestClaims:
    def test_the_papers_own_run_is_judged(self, adcs):
        done = adcs("run", "zhang2018-ppatc", "--out", "out")
        assert len(re.findall(r" reproduced\s", done.out)) == 2
        assert "3 more claims of zhang2018, of several experiments: adcs reproduce zhang2018" in done.out
        assert re.search(r"settling threshold, largest component \(deg\) +0\.005 *\n", done.out)
        assert re.search(r"settling time \(s\) +27\.5", done.out)

    def test_a_short_run_says_what_is_missing(self, run):
        done, _ = run()
        assert "2 claims of zhang2018 not judged: needs 200 s of zhang2018-ppatc, it has 0.05 s" in done.out
        assert "reproduced" not in done.out.replace("reproduce zhang2018", "")
        assert re.search(r"settling time \(s\) +not reached", done.out)

    @pytest.mark.parametrize(
        ("arguments", "why"),
        [
            (["--set", "plant.zeta=0.01"], "other parameters, steps or master"),
            (["--use", "controller=AdaptiveTracking"], "another FMU for controller"),
        ],
    )
    def test_another_experiment_is_not_judged(self, run, arguments, why):
        done, _ = run(*arguments)
        text = f"claims of zhang2018: not judged, for this is not the paper's experiment ({why})"
        assert text in done.out


def test_in_a_process_of_its_own(folder):
    """As a user has it: standard output for what was asked, standard error for the rest."""
    command = [sys.executable, "-m", "cosim", "run", "zhang2018-atc", "--stop", "0.1"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True)
    assert done.returncode == 0
    assert done.stdout.startswith("finished: 0.1 s simulated")
    assert done.stdout.endswith("wrote results/zhang2018-atc/run.json\n")
    assert "Traceback" not in done.stderr
    info = json.loads((folder / "results" / "zhang2018-atc" / "run.json").read_text())
    assert (info["status"], info["reached_time"], info["rows"]) == ("finished", 0.1, 11)


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


def test_figures_that_cannot_be_written(run, adcs, folder):
    run()
    (folder / "afile").write_text("mine")
    done = adcs("plot", "out", "--out", "afile")
    assert (done.status, "ResultUnwritable: afile cannot be written" in done.err) == (2, True)


def test_a_run_that_diverges_far_tells_why_and_keeps_its_rows(adcs, folder):
    """Its numbers overflow in the metrics, which are then null; the failure is what is told."""
    done = adcs("run", "zhang2018-ppatc", "--set", "controller.rho_0=5 deg", "--step", "20ms", "--out", "far")
    assert done.status == 1
    assert "StepFailed" in done.err and "Traceback" not in done.err
    info = json.loads((folder / "far" / "run.json").read_text())
    assert (info["status"], info["error"]) == ("failed", "StepFailed") and "metrics" in info


@pytest.mark.parametrize("option", [["--step", "2ms"], ["--every", "50"], ["--master", "jacobi"]])
def test_claims_are_of_the_experiment_as_it_is_published(adcs, option):
    done = adcs("run", "zhang2018-ppatc", "--stop", "0.1", "--out", "other", *option)
    assert "not the paper's experiment (other parameters, steps or master)" in done.out
    assert "not judged: needs" not in done.out


def test_a_controller_out_of_its_domain_is_told(adcs):
    done = adcs("run", "zhang2018-ppatc", "--stop", "1", "--out", "out", "--set", "plant.omega_BN_B=[20,0,0] deg/s")
    assert "the controller was out of its domain from" in done.out
    assert "the error left its prescribed bounds (barrier_time)" in done.out


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


def test_a_run_that_its_event_ends(adcs, folder):
    """li2014's printed start with limits: a result, not an error; the same rows in the kernel and in Python."""
    done = adcs("run", "li2014-printed-start-with-limits", "--out", "cage")
    assert done.status == 0
    assert "ended by plant.cage_contact at 40.5 s: 1 once the test mass has reached its cage" in done.out
    result = Result.read("cage")
    event = {
        "time": 40.5,
        "variable": "plant.cage_contact",
        "meaning": "1 once the test mass has reached its cage, else 0",
    }
    assert (result.info["status"], result.info["event"], result.time[-1]) == ("finished", event, 40.5)
    assert np.abs(result["plant.r_rel"][-1]).max() >= 4e-3 > np.abs(result["plant.r_rel"][-3]).max()
    flown, experiment = papers.scenario("li2014-printed-start-with-limits")
    looped = simulate(flown, dataclasses.replace(experiment, master=Explicit(kernel="never")))
    assert looped.table.equals(result.table)


@pytest.mark.parametrize(("text", "degrees"), [("0.5deg", 0.5), ("0.01 deg", 0.01), ("1e-3 rad", np.degrees(1e-3))])
def test_threshold_of_the_settling_time(run, text, degrees):
    _, result = run("--settled", text)
    assert result.info["metrics"]["settling threshold, largest component (deg)"] == pytest.approx(degrees)


@pytest.mark.parametrize("text", ["0", "-1 deg", "1 m", "deg", "nan", "true", "2,5 deg"])
def test_a_threshold_that_is_no_angle(adcs, text):
    done = adcs("run", "zhang2018-ppatc", "--settled", text)
    assert done.status == 2
    assert f"parameter --settled: '{text}' is no positive angle. Write it as 0.005 deg or 1e-4 rad" in done.err


def test_a_threshold_without_unit_could_be_either(adcs):
    done = adcs("run", "zhang2018-ppatc", "--settled", "5")
    assert done.status == 2
    assert "parameter --settled: '5' has no unit. Write 5 deg or 5 rad" in done.err
