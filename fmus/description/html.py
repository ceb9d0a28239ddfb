"""Tables for a notebook: what `_repr_html_` returns, every text escaped."""

from collections.abc import Iterable, Sequence
from html import escape


def title(text: str, *lines: str) -> str:
    """Return a line in bold, and lines under it."""
    return "".join([f"<p><b>{escape(text)}</b>", *(f"<br>{escape(line)}" for line in lines), "</p>"])


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a table, "" where it has no rows."""
    lines = ["".join(f'<td style="text-align: left">{escape(cell)}</td>' for cell in row) for row in rows]
    if not lines:
        return ""
    top = "".join(f'<th style="text-align: left">{escape(cell)}</th>' for cell in head)
    return f"<table><tr>{top}</tr>{''.join(f'<tr>{line}</tr>' for line in lines)}</table>"


def count(n: int, word: str) -> str:
    """Return "1 row", "2 rows"."""
    return f"{n} {word}{'' if n == 1 else 's'}"
