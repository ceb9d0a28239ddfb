"""A component's page as HTML: a fragment for a site, or a document of its own. No script, no file outside."""

from collections.abc import Iterator, Sequence
from html import escape

from fmus.export.documentation.notation import has_crosses, typeset
from fmus.export.documentation.page import KINDS, Block, ComponentPage, Declared, Equation, Preformatted

INDENT = 0.5  # em a column of a continued line

_CSS = """
.component { line-height: 1.5; }
.component table { border-collapse: collapse; }
.component table.equations { font-family: "STIX Two Text", Cambria, "DejaVu Serif", "Times New Roman", serif;
  font-size: 1.08em; margin: 0.6em 0 0.8em 1.5em; width: calc(100% - 1.5em); }
.component table.equations td { border: 0; padding: 0.1em 0; vertical-align: top; }
.component table.equations td.number { text-align: right; padding-left: 1.5em; width: 1%; white-space: nowrap; }
.component sub, .component sup { font-size: 0.72em; line-height: 0; }
.component table.variables { width: 100%; font-size: 0.92em; margin: 0.3em 0 1.2em; }
.component table.variables th, .component table.variables td { text-align: left; vertical-align: top;
  padding: 0.2em 0.9em 0.2em 0; border-bottom: 1px solid rgba(128, 128, 128, 0.3); }
.component table.variables code, .component table.variables .unit { white-space: nowrap; }
.component .facts { opacity: 0.8; }
"""
_DOCUMENT_CSS = """
body { font-family: system-ui, "Segoe UI", "Helvetica Neue", Arial, sans-serif; max-width: 60em; margin: 2em auto;
  padding: 0 1em; color: #1c2733; background: #ffffff; }
h1 { font-size: 1.6em; margin-bottom: 0.2em; } h2 { font-size: 1.15em; margin: 1.4em 0 0.3em; }
code { font-family: ui-monospace, Consolas, "DejaVu Sans Mono", monospace; font-size: 0.9em; }
"""


def css() -> str:
    """Return the style of `html_body`; every rule is of the class `component`."""
    return _CSS.strip() + "\n"


def html_document(page: ComponentPage, foot: str = "") -> str:
    """Return the page as a document of its own, its style within; foot: a line under it."""
    below = f"<hr>\n<p>{escape(foot)}</p>\n" if foot else ""
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{escape(page.name)}</title>\n<style>\n{_DOCUMENT_CSS.strip()}\n{css()}</style>\n</head>\n"
        f"<body>\n{html_body(page)}{below}</body>\n</html>\n"
    )


def html_body(page: ComponentPage) -> str:
    """Return the page as a fragment, from its h1 on, in a `div` of the class `component`."""
    write = _Writer(page)
    lines = [f"<h1>{escape(page.name)}</h1>", f'<p class="title">{write.prose(page.title)}</p>']
    lines += write.blocks(page.body)
    for word, blocks in page.sections.items():
        lines += [f"<h2>{word}</h2>", *write.blocks(blocks)]
    if page.facts:
        lines += ["<h2>Structure</h2>", f'<p class="facts">{escape(page.facts)}</p>']
    for kind in KINDS:
        lines += write.table(kind, page.of_kind(kind))
    return '<div class="component">\n' + "\n".join(lines) + "\n</div>\n"


class _Writer:
    """Writes parts of one page: its names are known, and whether its x is a cross."""

    def __init__(self, page: ComponentPage) -> None:
        self.names = page.names
        blocks = [*page.body, *(b for section in page.sections.values() for b in section)]
        self.crosses = has_crosses(e.text for b in blocks if isinstance(b, tuple) for e in b)

    def prose(self, text: str) -> str:
        """Return a text."""
        return typeset(text, known=self.names, prose=True, crosses=self.crosses)

    def blocks(self, blocks: Sequence[Block]) -> Iterator[str]:
        """Yield an element a block."""
        for block in blocks:
            if isinstance(block, str):
                yield f"<p>{self.prose(block)}</p>"
            elif isinstance(block, Preformatted):
                yield f"<pre>{escape(block.text)}</pre>"
            else:
                yield f'<table class="equations">{"".join(map(self.equation, block))}</table>'

    def equation(self, line: Equation) -> str:
        """Return a row: the line, its number at the right."""
        shift = f' style="padding-left: {INDENT * line.indent:g}em"' if line.indent else ""
        formula = typeset(line.text, known=self.names, crosses=self.crosses)
        number = f"({line.number})" if line.number else ""
        return f'<tr><td class="formula"{shift}>{formula}</td><td class="number">{number}</td></tr>\n'

    def table(self, kind: str, variables: Sequence[Declared]) -> Iterator[str]:
        """Yield heading and table of the variables of a kind; nothing where there are none."""
        if not variables:
            return
        yield f"<h2>{kind.capitalize()}{'s' if len(variables) > 1 else ''}</h2>"
        starts = any(v.start for v in variables)
        head = ("name", "unit", *(("start",) if starts else ()), "meaning")
        rows = ["<tr>" + "".join(f"<th>{word}</th>" for word in head) + "</tr>"]
        for v in variables:
            name = f'<td><code id="{escape(v.name)}">{escape(v.sized)}</code></td>'
            start = f"<td>{escape(v.start)}</td>" if starts else ""
            rows.append(f'<tr>{name}<td class="unit">{escape(v.unit)}</td>{start}<td>{self.prose(v.doc)}</td></tr>')
        yield '<table class="variables">' + "\n".join(rows) + "</table>"
