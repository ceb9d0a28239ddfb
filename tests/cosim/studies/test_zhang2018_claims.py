"""Claims and figures of zhang2018: each comes out either way, of runs made for it."""

import dataclasses

import numpy as np
import pytest

from cosim.results.result import Result
from cosim.studies import papers, plots
from cosim.studies.papers.claims import Measured, judge

from ..figures import OF_ANY_RUN, cut_off
from .zhang2018_runs import (
    ATC,
    ATC_HALF,
    KINDS,
    OMEGA_1,
    PPATC,
    PPATC_HALF,
    T,
    claim,
    decaying,
    in_both,
    in_radians,
    swinging,
    synthetic,
    vibrating,
)

CASES = {
    "PPATC: steady": ({PPATC: decaying(0.0049)}, {PPATC: decaying(0.0051)}),
    "PPATC: error within": ({PPATC: decaying()}, {PPATC: -decaying() + decaying()[0] * 2 * np.exp(-T[:, None])}),
    "PPATC settles": (
        {PPATC: decaying(rate=0.2), ATC: decaying(rate=0.1)},
        {PPATC: decaying(rate=0.1), ATC: decaying(rate=0.2)},
    ),
    "ATC misses": ({ATC: decaying(0.006)}, {ATC: decaying(0.004)}),
    "ATC: error visibly": ({ATC: swinging(0.2, damping=0.02)}, {ATC: decaying()}),
    "half gains: PPATC": (
        {PPATC: decaying(rate=0.2), PPATC_HALF: decaying(rate=0.203)},
        {PPATC: decaying(), PPATC_HALF: swinging(0.2)},
    ),
    "half gains: ATC": (
        {ATC: swinging(0.1, damping=0.02), ATC_HALF: swinging(0.2, damping=0.02)},
        {ATC: swinging(0.2, damping=0.02), ATC_HALF: swinging(0.1, damping=0.02)},
    ),
}


@pytest.mark.parametrize("start", CASES)
def test_each_claim_can_come_out_either_way(start):
    good, bad = ({name: synthetic(e) for name, e in runs.items()} for runs in CASES[start])
    holds, fails = claim(start).judge(in_both(good)), claim(start).judge(in_both(bad))
    assert holds.verdict == "reproduced", holds
    assert fails.verdict == "not reproduced", fails
    assert holds.measured != fails.measured
    for first, second, reading in ((good, bad, "degrees"), (bad, good, "radians")):
        one = claim(start).judge(first | in_radians(second))
        assert one.word == f"in one reading ({reading})", one
        assert all(good is part.startswith(reading) for part, good in one.holds.items())


def test_every_row_says_what_it_depends_on():
    assert all("unit of angle" in c.depends for c in papers.PAPERS["zhang2018"].claims)


def test_vibration_can_be_suppressed_or_not():
    own = 0.005 * OMEGA_1
    error = decaying()
    weak = synthetic(error, **vibrating(1e-4, own))
    damped = synthetic(error, **vibrating(1e-4, 3 * own))
    driven = synthetic(error, **vibrating(1e-2, 0.0))
    suppressed = claim("PPATC suppresses")
    assert suppressed.judge(in_both({PPATC: damped, ATC: weak})).verdict == "reproduced"
    assert suppressed.judge(in_both({PPATC: weak, ATC: weak})).verdict == "partly"
    assert suppressed.judge(in_both({PPATC: driven, ATC: weak})).verdict == "not reproduced"


def test_every_claim_has_a_case():
    assert len(CASES) + 1 == len(papers.PAPERS["zhang2018"].claims) == 8


def test_one_axis_alone_makes_it_partly():
    e = decaying(0.004)
    e[:, 1] += 0.004
    verdict = claim("PPATC: steady").judge(in_both({PPATC: synthetic(e)}))
    assert verdict.verdict == "partly"
    assert verdict.readings["radians"] == {"roll": True, "pitch": False, "yaw": True}
    assert verdict.failing == "degrees: pitch; radians: pitch"


def test_a_claim_without_its_runs_is_not_judged():
    verdict = claim("PPATC settles").judge({PPATC: synthetic(decaying())})
    missing = "needs zhang2018-atc, zhang2018-ppatc-rad, zhang2018-atc-rad"
    assert (verdict.verdict, verdict.measured) == ("not judged", missing)


def test_a_run_that_ended_early_is_not_judged():
    short = T[T <= 50]
    verdict = claim("PPATC: steady").judge(in_both({PPATC: synthetic(decaying(time=short), time=short)}))
    assert (verdict.verdict, verdict.measured) == ("not judged", "needs 200 s of zhang2018-ppatc, it has 50 s")


def test_a_variable_that_was_not_recorded_is_named():
    table_ = synthetic(decaying()).table
    left = Result(table_.select([n for n in table_.column_names if not n.startswith("guidance")]), {})
    verdict = claim("PPATC: steady").judge(in_both({PPATC: left}))
    assert verdict.verdict == "not judged" and '"guidance.q_RN"' in verdict.measured


def finished(result: Result) -> Result:
    return Result(result.table, {"status": "finished"})


def test_one_run_is_judged_by_the_claims_it_decides_alone():
    result = synthetic(decaying())
    assert [v.claim for v in papers.judge_run(PPATC, result)] == [c.text for c in papers.PAPERS["zhang2018"].claims[:2]]
    (steady, _) = papers.judge_run(f"{PPATC}-rad", result)
    assert (steady.verdict, list(steady.readings)) == ("reproduced", ["radians"])
    assert papers.explain_open(PPATC, finished(result)).startswith("3 more claims of zhang2018")
    assert papers.judge_run("my_system", result) == []
    result.info["swaps"] = [{"instance": "controller"}]
    assert papers.judge_run(PPATC, result) == []


def test_verdicts_are_not_written_down():
    """A claim holds no verdict: the same claim gives another one for other runs, and a measure decides."""
    changed = dataclasses.replace(claim("PPATC: steady"), measure=lambda runs: Measured("nothing", {"part": False}))
    assert judge([changed], in_both({PPATC: synthetic(decaying())}))[0].verdict == "not reproduced"


def title_of(figure) -> str:
    return figure.get_suptitle() or figure.axes[0].get_title()


def test_figures_are_those_of_the_paper():
    runs = {
        name: synthetic(decaying(rate=r), **vibrating(1e-4, 0.01))
        for name, r in zip(KINDS, (0.2, 0.1, 0.21, 0.09), strict=True)
    }
    drawn = papers.PAPERS["zhang2018"].draw(runs)
    assert [name.split("_")[0] for name in drawn] == ["fig02-04", "fig05", "fig06", "fig07", "fig08", "fig09-11"]
    other = papers.PAPERS["zhang2018"].draw(in_radians(runs))
    assert list(other) == [f"{name}_radians" for name in drawn]
    assert "gains in radians" in title_of(other["fig07_torque_radians"])
    assert not drawn.keys() & OF_ANY_RUN
    for name, figure in (drawn | other).items():
        assert cut_off(figure) == [], name
    for name, figure in drawn.items():
        assert figure.legends, name
        assert all(ax.lines for ax in figure.axes), name
        assert all("(" in ax.get_ylabel() for ax in figure.axes[:: 2 if "error" in name or "torque" in name else 1]), (
            name
        )
    texts = [text.get_text() for text in drawn["fig09-11_tracking_error_half_gains"].legends[0].texts]
    assert texts == ["PPATC", "ATC", "PPATC, half gains", "ATC, half gains", "bounds"]


def test_figures_of_one_short_run(tmp_path):
    short = T[T <= 10]
    drawn = papers.draw_run(PPATC, synthetic(decaying(time=short), time=short))
    assert {"attitude_error", "fig02-04_tracking_error", "fig05_attitude"} <= set(drawn)
    assert not any(name.startswith("fig09") for name in drawn)
    assert all(file.is_file() for file in plots.save(drawn, tmp_path))
    assert not any(name.startswith("fig05") for name in papers.draw_run(ATC, synthetic(decaying())))
