"""Which source files a component consists of: the modules that its module imports, and those that they import.

Found by reading, so that nothing needs to be imported. Our own files are read once, when this module is imported: what
this process builds is made of them, however they are edited meanwhile. A user's files are read each time.

A data file in one of our component packages belongs to every module of that package.
"""

import ast
import os
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import components

OURS = {"components": Path(components.__file__).parent, "fmus": Path(__file__).parents[1]}
_READ = {
    file: file.read_bytes()
    for package in OURS.values()
    for folder, _, names in os.walk(package)
    for file in (Path(folder, name) for name in sorted(names))
    if file.suffix not in (".pyc", ".typed") and not file.name.startswith(".")
}
_DATA = {  # file -> the package that it lies in
    file: next(folder for folder in file.parents if folder / "__init__.py" in _READ)
    for file in _READ
    if file.suffix not in (".py", ".c")
}


@dataclass(frozen=True)
class Sources:
    """A module with all that it imports from its own folder and from our packages.

    module: dotted name of the component's module. files: POSIX path (as in an FMU's resources/source) -> file.
    """

    module: str
    files: dict[str, Path]


def content(file: Path) -> bytes:
    """Return what a source file consists of."""
    return _READ[file] if file in _READ else file.read_bytes()


def own_files(package: str) -> list[Path]:
    """Return the source files of one of our packages."""
    return sorted(file for file in _READ if file.is_relative_to(OURS[package]))


def file_of(module: str) -> Path:
    """Return the file of one of our modules."""
    located = _locate(module, None)
    if located is None:
        raise LookupError(f"there is no module {module}")
    return located[1]


def users_file(cls: type) -> Path | None:
    """Return the file that defines a class, None where the class is ours or no file's."""
    if cls.__module__.partition(".")[0] in OURS:
        return None
    file = getattr(sys.modules[cls.__module__], "__file__", None)
    return Path(file).resolve() if file else None


def sources_of(module: str, folder: Path | None = None) -> Sources:
    """Return the closure of a module's imports; folder: where a user's module and its neighbours lie."""
    return _closure(module, folder) if folder is not None else _own_closure(module)


@cache
def _own_closure(module: str) -> Sources:
    return _closure(module, None)


def _closure(module: str, folder: Path | None) -> Sources:
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
        todo.extend(_imports(content(path), str(path), package))
    packages = {file.parent for file in found.values()}
    found |= {_in_fmu(file): file for file, package in _DATA.items() if package in packages}
    return Sources(module, dict(sorted(found.items())))


def _in_fmu(file: Path) -> str:
    """Return the path in an FMU of a file of ours."""
    root = next(package.parent for package in OURS.values() if file.is_relative_to(package))
    return file.relative_to(root).as_posix()


def _locate(name: str, folder: Path | None) -> tuple[str, Path, bool] | None:
    """Return (path in the FMU, file, is it a package) of a module that is ours or the user's, otherwise None."""
    top = name.partition(".")[0]
    base = OURS[top].parent if top in OURS else folder
    if base is None:
        return None
    stem = name.replace(".", "/")
    for relative, is_package in ((f"{stem}.py", False), (f"{stem}/__init__.py", True)):
        file = base / relative
        if file in _READ or (top not in OURS and file.is_file()):
            return relative, file, is_package
    return None


@cache  # by the text: components share most of the files that they import
def _imports(text: bytes, path: str, package: str) -> tuple[str, ...]:
    """Return absolute names of the modules that a file may import, `from a import b` giving a and a.b."""
    names: list[str] = []
    for node in _statements(ast.parse(text, filename=path)):
        if isinstance(node, ast.Import):
            names += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            base = node.module or ""
            if node.level:
                inside = package.split(".") if package else []
                above = inside[: len(inside) - node.level + 1]
                base = ".".join([*above, *([base] if base else [])])
            names += [base, *(f"{base}.{alias.name}".lstrip(".") for alias in node.names)]
    return tuple(name for name in names if name)


def _statements(tree: ast.AST) -> Iterator[ast.AST]:
    """Yield all statements, but for those that only a type checker sees."""
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.If) and _is_for_type_checkers(node.test):
            node = ast.Module(node.orelse, [])
        if isinstance(node, ast.stmt | ast.excepthandler | ast.match_case | ast.Module):
            yield node
            yield from _statements(node)


def _is_for_type_checkers(test: ast.expr) -> bool:
    name = test.attr if isinstance(test, ast.Attribute) else test.id if isinstance(test, ast.Name) else ""
    return name == "TYPE_CHECKING"
