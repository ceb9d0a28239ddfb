"""Import a folder of Python sources under a package name that is a hash of their content.

All python FMUs of a process share sys.modules: without this, an edited FMU beside its unedited copy, or two FMUs
whose authors both called a module `helper`, would silently run one and the same module. The same loader reads a
user's FILE.py when an FMU is built. Imports nothing of ours: it travels inside the FMU.

Data files beside the sources are content too. Modules find them by their own place, so that the same content is shared
by all folders only where it is sources alone.

Inside the folder, an absolute import of a module of the folder (`import helper`, `from components.framework import
...`) means that module under the hashed package; every other import means what it always does.
"""

import ast
import hashlib
import importlib
import importlib.abc
import importlib.util
import sys
import threading
import traceback
from collections.abc import Iterable
from importlib.machinery import ModuleSpec
from pathlib import Path
from types import ModuleType

PREFIX = "adcs_"
MACHINERY = ("fmus/", "components/framework/")  # no mistake of an author's is looked for there


def content_hash(root: Path, files: Iterable[str]) -> str:
    """Return a hash of the named files (POSIX paths relative to root), names included."""
    digest = hashlib.sha256()
    for name in sorted(files):
        data = (root / name).read_bytes()
        digest.update(f"{name}\0{len(data)}\0".encode() + data)
    return digest.hexdigest()


def import_from(root: Path, files: Iterable[str], module: str, edition: str = "") -> ModuleType:
    """Import a module of the folder `root` that consists of `files`, under a package name hashed from them.

    edition: tells imports of the same content apart, which may have read other files from elsewhere.
    """
    files = frozenset(files)
    content = content_hash(root, files)
    if any(not name.endswith(".py") for name in files):
        edition += f"\0{root}"
    package = f"{PREFIX}{hashlib.sha256(f'{content}{edition}'.encode()).hexdigest()[:16]}"
    _FINDER.know(package, _Folder(root, files))
    return importlib.import_module(f"{package}.{module}")


def told(error: BaseException, folder: Path) -> str | None:
    """Return an exception as "Type: text (file.py, line 3)", the last line of `folder` that it passed; None if none.

    A module of this loader counts wherever it was loaded from: the same content is imported once.
    """
    if isinstance(error, SyntaxError) and error.filename:
        passed = [(_place(error.filename, "", folder), error.lineno)]
        error = SyntaxError(error.msg)
    else:
        frames = traceback.walk_tb(error.__traceback__)
        passed = [(_place(f.f_code.co_filename, f.f_globals.get("__name__", ""), folder), line) for f, line in frames]
    for name, line in reversed(passed):
        if name and not name.startswith(MACHINERY):
            return f"{type(error).__name__}: {error} ({name}, line {line})"
    return None


def _place(file: str, module: str, folder: Path) -> str:
    """Return a source file's path in `folder` or in a hashed package, "" if it is of neither."""
    package, _, inside = module.partition(".")
    if package.startswith(PREFIX) and inside:
        return f"{inside.replace('.', '/')}.py"
    return Path(file).relative_to(folder).as_posix() if Path(file).is_relative_to(folder) else ""


class _Folder:
    """A folder of sources: its path, its modules, the names that modules in it can begin with."""

    def __init__(self, root: Path, files: frozenset[str]):
        self.root, self.files = root, frozenset(f for f in files if f.endswith(".py"))
        self.top_level = {f.partition("/")[0].removesuffix(".py") for f in self.files}


class _Finder(importlib.abc.MetaPathFinder):
    """The one finder of this loader: package -> the folder where its content was seen last."""

    def __init__(self) -> None:
        self._folders: dict[str, _Folder] = {}
        self._turn = threading.Lock()

    def know(self, package: str, folder: _Folder) -> None:
        """Find a package in a folder from now on."""
        with self._turn:
            self._folders[package] = folder
            if self not in sys.meta_path:
                sys.meta_path.insert(0, self)

    def find_spec(self, fullname: str, path: object = None, target: object = None) -> ModuleSpec | None:
        package, _, module = fullname.partition(".")
        found = self._folders.get(package)
        if found is None:
            return None
        inside = module.replace(".", "/")
        folder = f"{inside}/" if inside else ""
        for name, is_package in ((f"{inside}.py", False), (f"{folder}__init__.py", True)):
            if name in found.files:
                loader = _Loader(package, found, found.root / name)
                spec = importlib.util.spec_from_loader(fullname, loader, origin=str(loader.path), is_package=is_package)
                break
        else:
            if not any(f.startswith(folder) for f in found.files):
                return None
            spec = ModuleSpec(fullname, None, is_package=True)
        if spec is not None and spec.submodule_search_locations is not None:
            spec.submodule_search_locations.append(str(found.root / inside))
        return spec


_FINDER = _Finder()


class _Loader(importlib.abc.Loader):
    """Compile a file with its imports renamed; no byte code is cached, since it would hold the package's old name."""

    def __init__(self, package: str, folder: _Folder, path: Path):
        self.package, self.folder, self.path = package, folder, path

    def create_module(self, spec: ModuleSpec) -> ModuleType | None:
        return None

    def exec_module(self, module: ModuleType) -> None:
        module.__file__ = str(self.path)
        tree = ast.parse(self.path.read_text(encoding="utf-8"), filename=str(self.path))
        tree = ast.fix_missing_locations(_Rename(self.package, self.folder.top_level).visit(tree))
        exec(compile(tree, str(self.path), "exec"), module.__dict__)


class _Rename(ast.NodeTransformer):
    def __init__(self, package: str, top_level: set[str]):
        self.package, self.top_level = package, top_level

    def _inside(self, name: str) -> bool:
        return name.partition(".")[0] in self.top_level

    def visit_ImportFrom(self, node: ast.ImportFrom) -> ast.AST:
        if node.level == 0 and node.module and self._inside(node.module):
            node.module = f"{self.package}.{node.module}"
        return node

    def visit_Import(self, node: ast.Import) -> list[ast.AST]:
        """`import a.b` binds a: import the renamed module, then bind a (or the alias) to what it would have been."""
        statements: list[ast.AST] = []
        for alias in node.names:
            if not self._inside(alias.name):
                statements.append(ast.Import([alias]))
                continue
            renamed = f"{self.package}.{alias.name}"
            top = renamed if alias.asname else f"{self.package}.{alias.name.partition('.')[0]}"
            bound = alias.asname or alias.name.partition(".")[0]
            statements.append(ast.Import([ast.alias(renamed)]))
            statements.append(ast.Import([ast.alias(top, bound)]))
        return [ast.copy_location(s, node) for s in statements]
