"""Every citation of a paper in the tree is the one of papers.bib."""

import re
from pathlib import Path

import pytest

from cosim.studies import papers
from cosim.studies.papers.bibliography import entries

ROOT = Path(__file__).parents[3]
FOLDERS = ("components", "cosim", "fmus", "tests", "docs")
TEXTS = {
    path: re.sub(r"\s+", " ", path.read_text(encoding="utf-8"))
    for folder in FOLDERS
    for path in (ROOT / folder).rglob("*")
    if path.suffix in (".py", ".md", ".c", ".h") and path != Path(__file__)
} | {path: re.sub(r"\s+", " ", path.read_text(encoding="utf-8")) for path in ROOT.glob("*.md")}


def test_every_paper_has_an_entry():
    assert list(entries()) == list(papers.PAPERS)
    for key, entry in entries().items():
        assert key.endswith(entry.fields["year"]) and key.startswith(entry.surnames.partition(",")[0].lower())
        assert papers.PAPERS[key].title == f"{entry.surnames}: {entry.fields['title']} ({entry.fields['year']})"


@pytest.mark.parametrize("key", papers.PAPERS)
def test_a_title_is_cited_with_its_authors_and_place(key):
    """In a docstring: authors, title, journal volume(number), year."""
    entry, seen = entries()[key], 0
    for path, text in TEXTS.items():
        for match in re.finditer(re.escape(entry.fields["title"]), text):
            seen += 1
            begin = match.start() - entry.citation.index(entry.fields["title"])
            assert text[begin:].startswith(entry.citation), f"{path}: {text[max(begin, 0) : match.end() + 60]}"
    assert seen >= 3


@pytest.mark.parametrize("key", papers.PAPERS)
def test_authors_are_named_as_they_are(key):
    """Initials before a first author's surname, and a list of surnames before the year, are those of the entry."""
    entry = entries()[key]
    surname = entry.authors[0].partition(",")[0]
    second = entry.authors[1].partition(", ")[0]
    for path, text in TEXTS.items():
        for found in re.findall(rf"\b(\w\. {surname}, \w\. \w+(?:, \w\. \w+)*), ", text):
            assert entry.citation.startswith(found) or second not in found, f"{path}: {found}"
        for found in re.findall(rf"\b({surname}, {second}(?:, \w+)*) {entry.fields['year']}", text):
            assert found == entry.surnames, f"{path}: {found}"


def test_the_index_names_every_paper():
    index = TEXTS[ROOT / "docs" / "papers" / "index.md"]
    for key, entry in entries().items():
        assert f"| {key} | {entry.surnames} {entry.fields['year']} |" in index
