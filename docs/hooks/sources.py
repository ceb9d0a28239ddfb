"""The source files that pages point to, as pages with numbered lines; links to `path.py#L12` go there."""

import re
from collections.abc import Iterator
from pathlib import Path

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files, InclusionLevel
from mkdocs.structure.pages import Page

from components.catalog import MODULES

ROOT = Path(__file__).parents[2]
LINK = re.compile(r"\]\((?:\.\./)+((?:components|cosim|fmus|examples)/[\w/]+\.py)(?:#L(\d+))?\)")


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add a page for every source file that a page links to, and for every component."""
    linked = {path for file in files.documentation_pages() for path, _ in LINK.findall(file.content_string)}
    for path in sorted(linked | set(_of_components())):
        page = File.generated(config, page_of(path), content=_page(path), inclusion=InclusionLevel.NOT_IN_NAV)
        files.append(page)
    return files


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Return the page with links to source files as links to their pages and lines."""
    up = "../" * page.file.src_uri.count("/")
    return LINK.sub(lambda m: f"]({up}{page_of(m[1])}" + (f"#line-0-{m[2]}" if m[2] else "") + ")", markdown)


def page_of(path: str) -> str:
    """Return the page of a source file."""
    return f"source/{path.removesuffix('.py')}.md"


def _of_components() -> Iterator[str]:
    return (f"{module.replace('.', '/')}.py" for module in MODULES.values())


def _page(path: str) -> str:
    code = (ROOT / path).read_text(encoding="utf-8")
    return f'---\nsearch:\n  exclude: true\n---\n# {path}\n\n````python linenums="1"\n{code}````\n'
