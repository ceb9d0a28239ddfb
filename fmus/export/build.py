"""Build what is missing or out of date: component references -> fmus/build/<backend>/NAME.fmu.

An FMU is up to date while the key beside it is the hash of everything that it was made from: the component's source
files, this package, the libraries' versions, the compiler. Finding that out reads files and builds no function.
"""

import hashlib
import os
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

from components.catalog import CATALOG
from components.framework import Component
from fmus.errors import BuildError
from fmus.export import references
from fmus.export.blame import blamed
from fmus.export.native.native_fmu import build_native
from fmus.export.python.python_fmu import build_python, sources_of_component
from fmus.export.sources import OURS
from fmus.toolchain import compiler_name

BACKENDS = ("native", "python")
HERE = Path(__file__).parent
IMPORTED = {file: file.read_bytes() for file in [*OURS["components"].rglob("*.py"), *OURS["fmus"].rglob("*.py")]}
"""Our modules as this process imported them: what it builds is made of these, however they are edited meanwhile."""


def build(
    component: Component, path: Path | str, backend: str = "native", platforms: Sequence[str] = ("host",)
) -> Path:
    """Write an FMU of a component, from whatever folder its class lives in, and return its path.

    backend: "native" (C, no Python on the target) or "python" (carries the source, editable). Raises BuildError.
    """
    target = Path(path)
    if backend not in BACKENDS:
        raise BuildError(f"unknown back end {backend!r}. Back ends: {', '.join(BACKENDS)}.")
    with blamed(_users_folder(component)):
        if backend == "python":
            return build_python(component, target)
        return build_native(component, target, platforms=platforms)


def _users_folder(component: Component) -> Path | None:
    """Return the folder of a component that is not ours."""
    module = sys.modules[type(component).__module__]
    ours = type(component).__module__.partition(".")[0] == "components"
    return None if ours or not module.__file__ else Path(module.__file__).resolve().parent


def build_folder() -> Path:
    """Return where FMUs are kept: $ADCS_BUILD, else beside this package if that can be written, else a cache folder."""
    chosen = os.environ.get("ADCS_BUILD")
    if chosen:
        return Path(chosen)
    if os.access(HERE, os.W_OK):
        return HERE / "build"
    return Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "adcs-cosim"


@dataclass(frozen=True)
class _Order:
    """What is to be built where; `key` is the hash of all that it is made from."""

    component: Component
    backend: str
    path: Path
    key: str

    @property
    def key_file(self) -> Path:
        return self.path.with_name(f".{self.path.name}.key")

    @property
    def up_to_date(self) -> bool:
        return self.path.is_file() and self.key_file.is_file() and self.key_file.read_text() == self.key


def _order(
    reference: str,
    backend: str,
    platforms: Sequence[str],
    folder: Path | None,
    values: Mapping[str, Any] | None,
    name: str | None,
) -> _Order:
    parsed = references.parse(reference)
    component = parsed.component()
    if values:
        component = type(component)(**(component.given | dict(values)))
    if component.python_only:
        backend = "python"
    place = folder if folder is not None else _shelf(backend, parsed)
    path = place / f"{name or parsed.model_name}.fmu"
    return _Order(component, backend, path, _key(component, backend, platforms, path.stem))


def build_reference(
    reference: str,
    backend: str = "native",
    platforms: Sequence[str] = ("host",),
    folder: Path | None = None,
    values: Mapping[str, Any] | None = None,
    name: str | None = None,
    announce: Callable[[str], None] | None = None,
) -> Path:
    """Return the FMU of a component reference, built only if it is missing or out of date.

    folder: where to put it instead of build_folder()/backend; there it is always built, and nothing is kept beside it.
    values: start values to build in, by variable name. name: the FMU's name (default: the component's, with its
    structure). A Python-only component takes the python back end. announce is told what will be built, before it is.
    """
    order = _order(reference, backend, platforms, folder, values, name)
    kept = folder is None
    if not (kept and order.up_to_date):
        if announce is not None:
            announce(f"building {order.path.stem} ({order.backend})")
        build(order.component, order.path, order.backend, platforms)
        if kept:
            order.key_file.write_text(order.key)
    return order.path


def build_all(backends: Iterable[str] = ("native",), platforms: Sequence[str] = ("host",)) -> list[Path]:
    """Build every component of the catalog."""
    return [build_reference(name, backend, platforms) for backend in backends for name in CATALOG]


def _shelf(backend: str, parsed: references.Reference) -> Path:
    """Return the folder of an FMU; users' files of the same name do not share one."""
    shelf = build_folder() / backend
    if parsed.file is None:
        return shelf
    return shelf / f"{parsed.file.stem}-{hashlib.sha256(str(parsed.file.resolve()).encode()).hexdigest()[:10]}"


def _key(component: Component, backend: str, platforms: Sequence[str], name: str) -> str:
    digest = hashlib.sha256()
    libraries = [f"{n} {version(n)}" for n in ("casadi", "pythonfmu", "fmpy")]
    tool = compiler_name() if backend == "native" else ""
    digest.update(
        repr([backend, list(platforms), name, type(component).__name__, component.given, libraries, tool]).encode()
    )
    own = [*OURS["fmus"].rglob("*.py"), *OURS["fmus"].rglob("*.c")]
    for file in [*sorted(sources_of_component(component).files.values()), *sorted(own)]:
        digest.update(IMPORTED.get(file) or file.read_bytes())
    return digest.hexdigest()


def is_component(reference: str) -> bool:
    """Whether a reference names a component: a catalog name or FILE.py:Class (a class is written with a capital)."""
    file, _, rest = reference.partition(".py:")
    return rest[:1].isupper() if rest else file.partition(":")[0] in CATALOG


def component_docs() -> dict[str, str]:
    """Return catalog name -> first line of what the component's module says about it."""
    docs: dict[str, str] = {}
    for name, factory in CATALOG.items():
        cls = type(factory())
        text = cls.__doc__ or sys.modules[cls.__module__].__doc__ or ""
        docs[name] = text.strip().partition("\n")[0]
    return docs
