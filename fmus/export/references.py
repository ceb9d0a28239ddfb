"""How a component is named from outside: NAME or FILE.py:Class, either with a structure, as in NAME:modes=6.

Several structural parameters follow each other, as in Notch:width=3,unit=N.m.
"""

import inspect
import re
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from components.catalog import CATALOG, MODULES
from fmus.description.names import did_you_mean, did_you_mean_file
from fmus.errors import UnknownComponent
from fmus.export.blame import blamed
from fmus.export.cells import file_of_class, is_of_session
from fmus.export.imports import imported
from fmus.export.reads import Reads, noting
from fmus.export.sources import OURS, Sources, sources_of

if TYPE_CHECKING:
    from components.framework import Component


@dataclass(frozen=True)
class Reference:
    """A parsed reference: a catalog name, or a class of a file, and structural parameters."""

    text: str
    file: Path | None
    name: str
    structure: tuple[tuple[str, int | str], ...]

    @property
    def model_name(self) -> str:
        """The FMU's name: the component's, with its structure where that was given."""
        return self.name + "".join(f"_{key}{_word(value)}" for key, value in self.structure)

    def sources(self) -> Sources:
        """Return the source files of the component; nothing is imported. Raises UnknownComponent."""
        if self.file is not None:
            return _sources_of_file(self.file)
        self._require_entry()
        return sources_of(MODULES[self.name])

    def component(self) -> "Component":
        """Return the component; no CasADi function is built. Raises UnknownComponent, ComponentFailed."""
        return self.component_and_reads({})[0]

    def component_and_reads(self, values: Mapping[str, Any]) -> "tuple[Component, Reads]":
        """Return the component with some start values, by variable name, and what its code has read so far."""
        reads = Reads()
        if self.file is not None:
            make, reads = _class_of(self.file, self.name)
        else:
            self._require_entry()
            with noting(reads):
                make = CATALOG[self.name]
        with blamed(self.file and self.file.resolve().parent), noting(reads):
            component = make().variant(**dict(self.structure)) if self.structure else make()
            return (type(component)(**(component.given | dict(values))) if values else component), reads

    def _require_entry(self) -> None:
        if self.name not in CATALOG:
            text = (
                f'unknown component "{self.name}".{did_you_mean(self.name, CATALOG)} Components: {", ".join(CATALOG)}.'
            )
            raise UnknownComponent(self.name, text)


def parse(text: "str | type") -> Reference:
    """Return a reference from a text or a class; raises UnknownComponent where it is none."""
    if isinstance(text, type):
        return _of_class(text)
    head, *parts = re.split(r":(?![\\/])", text)
    file = Path(head) if head.endswith(".py") else None
    name = parts.pop(0) if file is not None and parts and "=" not in parts[0] else head
    structure: list[tuple[str, int | str]] = []
    for part in (one for several in parts for one in several.split(",")):
        key, _, value = part.partition("=")
        if not (key.isidentifier() and value):
            raise UnknownComponent(text, f"{text!r}: {part!r} is not NAME=VALUE, as in {head}:modes=6.")
        structure.append((key, int(value) if value.isdecimal() else value))
    if file is not None and name == head:
        name = _only_class(file)
    return Reference(text, file, name, tuple(structure))


def of_file(component: "Component") -> "Component":
    """Return the component, made of a class that has a file: one of a notebook's cell gets one (cells.py)."""
    cls = type(component)
    if not is_of_session(cls):
        return component
    return type(parse(cls).component())(**component.given)


def _word(value: int | str) -> str:
    """Return a value as part of a name that C takes; two units never give the same."""
    return re.sub(r"\W", "_", str(value).replace("/", "_per_"))


def _of_class(cls: type) -> Reference:
    from components.framework import Component

    name, full = cls.__name__, f"{cls.__module__}.{cls.__qualname__}"
    if not issubclass(cls, Component):
        raise UnknownComponent(name, f"{full} is no component: derive it from components.framework.Component.")
    if name in CATALOG and CATALOG[name] is cls:
        return Reference(name, None, name, ())
    if cls.__module__.partition(".")[0] in OURS:
        raise UnknownComponent(name, f"{full} is none of the catalog: derive a class of your own from it.")
    file = file_of_class(cls) if is_of_session(cls) else Path(str(sys.modules[cls.__module__].__file__))
    return Reference(f"{file}:{name}", file, name, ())


def _sources_of_file(file: Path) -> Sources:
    """Return a user's file with what it imports; a mistake in its syntax is told as such."""
    _require_file(file)
    path = file.resolve()
    with blamed(path.parent):
        return sources_of(path.stem, path.parent)


def _require_file(file: Path) -> None:
    if not file.is_file():
        raise UnknownComponent(str(file), f"there is no file {file}.{did_you_mean_file(file)}")


def _classes(file: Path) -> "tuple[dict[str, type[Component]], Reads]":
    """Return the component classes that a file defines itself, and what its code has read."""
    from components.framework import Component

    _require_file(file)
    found = imported(file)
    members = inspect.getmembers(found.module, inspect.isclass)
    classes = {n: c for n, c in members if issubclass(c, Component) and c.__module__ == found.module.__name__}
    return classes, found.reads


def _class_of(file: Path, name: str) -> "tuple[type[Component], Reads]":
    classes, reads = _classes(file)
    if name not in classes:
        there = ", ".join(classes) or "none"
        text = f'{file} defines no component "{name}".{did_you_mean(name, classes)} Components in it: {there}.'
        raise UnknownComponent(name, text)
    return classes[name], reads


def _only_class(file: Path) -> str:
    classes = list(_classes(file)[0])
    if len(classes) != 1:
        there = ", ".join(classes) or "none"
        raise UnknownComponent(str(file), f"{file}: say which component, as {file}:Class. Components in it: {there}.")
    return classes[0]
