"""Which source files a component consists of: the modules that its module imports, and those that they import."""

import ast
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import components
import fmus

OURS = {"components": Path(components.__file__).parent, "fmus": Path(fmus.__file__).parent}


@dataclass(frozen=True)
class Sources:
    """A module with all that it imports from its own folder and from our packages.

    module: dotted name of the component's module. files: POSIX path (as in an FMU's resources/source) -> file.
    """

    module: str
    files: dict[str, Path]


def sources_of(module: str, folder: Path | None = None) -> Sources:
    """Return the closure of a module's imports; folder: where a user's module and its neighbours lie."""
    found: dict[str, Path] = {}
    todo, seen = [module], set[str]()
    while todo:
        name = todo.pop()
        if name in seen:
            continue
        seen.add(name)
        located = _locate(name, folder)
        if located is None:
            continue
        relative, path, is_package = located
        found[relative] = path
        parent = name.rpartition(".")[0]
        if parent:
            todo.append(parent)
        package = name if is_package else parent
        todo.extend(_imports(path.read_text(encoding="utf-8"), str(path), package))
    return Sources(module, dict(sorted(found.items())))


def _locate(name: str, folder: Path | None) -> tuple[str, Path, bool] | None:
    """Return (path in the FMU, file, is it a package) of a module that is ours or the user's, otherwise None."""
    top = name.partition(".")[0]
    base = OURS[top].parent if top in OURS else folder
    if base is None:
        return None
    stem = name.replace(".", "/")
    for relative, is_package in ((f"{stem}.py", False), (f"{stem}/__init__.py", True)):
        if (base / relative).is_file():
            return relative, base / relative, is_package
    return None


@cache  # by the text: components share most of the files that they import
def _imports(text: str, path: str, package: str) -> tuple[str, ...]:
    """Return absolute names of the modules that a file may import, `from a import b` giving a and a.b."""
    names: list[str] = []
    for node in ast.walk(ast.parse(text, filename=path)):
        if isinstance(node, ast.Import):
            names += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            base = node.module or ""
            if node.level:
                above = package.split(".")[: len(package.split(".")) - node.level + 1]
                base = ".".join([*above, *([base] if base else [])])
            names += [base, *(f"{base}.{alias.name}" for alias in node.names)]
    return tuple(names)
