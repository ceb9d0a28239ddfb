"""What `adcs show` says about a component: its docstring, its structure and its variables. No FMU is built."""

import textwrap
from collections.abc import Iterator, Sequence

from components.framework import Component
from cosim.cli import console
from fmus.export import references
from fmus.export.documentation import ComponentPage, page_of
from fmus.export.documentation.page import KINDS, Block, Declared, Equation, Preformatted

NARROW = 90
"""Columns below which a table has no room beside its names: its rows become paragraphs."""

INDENT = 4


def write_component(reference: str) -> None:
    """Print the page of NAME or FILE.py:Class, either with a structure; raises UnknownComponent, ComponentFailed."""
    component = references.parse(reference).component()
    page, width = page_of(component), console.width()
    console.write("\n".join(_text(page, width)))
    for kind in KINDS:
        _write_variables(kind, page.of_kind(kind), width)
    lines = ["", "direct feedthrough:", *([f"  {line}" for line in _feedthrough(component)] or ["  none"])]
    console.write("\n".join(_wrapped(line, width, 4) if line.startswith(" ") else line for line in lines))


def _text(page: ComponentPage, width: int) -> Iterator[str]:
    """Yield the lines of the docstring, wrapped to a width."""
    yield _wrapped(f"{page.name}: {page.title}", width)
    for block in page.body:
        yield from ("", *_block(block, width))
    for word, blocks in page.sections.items():
        first, *others = blocks or ("",)
        lines = [_wrapped(f"{word}: {first}", width)] if isinstance(first, str) else [f"{word}:", *_block(first, width)]
        yield from ("", *lines, *(line for block in others for line in _block(block, width)))
    if page.facts:
        yield from ("", _wrapped(page.facts[0].upper() + page.facts[1:], width))


def _block(block: Block, width: int) -> Iterator[str]:
    if isinstance(block, str):
        yield _wrapped(block, width)
    elif isinstance(block, Preformatted):
        yield textwrap.indent(block.text, " " * INDENT)
    else:
        yield from (_equation(line, width) for line in block)


def _equation(line: Equation, width: int) -> str:
    """Return an equation as it is typed, its number at the right; what is too long goes on below."""
    number = f"({line.number})" if line.number else ""
    left = " " * (INDENT + line.indent)
    room = width - (len(number) + 1 if number else 0)
    rows = textwrap.wrap(
        line.text,
        room,
        initial_indent=left,
        subsequent_indent=left + " " * INDENT,
        break_long_words=False,
        break_on_hyphens=False,
    )
    rows[-1] = f"{rows[-1]:{room}} {number}" if number else rows[-1]
    return "\n".join(rows)


def _wrapped(text: str, width: int, indent: int = 0) -> str:
    """Return a paragraph in lines of at most a width, names whole."""
    lines = textwrap.wrap(
        text.strip(),
        width,
        initial_indent=" " * (indent // 2),
        subsequent_indent=" " * indent,
        break_long_words=False,
        break_on_hyphens=False,
    )
    return "\n".join(lines)


def _write_variables(kind: str, variables: Sequence[Declared], width: int) -> None:
    """Print the variables of a kind as a table, or where that has no room a paragraph each."""
    if not variables:
        return
    console.write(f"\n{kind}{'s' if len(variables) > 1 else ''}")
    if width >= NARROW:
        rows = [("", v.sized, v.unit, v.start, v.doc) for v in variables]
        console.write_table(("", "name", "unit", "start", "meaning"), rows, whole=(1, 2))
        return
    for v in variables:
        start = f", start {v.start}" if v.start else ""
        console.write(_wrapped(f"{v.sized} {v.unit}{start}", width, INDENT))
        console.write(textwrap.indent(_wrapped(v.doc, width - INDENT), " " * INDENT))


def _feedthrough(component: Component) -> list[str]:
    """Return lines `outputs <- inputs`, a line for all outputs that follow the same inputs."""
    outputs_of: dict[tuple[str, ...], list[str]] = {}
    for output, inputs in component.direct_feedthrough.items():
        if inputs:
            outputs_of.setdefault(tuple(inputs), []).append(output)
    return [f"{', '.join(outputs)} <- {', '.join(inputs)}" for inputs, outputs in outputs_of.items()]
