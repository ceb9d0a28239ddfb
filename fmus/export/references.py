"""How a component is named from outside: NAME or FILE.py:Class, either with a structure, as in NAME:modes=6."""

import inspect
import re
from dataclasses import dataclass
from pathlib import Path

from components.catalog import CATALOG
from components.framework import Component
from components.framework.errors import nearest
from fmus.errors import UnknownComponent
from fmus.export.blame import blamed
from fmus.export.source_loader import import_from
from fmus.export.sources import sources_of


@dataclass(frozen=True)
class Reference:
    """A parsed reference: a catalog name, or a class of a file, and structural parameters."""

    text: str
    file: Path | None
    name: str
    structure: tuple[tuple[str, int], ...]

    @property
    def model_name(self) -> str:
        """The FMU's name: the component's, with its structure where that was given."""
        return self.name + "".join(f"_{key}{value}" for key, value in self.structure)

    def component(self) -> Component:
        """Return the component; no CasADi function is built."""
        if self.file is not None:
            make = _class_of(self.file, self.name)
        elif self.name in CATALOG:
            make = CATALOG[self.name]
        else:
            known = sorted(CATALOG)
            text = f"unknown component {self.name!r}.{nearest(self.name, known)} Components: {', '.join(known)}."
            raise UnknownComponent(self.name, text)
        with blamed(self.file and self.file.resolve().parent):
            return make().variant(**dict(self.structure)) if self.structure else make()


def parse(text: str) -> Reference:
    """Return a reference; raises UnknownComponent where the text is none."""
    head, *parts = re.split(r":(?![\\/])", text)
    file = Path(head) if head.endswith(".py") else None
    name = parts.pop(0) if file is not None and parts and "=" not in parts[0] else head
    structure: list[tuple[str, int]] = []
    for part in parts:
        key, _, value = part.partition("=")
        if not (key.isidentifier() and value.isdigit()):
            raise UnknownComponent(text, f"{text!r}: {part!r} is not NAME=WHOLE NUMBER, as in {head}:modes=6.")
        structure.append((key, int(value)))
    if file is not None and name == head:
        name = _only_class(file)
    return Reference(text, file, name, tuple(structure))


def _classes(file: Path) -> dict[str, type[Component]]:
    """Return the component classes that a file defines itself."""
    if not file.is_file():
        raise UnknownComponent(str(file), f"there is no file {file}.")
    path = file.resolve()
    with blamed(path.parent):
        sources = sources_of(path.stem, path.parent)
        ours = {name for name, origin in sources.files.items() if origin.is_relative_to(path.parent)}
        module = import_from(path.parent, ours, path.stem)
    members = inspect.getmembers(module, inspect.isclass)
    return {n: c for n, c in members if issubclass(c, Component) and c.__module__ == module.__name__}


def _class_of(file: Path, name: str) -> type[Component]:
    classes = _classes(file)
    if name not in classes:
        there = ", ".join(classes) or "none"
        text = f"{file} defines no component {name!r}.{nearest(name, list(classes))} Components in it: {there}."
        raise UnknownComponent(name, text)
    return classes[name]


def _only_class(file: Path) -> str:
    classes = list(_classes(file))
    if len(classes) != 1:
        there = ", ".join(classes) or "none"
        raise UnknownComponent(str(file), f"{file}: say which component, as {file}:Class. Components in it: {there}.")
    return classes[0]
