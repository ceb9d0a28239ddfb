"""Texts of the project's root as pages of the site, links between root and docs/, names of files above their code."""

import re
from pathlib import Path

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

ROOT = Path(__file__).parents[2]
PAGES = {"README.md": "index.md", "CONTRIBUTING.md": "contributing.md", "CHANGELOG.md": "changelog.md"}
FILES = ("CITATION.cff",)


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the pages, and files that are given as they are."""
    for name, page in PAGES.items():
        files.append(File.generated(config, page, content=_within(ROOT / name)))
    for name in FILES:
        files.append(File.generated(config, name, abs_src_path=str(ROOT / name)))
    return files


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Return the page with links to the root's texts as links to their pages.

    ```` ```python FILE ```` gets a title, and `<!-- file: PATH -->` becomes the file.
    """
    up = "../" * page.file.src_uri.count("/")
    for name, target in PAGES.items():
        markdown = markdown.replace(f"]({up}../{name}", f"]({up}{target}")
    markdown = re.sub(r"^<!-- file: (\S+) -->$", lambda m: _code(ROOT / m[1]), markdown, flags=re.MULTILINE)
    markdown = re.sub(r"^```(\w+) (\w+\.\w+)$", r'```\1 title="\2"', markdown, flags=re.MULTILINE)
    return re.sub(r"^```sh pip$", "```sh", markdown, flags=re.MULTILINE)


def _within(path: Path) -> str:
    """Return a text of the root with its links as the site has them."""
    text = path.read_text(encoding="utf-8").replace("](docs/", "](")
    for name, page in PAGES.items():
        text = text.replace(f"]({name}", f"]({page}")
    return text


def _code(path: Path) -> str:
    language = {".py": "python", ".sh": "sh", ".toml": "toml"}[path.suffix]
    return f"```{language} {path.name}\n{path.read_text(encoding='utf-8')}```"
