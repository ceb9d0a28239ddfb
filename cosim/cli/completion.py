"""What a shell completes: names of systems, components and papers, files beside them. Imports nothing that is slow."""

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
    """Return INSTANCE=COMPONENT that begin so; the instances are those of the paper's system that is named before."""
    instance, equals, reference = incomplete.partition("=")
    if equals:
        return [f"{instance}={name}" for name in components(reference)]
    typed = (context.params.get("name"), *context.args)  # the latter while the option's value is missing
    name = next((text for text in typed if text in papers.describe()), None)
    there = papers.scenario(name)[0].components if name is not None else ()
    return [f"{i}=" for i in there if i.startswith(incomplete)]


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
