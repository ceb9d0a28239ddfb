"""Claims, metrics and warnings that adcs run prints of a flight."""

import re

import numpy as np
import pytest


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


@pytest.mark.parametrize("option", [["--step", "2ms"], ["--every", "50"], ["--master", "jacobi"]])
def test_claims_are_of_the_experiment_as_it_is_published(adcs, option):
    done = adcs("run", "zhang2018-ppatc", "--stop", "0.1", "--out", "other", *option)
    assert "not the paper's experiment (other parameters, steps or master)" in done.out
    assert "not judged: needs" not in done.out


def test_a_controller_out_of_its_domain_is_told(adcs):
    done = adcs("run", "zhang2018-ppatc", "--stop", "1", "--out", "out", "--set", "plant.omega_BN_B=[20,0,0] deg/s")
    assert "the controller was out of its domain from" in done.out
    assert "the error left its prescribed bounds (barrier_time)" in done.out


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
