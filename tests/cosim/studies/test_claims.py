"""A verdict follows from the parts of a claim, in each reading of it, and says which of them fail."""

import pyarrow as pa
import pytest

from cosim.results.result import Result
from cosim.studies.papers.claims import Claim, Measured, decide, in_all_readings

YES, NO, HALF = {"a": True, "b": True}, {"a": False, "b": False}, {"a": True, "b": False}
RUN = Result(pa.table({"time": [0.0, 1.0]}), {})


def judged(measure, **more):
    claim = Claim(
        paper="p", text="t", paper_number="1", criterion="c", runs=("r",), until=1.0, measure=lambda _: measure, **more
    )
    return claim.judge({"r": RUN})


@pytest.mark.parametrize(
    ("readings", "outcome"),
    [
        ({"": YES}, "reproduced"),
        ({"": HALF}, "partly"),
        ({"": NO}, "not reproduced"),
        ({"": {}}, "not judged"),
        ({"deg": YES, "rad": YES}, "reproduced"),
        ({"deg": YES, "rad": NO}, "in one reading"),
        ({"deg": YES, "rad": HALF}, "in one reading"),
        ({"deg": HALF, "rad": NO}, "partly"),
        ({"deg": NO, "rad": NO}, "not reproduced"),
        ({"deg": {}, "rad": YES}, "reproduced"),
    ],
)
def test_an_outcome_follows_from_its_parts(readings, outcome):
    assert decide(readings) == outcome


def test_the_reading_that_holds_is_named():
    verdict = judged({"deg": Measured("1", YES), "rad": Measured("2", HALF), "both": Measured("3", NO)})
    assert (verdict.word, verdict.measured) == ("in one reading (deg)", "deg: 1; rad: 2; both: 3")
    assert verdict.failing == "rad: b; both: all of it"
    assert verdict.holds["rad: b"] is False


def test_several_readings_that_hold_are_named():
    verdict = judged({"deg": Measured("1", YES), "rad": Measured("2", YES), "both": Measured("3", NO)})
    assert verdict.word == "in 2 readings (deg, rad)"


def test_partly_names_what_fails():
    verdict = judged(Measured("1", HALF), depends="gamma = 1, chosen", beyond=True)
    assert (verdict.word, verdict.failing, verdict.measured) == ("partly", "b", "1")
    assert (verdict.depends, verdict.beyond) == ("gamma = 1, chosen", True)


def test_a_claim_without_its_runs_has_no_parts():
    claim = Claim(paper="p", text="t", paper_number="1", criterion="c", runs=("q",), until=1.0, measure=lambda _: {})
    verdict = claim.judge({"r": RUN})
    assert (verdict.verdict, verdict.measured, verdict.failing) == ("not judged", "needs q", "")


def test_a_claim_whose_readings_have_runs_of_their_own_takes_them_all():
    def reading(name, holds):
        return Claim(
            paper="p", text="t", paper_number="1", criterion="c", runs=(name,), until=1.0,
            measure=lambda runs: {name: Measured(str(len(runs)), holds)},
        )  # fmt: skip

    whole = in_all_readings([reading("deg", NO), reading("rad", YES)])
    assert whole.judge({"deg": RUN}).measured == "needs rad"
    assert whole.judge({"deg": RUN, "rad": RUN}).word == "in one reading (rad)"
    assert [claim.runs for claim in whole.alone] == [("deg",), ("rad",)]
    assert whole.alone[0].judge({"deg": RUN}).verdict == "not reproduced"
