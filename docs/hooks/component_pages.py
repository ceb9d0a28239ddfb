"""A page for every component of the catalog, from its docstring and declarations, and their list by kind."""

import io
from collections.abc import Iterator
from importlib import import_module

import matplotlib as mpl
import matplotlib.pyplot as plt
from component_figures import FIGURES
from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files

from components.catalog import MODULES
from components.framework import Component
from fmus.export.documentation import css, html_body, page_of

STYLE = "components.css"
HEAD = """# Components

What `adcs list` names. Each is one file, one FMU, and a page: equations, source, invariants, limits, variables with
units. `adcs show NAME` prints the same.

"""


def on_config(config: MkDocsConfig) -> MkDocsConfig:
    """Add the components to the navigation, kind by kind, and their style."""
    section = next(entry["Components"] for entry in config.nav if "Components" in entry)
    section += [{kind: [f"components/{name}.md" for name in names]} for kind, names in _by_kind().items()]
    config.extra_css = [*config.extra_css, STYLE]
    return config


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the style, the list and the pages with their figures."""
    mpl.use("agg")
    files.append(File.generated(config, STYLE, content=css()))
    files.append(File.generated(config, "components.md", content=HEAD + "\n".join(_lists())))
    for name in MODULES:
        files.append(File.generated(config, f"components/{name}.md", content=_page(name, config, files)))
    return files


def _by_kind() -> dict[str, list[str]]:
    """Return the names of components by the folder of their file, in words."""
    kinds: dict[str, list[str]] = {}
    for name, module in MODULES.items():
        kinds.setdefault(module.split(".")[1].capitalize(), []).append(name)
    return dict(sorted(kinds.items()))


def _component(name: str) -> type[Component]:
    return getattr(import_module(MODULES[name]), name)


def _lists() -> Iterator[str]:
    for kind, names in _by_kind().items():
        yield f"## {kind}\n\n| component | what it is |\n| --- | --- |"
        yield from (f"| [{name}](components/{name}.md) | {page_of(_component(name)).title} |" for name in names)
        yield ""


def _page(name: str, config: MkDocsConfig, files: Files) -> str:
    source = f"{MODULES[name].replace('.', '/')}.py"
    parts = [f"---\ntitle: {name}\n---\n{html_body(page_of(_component(name)))}\n"]
    if name in FIGURES:
        figure, caption = FIGURES[name]()
        with io.StringIO() as svg:
            figure.savefig(svg, format="svg", metadata={"Date": None})
            plt.close(figure)
            files.append(File.generated(config, f"components/{name}.svg", content=svg.getvalue()))
        parts.append(f"## In a figure\n\n![{caption}]({name}.svg)\n\n{caption}\n")
    return "\n".join([*parts, f"Source code: [{source}](../../{source})\n"])
