"""The bibliography, papers.bib: who wrote what, where and when."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path

_FIELD = re.compile(r"^\s*(\w+)\s*=\s*\{(.*)\},?\s*$", re.MULTILINE)


@dataclass(frozen=True)
class Entry:
    """An article; `authors` as "Zhang, C."; `fields`: what papers.bib has beside them."""

    key: str
    authors: tuple[str, ...]
    fields: Mapping[str, str]

    @property
    def surnames(self) -> str:
        """The authors in short: "Zhang, Sun, Ma, Li"."""
        return ", ".join(name.partition(",")[0] for name in self.authors)

    @property
    def title(self) -> str:
        """Surnames, title, year in one line."""
        return f"{self.surnames}: {self.fields['title']} ({self.fields['year']})"

    @property
    def citation(self) -> str:
        """Authors, title, journal, volume, number and year, as docstrings have it."""
        names = ", ".join(f"{first} {last}" for last, _, first in (name.partition(", ") for name in self.authors))
        f = self.fields
        return f"{names}, {f['title']}, {f['journal']} {f['volume']}({f['number']}), {f['year']}"


@cache
def entries() -> Mapping[str, Entry]:
    """Return the entries by their keys."""
    text = (Path(__file__).parent / "papers.bib").read_text(encoding="utf-8")
    found: dict[str, Entry] = {}
    for part in re.split(r"^@\w+\{", text, flags=re.MULTILINE)[1:]:
        key = part.partition(",")[0]
        fields = dict(_FIELD.findall(part))
        found[key] = Entry(key, tuple(fields.pop("author").split(" and ")), fields)
    return found
