"""A component class of a notebook's cell, or of a script that is running, becomes a file: its text and what that names.

A cell's text is where Python's own tracebacks find it, in linecache. What the text names is written before it: imports,
functions and classes of other cells, and data by their values. A class whose text gives another class by now, since a
cell was changed and not run again, is refused.
"""

import ast
import hashlib
import linecache
import sys
import sysconfig
import textwrap
import uuid
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from types import CodeType, FunctionType, ModuleType
from typing import Any

from fmus import places
from fmus.errors import ComponentFailed
from fmus.export.literals import literal, same
from fmus.export.sources import OURS, sources_of
from fmus.export.statements import attributes, global_names, named, of_cell, start_line

_PACKAGES = {"site-packages", "dist-packages"}
_LIBRARIES = {Path(sysconfig.get_path(name)).resolve() for name in ("stdlib", "platstdlib")}


def is_of_session(cls: type) -> bool:
    """Whether a class has no module's file: it was defined in a cell, at a prompt, or in the script that runs."""
    file = getattr(sys.modules.get(cls.__module__), "__file__", None)
    return cls.__module__ == "__main__" or file is None or not Path(file).is_file()


def file_of_class(cls: type) -> Path:
    """Return a file with a class of the session, in the cache, its folder named by its content.

    Raises ComponentFailed where the class's text, or a value that it names, cannot be had.
    """
    name, session = cls.__name__, sys.modules.get(cls.__module__)
    if cls.__qualname__ != name:
        raise _failed(name, f"it is defined inside another thing, {cls.__qualname__}", "Define it at the top of a cell")
    texts = list(_texts(session))
    found = [place for place in _places(texts, name) if isinstance(place.statement, ast.ClassDef)]
    if session is None or not found:
        raise _failed(name, "its source is not kept, for it was defined at a prompt or by exec", "Define it in a cell")
    problem = ""
    for place in reversed(found):
        module = _Module(session, texts)
        module.add(name, place)
        try:
            others = module.others(cls)
            if not others:
                return module.written(name)
            problem = f"its source, run again, gives another {', '.join(others)}"
        except Exception as error:
            problem = f"its source, run again, fails: {type(error).__name__}: {error}"
    raise _failed(name, problem, "Run its cell again")


def _failed(name: str, problem: str, way_out: str) -> ComponentFailed:
    return ComponentFailed(f"the class {name} cannot go into an FMU: {problem}. {way_out}, or put it into a file.")


# ---- what there is to read -------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Text:
    file: str
    text: str
    tree: ast.Module


@dataclass(frozen=True)
class _Place:
    """A statement of a text, outside functions and classes."""

    text: _Text
    statement: ast.stmt

    @property
    def source(self) -> str:
        """Its text, decorators included."""
        if not isinstance(self.statement, ast.ClassDef | ast.FunctionDef):
            return ast.get_source_segment(self.text.text, self.statement) or ""
        lines = self.text.text.splitlines()[start_line(self.statement) - 1 : self.statement.end_lineno]
        return textwrap.dedent("\n".join(lines))

    def holds(self, code: CodeType) -> bool:
        """Whether a function was compiled from here."""
        first, last = start_line(self.statement), self.statement.end_lineno or 0
        return code.co_filename == self.text.file and first <= code.co_firstlineno <= last


def _texts(session: ModuleType | None) -> Iterator[_Text]:
    """Yield the script, if there is one, and the cells, in the order in which they were first run."""
    script = getattr(session, "__file__", None)
    files = [script] if script is not None and Path(script).is_file() else []
    # A text that comes from no file has no time of change, so that linecache keeps it.
    files += [file for file, entry in list(linecache.cache.items()) if len(entry) == 4 and entry[1] is None]
    for file in files:
        text = "".join(linecache.getlines(file))
        tree = of_cell(text)
        if tree is not None:
            yield _Text(file, text, tree)


def _places(texts: list[_Text], name: str) -> list[_Place]:
    """Return the statements that give a name its value."""
    return [_Place(text, statement) for text in texts for statement in named(text.tree, name)]


def _codes(value: Any) -> list[CodeType]:
    """Return the code of a function, or of a class's methods."""
    functions = vars(value).values() if isinstance(value, type) else [value]
    return [f.__code__ for f in functions if isinstance(f, FunctionType)]


# ---- what is written -------------------------------------------------------------------------------------------


@dataclass
class _Module:
    """The module that is made: imports, statements in their order, and the user's own files that they import."""

    session: ModuleType
    texts: list[_Text]
    imports: set[str] = field(default_factory=set)
    statements: list[str] = field(default_factory=list)
    files: dict[str, Path] = field(default_factory=dict)
    done: set[str] = field(default_factory=set)

    def add(self, name: str, place: _Place) -> None:
        """Add a statement that gives a name its value, after all that it names."""
        self.done.add(name)
        if isinstance(place.statement, ast.ImportFrom):
            self._bring(place.statement.module or "")
            self.imports.add(place.source)
            return
        there = vars(self.session)
        for needed in sorted(global_names(place.source) - self.done):
            if needed in there:
                self._need(needed, there[needed], name, attributes(place.statement, needed))
        self.statements.append(place.source)

    def _need(self, name: str, value: Any, user: str, chains: list[str]) -> None:
        """Add what gives a name its value: an import, a definition, a literal, a statement of a cell."""
        self.done.add(name)
        if isinstance(value, ModuleType):
            return self._import_module(name, value.__name__, chains)
        if isinstance(value, type | FunctionType) and _importable(value, self.session):
            return self._import_from(value.__module__, value.__qualname__, name)
        written = literal(value)
        if written is not None:
            if "numpy." in written:
                self.imports.add("import numpy")
            return self.statements.append(f"{name} = {written}")
        found = _places(self.texts, name)
        if not found:
            kind = type(value).__name__
            raise _failed(user, f"of {name}, a {kind} which it names, the source is not kept", f"Make {name} inside it")
        codes = _codes(value)
        held = [place for place in found if any(map(place.holds, codes))]
        return self.add(name, (held or found)[-1])

    def _import_module(self, name: str, module: str, chains: list[str]) -> None:
        """Import a module under a name, and those modules in it that are reached by attributes."""
        self._bring(module)
        inside = {module + chain.removeprefix(name) for chain in chains}
        self.imports |= {f"import {m}" for m in inside if m in sys.modules}
        self.imports.add(f"import {module}" + (f" as {name}" if name != module else ""))

    def _import_from(self, module: str, attribute: str, name: str) -> None:
        self._bring(module)
        alias = f" as {name}" if name != attribute else ""
        self.imports.add(f"from {module} import {attribute}{alias}")

    def _bring(self, module: str) -> None:
        """Take the files of a module that is the user's own: neither ours, nor installed."""
        top = module.partition(".")[0]
        file = getattr(sys.modules.get(top), "__file__", None)
        if top in OURS or file is None or not file.endswith(".py"):
            return
        path = Path(file).resolve()
        if _PACKAGES & set(path.parts) or _LIBRARIES & set(path.parents):
            return
        folder = path.parent.parent if path.name == "__init__.py" else path.parent
        found = sources_of(module, folder).files
        self.files |= {name: origin for name, origin in found.items() if origin.is_relative_to(folder)}

    @property
    def text(self) -> str:
        """The text of the module."""
        head = '"""Written from a notebook, or from a script that was running."""'
        return "\n\n".join([head, "\n".join(sorted(self.imports)), *self.statements]) + "\n"

    def others(self, cls: type) -> list[str]:
        """Return what the module defines and the session has otherwise: nothing, if it gives the class."""
        made: dict[str, Any] = {"__name__": self.session.__name__}
        exec(compile(self.text, "<cell>", "exec"), made)
        given = {**vars(self.session), cls.__name__: cls}
        return sorted(name for name in self.done & given.keys() if not same(made.get(name), given[name]))

    def written(self, name: str) -> Path:
        """Write the module and the files beside it; a content has one place, so that nothing there ever changes."""
        files = {relative: origin.read_bytes() for relative, origin in self.files.items()}
        files[f"{name}.py"] = self.text.encode()
        digest = hashlib.sha256(repr(sorted(files.items())).encode()).hexdigest()[:16]
        folder = places.made(places.cache() / "cells" / digest)
        for relative, data in files.items():
            path = folder / relative
            if not path.is_file() or path.read_bytes() != data:
                part = places.made(path.parent) / f".{path.name}-{uuid.uuid4().hex}"
                part.write_bytes(data)
                places.keep(part, path)
        return folder / f"{name}.py"


def _importable(value: Any, session: ModuleType) -> bool:
    """Whether a class or function is had by importing its module."""
    module = sys.modules.get(value.__module__)
    return module is not session and getattr(module, value.__qualname__, None) is value
