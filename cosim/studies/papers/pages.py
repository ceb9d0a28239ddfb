"""The page of a paper: what it does, its equations and the lines that compute them, numbers, experiments, claims.

Written from the sources, the verdicts, and the paper's notes.md, which is written by hand.
"""

import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from components.catalog import MODULES
from cosim.results.folder import write_text
from cosim.studies import markdown
from cosim.studies.papers import numbered
from cosim.studies.papers.bibliography import entries
from cosim.studies.papers.paper import PAPERS, Paper

CLAIMS, INDEX = "claims.json", "index.md"
ROOT = Path(__file__).parents[3]
BEGIN, END = "<!-- claims: written by adcs reproduce --docs -->\n", "<!-- end of claims -->\n"
Row = Mapping[str, Any]
"""A verdict as claims.json has it."""


def refresh(project: Path, verdicts: Sequence[Row], figures: Mapping[str, Mapping[str, str]]) -> tuple[Path, ...]:
    """Write the pages and the table of all claims in a project's folder anew, and claims.json that they are made from.

    `figures`: paper -> file name without suffix -> title. Returns the files.
    """
    folder = project / "docs" / "papers"
    index = folder / INDEX
    texts = {
        folder / CLAIMS: json.dumps({"claims": list(verdicts), "figures": figures}, indent=2) + "\n",
        index: with_short(index.read_text(encoding="utf-8"), verdicts),
        **{folder / f"{key}.md": write_page(PAPERS[key], verdicts, titles) for key, titles in figures.items()},
    }
    folder.mkdir(parents=True, exist_ok=True)
    for path, text in texts.items():
        write_text(path, text)
    return tuple(texts)


def write_page(paper: Paper, verdicts: Sequence[Row], figures: Mapping[str, str]) -> str:
    """Return the page of a paper; `verdicts`: of all papers; `figures`: file name without suffix -> title."""
    entry = entries()[paper.key]
    verdicts = [v for v in verdicts if v["paper"] == paper.key]
    notes = (Path(__file__).parent / paper.key / "notes.md").read_text(encoding="utf-8")
    doi = f", doi {entry.fields['doi']}" if "doi" in entry.fields else ""
    parts = [
        f"# {paper.key}\n",
        f"{entry.citation}, pages {entry.fields['pages'].replace('--', ' to ')}{doi}.\n",
        notes,
        "## Equations\n",
        *(_equations(module) for module in _modules(paper)),
        "## Numbers\n",
        _numbers(paper),
        "## Experiments\n",
        markdown.write_table(("experiment", "what flies"), paper.experiments.items()),
        "## Claims\n",
        _claims(v for v in verdicts if not v["beyond"]),
        *(["### Beyond the paper\n", _claims(beyond)] if (beyond := [v for v in verdicts if v["beyond"]]) else []),
        "## Figures\n",
        markdown.write_table(("file", "what it shows"), ((f"`{name}.png`", text) for name, text in figures.items())),
    ]
    return "\n".join(parts)


def write_short(verdicts: Iterable[Row]) -> str:
    """Return the short table of all papers: claim, verdict, and the case, axis or reading that fails."""
    head = ("paper", "claim", "paper says", "verdict", "what fails")
    rows = [[v["paper"], v["claim"], v["said"], v["word"], v["failing"]] for v in verdicts if not v["beyond"]]
    return BEGIN + markdown.write_table(head, rows) + END


def with_short(index: str, verdicts: Iterable[Row]) -> str:
    """Return the text of a page with the short table between its marks."""
    before, rest = index.split(BEGIN)
    return before + write_short(verdicts) + rest.split(END)[1]


def _modules(paper: Paper) -> list[str]:
    """Return the modules of the components that the paper's experiments fly."""
    names = {r.partition(":")[0] for e in paper.experiments for r in paper.make(e)[0].components.values()}
    return [MODULES[name] for name in sorted(names) if name in MODULES]


def _equations(module: str) -> str:
    file = Path(*module.split(".")).with_suffix(".py")
    rows = [
        (f"({e.number})", f"`{e.text}`", ", ".join(f"[{n}](../../{file.as_posix()}#L{n})" for n in e.lines))
        for e in numbered.equations(ROOT / file)
    ]
    return f"`{file.as_posix()}`\n\n" + markdown.write_table(("number", "equation", "lines"), rows)


def _numbers(paper: Paper) -> str:
    found = numbered.numbers(f"components.numbers.{paper.key}")
    found += [n for n in numbered.numbers(f"cosim.studies.papers.{paper.key}.system") if n.origin]
    rows = [(f"`{n.name}`", n.value, n.remark, n.section) for n in found]
    return markdown.write_table(("name", "value", "unit", "where it is from"), rows)


def _claims(verdicts: Iterable[Row]) -> str:
    head = ("claim", "paper says", "measured", "verdict", "what fails", "depends on", "criterion")
    keys = ("claim", "said", "measured", "word", "failing", "depends", "criterion")
    return markdown.write_table(head, ([v[key] for key in keys] for v in verdicts))
