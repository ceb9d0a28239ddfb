"""What a shell completes: names of systems, components and papers, files beside them. Imports nothing that is slow."""

import os
from collections.abc import Iterator
from pathlib import Path

import typer

from components.catalog import MODULES
from cosim.studies import papers

FILES = (".py", ".fmu")


def systems(incomplete: str) -> list[str]:
    """Return systems that begin so, and files that could hold one."""
    return _beginning(incomplete, [*papers.describe()])


def components(incomplete: str) -> list[str]:
    """Return components that begin so, and files."""
    return _beginning(incomplete, [*MODULES])


def everything(incomplete: str) -> list[str]:
    """Return components and systems that begin so, and files."""
    return _beginning(incomplete, [*MODULES, *papers.describe()])


def paper_keys(incomplete: str) -> list[str]:
    """Return papers that begin so."""
    return [key for key in papers.PAPERS if key.startswith(incomplete)]


def swaps(context: typer.Context, incomplete: str) -> list[str]:
    """Return INSTANCE=COMPONENT that begin so; the instances are those of the paper's system that is named before.

    While several instances begin so, they alone: bash puts a blank behind what is whole.
    """
    instance, equals, reference = incomplete.partition("=")
    if equals:
        return [f"{instance}={name}" for name in components(reference)]
    typed = (context.params.get("name"), *context.args)  # the latter while the option's value is missing
    name = next((text for text in typed if text in papers.describe()), None)
    there = papers.scenario(name)[0].components if name is not None else ()
    found = [f"{i}=" for i in there if i.startswith(incomplete)]
    return [found[0] + name for name in components("")] if len(found) == 1 else found


def begin() -> None:
    """Let what stands behind an equals sign be a word, be it empty: there bash takes the sign for what is completed."""
    words, at = _words()
    if words[at : at + 1] == ["="]:
        os.environ["COMP_CWORD"] = str(at + 1)


def swapped(incomplete: str) -> list[str]:
    """Return components that begin so where bash has taken --use INSTANCE=COMPONENT for three words."""
    words, at = _words()
    behind = words[at - 3 : at]
    return components(incomplete) if behind[:1] == ["--use"] and behind[2:] == ["="] else []


def _words() -> tuple[list[str], int]:
    """Return the words that bash has found, and the place of the one that it completes."""
    place = os.environ.get("COMP_CWORD", "")
    return os.environ.get("COMP_WORDS", "").splitlines(), int(place) if place.isdigit() else 0


def _beginning(incomplete: str, names: list[str]) -> list[str]:
    return [name for name in names if name.startswith(incomplete)] + sorted(_files(incomplete))


def _files(incomplete: str) -> Iterator[str]:
    """Yield files and folders that begin so, folders with a stroke at their end."""
    folder, _, start = incomplete.rpartition("/")
    place = Path(f"{folder}/" if incomplete.startswith("/") else folder or ".").expanduser()
    try:
        found = [entry for entry in place.iterdir() if entry.name.startswith(start) and not entry.name.startswith(".")]
    except OSError:
        return
    for entry in found:
        if entry.is_dir() or entry.suffix in FILES:
            yield (f"{folder}/" if "/" in incomplete else "") + entry.name + ("/" if entry.is_dir() else "")
