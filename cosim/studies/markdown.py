"""Tables and lists in Markdown, as the reports of the studies have them."""

from collections.abc import Iterable, Sequence


def write_table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a table; a bar within a cell is escaped."""
    lines = [" | ".join(cell.replace("|", "\\|") for cell in row) for row in (head, ("---",) * len(head), *rows)]
    return "".join(f"| {line} |\n" for line in lines)


def write_list(lines: Iterable[str]) -> str:
    """Return a list of one line each."""
    return "".join(f"- {line}\n" for line in lines)
