"""adcs run --input and --hold: what feeds an input, instead of what the system has."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from cosim.results.result import Result

RUN = ("run", "zhang2018-ppatc", "--stop", "50ms", "--out", "out")


@pytest.fixture
def gust(folder):
    t = np.linspace(0, 0.05, 6)
    rows = "\n".join(f"{1000 * a:.15g},{a},{2 * a},{a * a},0" for a in t)
    (folder / "gust.csv").write_text(f"time (ms),tau[1] (N.m),tau[2] (N.m),tau[3] (N.m),spare\n{rows}\n")
    return folder


def test_a_file_in_place_of_a_connection(adcs, gust):
    done = adcs(*RUN, "--input", "plant.tau_dist_B=gust.csv:tau")
    assert done.status == 0, done.err
    assert "plant.tau_dist_B is no more connected to environment.tau_dist_B" in done.err
    assert "not judged, for this is not the paper.s experiment" in done.out.replace("'", ".")
    result = Result.read(gust / "out")
    assert_allclose(result["plant.tau_dist_B"][:, 1], 2 * result.time, atol=1e-16)
    told = result.info["inputs"]["plant.tau_dist_B"]
    assert told["file"] == "gust.csv" and len(told["sha256"]) == 64 and told["interpolation"] == "linear"


def test_elements_and_interpolation(adcs, gust):
    done = adcs(
        *RUN, "--hold", "plant.tau_dist_B=[0,0,1e-3]", "--input", "plant.h_B[2]=gust.csv:spare", "--interpolation",
        "previous",
    )  # fmt: skip
    assert done.status == 0, done.err
    result = Result.read(gust / "out")
    assert_array_equal(result["plant.tau_dist_B"], np.tile([0, 0, 1e-3], (len(result), 1)))
    assert result.info["inputs"]["plant.h_B[2]"]["interpolation"] == "previous"
    assert result.info["held"]["plant.tau_dist_B[3]"]["value"] == 1e-3
    assert {"plant.h_B[1]", "plant.h_B[3]"} <= result.info["held"].keys()


@pytest.mark.parametrize(
    "arguments, message",
    [
        (("--input", "plant.tau_dist_B=gust.csv"), "it has 2 columns beside time: tau, spare. Choose"),
        (("--input", "plant.tau_dist_B=gust.csv:spare"), "it has 1 column, plant.tau_dist_B has 3 elements"),
        (("--input", "plant.tau_dist_B"), "'plant.tau_dist_B' is not INSTANCE.INPUT=FILE"),
        (("--input", "plant.tau_dist_B=gust"), "signal gust: it names no file"),
        (("--input", "plant.tau_dist_B=gust.csv:tau", "--stop", "1s"), "it reaches from 0 to 0.05 s, the flight from"),
        (("--input", "plant.J=gust.csv:tau"), "it feeds plant.J, which is no input"),
        (("--input", "plant.h_B=gust.csv:tau"), "it has unit N.m.s, the value has unit N.m"),
        (
            ("--input", "plant.tau_dist_B=gust.csv:tau", "--hold", "plant.tau_dist_B=0"),
            "plant.tau_dist_B is fed by a signal and held. Leave out",
        ),
        (("--hold", "plant.tau_dist=0"), 'unknown input "tau_dist"'),
    ],
)
def test_what_is_refused(adcs, gust, arguments, message):
    done = adcs(*RUN, *arguments)
    assert done.status == 2
    assert message in " ".join(done.err.split())


def test_show_lists_signals(adcs, gust):
    (gust / "fed.py").write_text(
        "from dataclasses import replace\nfrom cosim import Signal, load\n\n\ndef fed():\n"
        "    system, experiment = load('zhang2018-ppatc')\n"
        "    return replace(system, inputs={'plant.h_B': Signal("
        "'gust.csv', 'spare,spare,spare')}), replace(experiment, stop_time=0.05)\n"
    )
    done = adcs("show", "fed.py")
    assert done.status == 0, done.err
    assert "plant.h_B" in done.out and "6 samples from 0 to 0.05 s, linear" in " ".join(done.out.split())
