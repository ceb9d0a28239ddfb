"""What the source of a paper's components and numbers says: equations with the lines that compute them, and numbers.

An equation stands in a module's docstring with its number at the end of the line, "(12)"; a line of code that computes
it carries the number in a comment. A number is a constant with a capital name; it stands under a comment that says
where it comes from: Printed, Corrected or Chosen.
"""

import ast
import io
import re
import tokenize
from collections.abc import Iterator
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

ORIGINS = ("Printed", "Corrected", "Chosen")
_EQUATION = re.compile(r"^ {4}(?P<text>\S.*?)\s+\((?P<number>\d+[a-z]*)\)$")
_NUMBERS = re.compile(r"\((\d+[a-z]*)\)")


@dataclass(frozen=True)
class Equation:
    """An equation of a module: its number there, its text, the lines of code that carry the number."""

    number: str
    text: str
    lines: tuple[int, ...]


@dataclass(frozen=True)
class Number:
    """A constant: its name, its value as text, the comment on its line (unit, remark), and under what it stands."""

    name: str
    value: str
    remark: str
    section: str

    @property
    def origin(self) -> str:
        """Printed, Corrected or Chosen; "" where the section says none of them."""
        word = re.split(r"\W", self.section, maxsplit=1)[0]
        return word if word in ORIGINS else ""


def equations(file: Path) -> list[Equation]:
    """Return the numbered equations of a module, in the order of its docstring."""
    source = file.read_text(encoding="utf-8")
    docstring = ast.get_docstring(ast.parse(source), clean=False) or ""
    lines: dict[str, list[int]] = {}
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type == tokenize.COMMENT:
            for number in _NUMBERS.findall(token.string):
                lines.setdefault(number, []).append(token.start[0])
    found = [match for line in docstring.splitlines() if (match := _EQUATION.match(line))]
    return [Equation(m["number"], m["text"], tuple(lines.get(m["number"], ()))) for m in found]


def numbers(module: str) -> list[Number]:
    """Return the constants of a module that stand under a comment, in its order."""
    imported = import_module(module)
    source = Path(str(imported.__file__)).read_text(encoding="utf-8")
    lines = source.splitlines()
    section, found = "", list[Number]()
    sections = dict(_sections(source))
    for node in ast.parse(source).body:
        above = [line for line in sections if line < node.lineno]
        section = sections[max(above)] if above else ""
        if isinstance(node, ast.Assign) and section:
            names = [n.id for target in node.targets for n in ast.walk(target) if isinstance(n, ast.Name)]
            comments = [_comment(lines[i]) for i in (node.lineno - 1, (node.end_lineno or node.lineno) - 1)]
            remark = next((text for text in comments if text), "")
            found += [Number(n, _value(getattr(imported, n)), remark, section) for n in names if n.isupper()]
    return found


def _sections(source: str) -> Iterator[tuple[int, str]]:
    """Yield line number and text of the comments that stand alone at the left margin."""
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type == tokenize.COMMENT and token.start[1] == 0:
            yield token.start[0], token.string.lstrip("# ").rstrip(".")


def _comment(line: str) -> str:
    return line.partition("  # ")[2].strip()


def _value(value: Any) -> str:
    """Return a number or an array as short text."""
    if isinstance(value, dict):
        return ", ".join(f"{key}: {_value(inner)}" for key, inner in value.items())
    array = np.asarray(value, dtype=object) if isinstance(value, str) else np.asarray(value)
    if array.dtype.kind not in "fiu":
        return str(value)
    if array.size > 12:
        return f"{' x '.join(map(str, array.shape))} numbers, {array.min():.4g} to {array.max():.4g}"
    return np.array2string(array, precision=6, separator=", ", floatmode="maxprec").replace("\n", "")
