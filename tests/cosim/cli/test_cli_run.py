"""adcs run and plot: every option changes what it says, the terminal and run.json tell the truth."""

import dataclasses
import json
import re
import subprocess
import sys
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
