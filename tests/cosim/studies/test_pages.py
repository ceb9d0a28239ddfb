"""The pages of the papers and the table of all claims are those that the sources and claims.json give."""

import json
from pathlib import Path

import pytest

from cosim.studies import papers
from cosim.studies.papers import numbered, pages

ROOT = Path(__file__).parents[3]
ANEW = "Write it anew: adcs reproduce --docs ."


@pytest.fixture(scope="module")
def known():
    return json.loads((ROOT / "docs" / "papers" / pages.CLAIMS).read_text(encoding="utf-8"))


@pytest.mark.parametrize("key", papers.PAPERS)
def test_a_page_is_what_its_sources_say(key, known):
    page = (ROOT / "docs" / "papers" / f"{key}.md").read_text(encoding="utf-8")
    assert page == pages.write_page(papers.PAPERS[key], known["claims"], known["figures"][key]), ANEW


def test_the_table_of_all_claims(known):
    index = (ROOT / "docs" / "papers" / pages.INDEX).read_text(encoding="utf-8")
    assert index == pages.with_short(index, known["claims"]), ANEW


def test_every_claim_of_every_paper_is_on_its_page(known):
    claims = [(c.paper, c.text) for paper in papers.PAPERS.values() for c in paper.claims]
    assert [(row["paper"], row["claim"]) for row in known["claims"]] == claims, ANEW


@pytest.mark.parametrize("key", papers.PAPERS)
def test_every_number_says_where_it_is_from(key):
    found = numbered.numbers(f"components.numbers.{key}")
    assert len(found) > 8
    assert [n.name for n in found if not n.origin] == []


def test_equations_have_their_lines():
    found = numbered.equations(ROOT / "components" / "controllers" / "pid.py")
    assert [e.number for e in found] == ["1", "2", "3", "4", "5"]
    source = (ROOT / "components" / "controllers" / "pid.py").read_text().splitlines()
    for equation in found:
        assert equation.lines and all(f"({equation.number})" in source[n - 1] for n in equation.lines)
