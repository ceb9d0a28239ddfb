"""A component's docstring and declarations as data, for whoever shows them: FMUs, `adcs show`, the documentation.

A docstring is a title, prose and equations, then sections, each from its word with a colon on. Lines that are indented
are equations, with their number in brackets at the end; a block without any number or equals sign is text as it is.
"""

import inspect
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from components.framework import Component, Variable
from fmus.description.names import nested
from fmus.export.describe import docstring_of

SECTIONS = ("Symbols", "Frames", "Source", "Invariants", "Limits")
_SECTION = re.compile(rf"(?:^|(?<=[.;] ))({'|'.join(SECTIONS)}): *", re.MULTILINE)
_NUMBER = re.compile(r"\s+\((\d+[a-z]*)\)$")


@dataclass(frozen=True)
class Equation:
    """One line of equations as it is typed; number: "" where it has none; indent: columns from its block's left end."""

    text: str
    number: str = ""
    indent: int = 0


@dataclass(frozen=True)
class Preformatted:
    """Lines that are neither prose nor equations, as they are typed."""

    text: str


Block = str | tuple[Equation, ...] | Preformatted
"""A paragraph, whose lines are joined, or lines that stand by themselves."""


@dataclass(frozen=True)
class Declared:
    """A variable; kind as in KINDS, start in words: one for all elements where they have one, "" if calculated."""

    name: str
    kind: str
    unit: str
    shape: tuple[int, ...]
    start: str
    doc: str

    @property
    def sized(self) -> str:
        """Name with size, as `J[3,3]`."""
        return self.name + (f"[{','.join(map(str, self.shape))}]" if self.shape else "")


KINDS = ("input", "output", "parameter", "tunable parameter", "calculated parameter", "state")
"""Kinds of variables, in the order in which they are shown; an output that is a state is an output."""


@dataclass(frozen=True)
class ComponentPage:
    """All that is said of a component.

    body: prose and equations before the sections. sections: word -> its blocks, in the order of the docstring.
    structure: structural parameter -> its value. sample_time in s, None where it is not sampled.
    """

    name: str
    title: str
    body: tuple[Block, ...]
    sections: Mapping[str, tuple[Block, ...]]
    structure: Mapping[str, int | str]
    variables: tuple[Declared, ...]
    role: str = ""
    sample_time: float | None = None
    python_only: bool = False

    def of_kind(self, kind: str) -> tuple[Declared, ...]:
        """Return the variables of a kind, in the order of their declaration."""
        return tuple(v for v in self.variables if v.kind == kind)

    @property
    def names(self) -> frozenset[str]:
        """Names of all variables and structural parameters."""
        return frozenset(v.name for v in self.variables) | self.structure.keys()

    @property
    def facts(self) -> str:
        """Role, structure, kind of time and back end in a line; "" where there is nothing to say."""
        said = [f"role in a loop: {self.role}"] if self.role else []
        said += ["structure: " + ", ".join(f"{n} = {v}" for n, v in self.structure.items())] if self.structure else []
        said += [f"sampled, every {self.sample_time:g} s"] if self.sample_time is not None else []
        return "; ".join([*said, *(["in plain Python: python back end only"] if self.python_only else [])])


def page_of(component: Component | type[Component]) -> ComponentPage:
    """Return the page of a component, or of a class with its own structure and start values."""
    part = component() if isinstance(component, type) else component
    title, body, sections = read_docstring(docstring_of(type(part)))
    return ComponentPage(
        name=part.name,
        title=title,
        body=body,
        sections=sections,
        structure=dict(part.structure),
        variables=tuple(_declared(part)),
        role=part.role,
        sample_time=None if part.sample_time is None else float(part.sample_time),
        python_only=part.python_only,
    )


# ---- docstring -------------------------------------------------------------------------------------------------


def read_docstring(text: str) -> tuple[str, tuple[Block, ...], dict[str, tuple[Block, ...]]]:
    """Return title, blocks before the sections, and section -> its blocks."""
    title, _, rest = inspect.cleandoc(text).partition("\n\n")
    pieces = _SECTION.split(rest)  # what is before the first, then word, text, word, text
    sections: dict[str, tuple[Block, ...]] = {}
    for word, said in zip(pieces[1::2], pieces[2::2], strict=True):
        sections[word] = sections.get(word, ()) + tuple(_blocks(said))
    return " ".join(title.split()), tuple(_blocks(pieces[0])), sections


def _blocks(text: str) -> Iterator[Block]:
    """Yield the blocks of a text: they end where the indentation begins or ends, prose at an empty line too."""
    gathered: list[str] = []
    for line in [*text.strip("\n").split("\n"), ""]:
        begun = bool(gathered) and gathered[0].startswith(" ")
        if gathered and (not line.strip() or line.startswith(" ") != begun):
            yield _lines(gathered) if begun else " ".join(" ".join(gathered).split())
            gathered = []
        if line.strip():
            gathered.append(line.rstrip())


def _lines(lines: Sequence[str]) -> Block:
    """Return indented lines as equations, or as they are where none has a number or an equals sign."""
    left = min(len(line) - len(line.lstrip()) for line in lines)
    if not any(_NUMBER.search(line) or " = " in line for line in lines):
        return Preformatted("\n".join(line[left:] for line in lines))
    found: list[Equation] = []
    for line in lines:
        number = _NUMBER.search(line)
        text = line[: number.start()] if number else line
        found.append(Equation(text.strip(), number[1] if number else "", len(text) - len(text.lstrip()) - left))
    return tuple(found)


# ---- variables -------------------------------------------------------------------------------------------------


def _declared(part: Component) -> Iterator[Declared]:
    """Yield every variable, in the order of value references."""
    kinds: list[tuple[Variable, str, bool]] = [  # with whether its start is calculated
        *((p, "tunable parameter" if p.tunable else "parameter", False) for p in part.parameters),
        *((c, "calculated parameter", True) for c in part.calculated_parameters),
        *((u, "input", False) for u in part.inputs),
        *((x, "output" if x.output else "state", x.calculated) for x in part.states),
        *((y, "output", not y.exact) for y in part.outputs_declared),
    ]
    for v, kind, calculated in kinds:
        yield Declared(v.name, kind, v.unit, v.shape, "" if calculated else start_text(v.start, v.shape), v.doc)


def start_text(start: Any, shape: tuple[int, ...]) -> str:
    """Return a start value in words, to six digits: one for all elements where they have one."""
    flat = [f"{float(value):.6g}" for value in np.ravel(start)]
    return flat[0] if len(set(flat)) == 1 else str(nested(flat, shape)).replace("'", "")
