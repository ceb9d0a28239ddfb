"""Build what is missing or out of date: component references -> NAME.fmu in the user's cache.

An FMU is up to date while its key (keys.py) is that of what it would be made from now, the files that its component's
code read included. Finding that out reads files; CasADi, the components and the back ends are imported when something
is built.
"""

import ast
import hashlib
import json
import os
import tempfile
import threading
import time
from collections.abc import Callable, Generator, Iterable, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from components.catalog import CATALOG, MODULES
from fmus import places
from fmus.description.description import DefaultExperiment
from fmus.errors import BuildError, PlaceUnusable
from fmus.export import references
from fmus.export.keys import key_of, with_reads
from fmus.export.reads import Reads, hash_of_file, noting
from fmus.export.references import Reference
from fmus.export.sources import content, file_of, users_file

if TYPE_CHECKING:
    from components.framework import Component

BACKENDS = ("native", "python")
TELL_EVERY = 5.0  # s


def build(
    component: "Component",
    path: Path | str,
    backend: str = "native",
    platforms: Sequence[str] = ("host",),
    experiment: DefaultExperiment | None = None,
) -> Path:
    """Write an FMU of a component, from whatever folder its class lives in, and return its path.

    backend: "native" (C, no Python on the target) or "python" (carries the source, editable). experiment: what the FMU
    says that it is flown with. Raises BuildError.
    """
    from fmus.export.blame import blamed
    from fmus.export.describe import PROPOSED
    from fmus.export.native.native_fmu import build_native
    from fmus.export.python.python_fmu import build_python

    if backend not in BACKENDS:
        raise BuildError(f"unknown back end {backend!r}. Back ends: {', '.join(BACKENDS)}.")
    component = references.of_file(component)
    file = users_file(type(component))
    with blamed(file and file.parent):
        if backend == "python":
            return build_python(component, Path(path), experiment=experiment or PROPOSED)
        return build_native(component, Path(path), platforms=platforms, experiment=experiment or PROPOSED)


# ---- what is kept ----------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Order:
    """An FMU that is wanted in the cache; values: start values to build in."""

    reference: Reference
    name: str
    backend: str
    platforms: tuple[str, ...]
    values: Mapping[str, Any] | None

    @property
    def path(self) -> Path:
        """Where it is kept; users' files of the same name do not share a folder."""
        shelf, file = places.cache() / self.backend, self.reference.file
        if file is not None:
            shelf /= f"{file.stem}-{hashlib.sha256(str(file.resolve()).encode()).hexdigest()[:10]}"
        return shelf / f"{self.name}.fmu"

    @property
    def key(self) -> str:
        """The hash of all that the FMU would be made from, but for what its component's code reads."""
        return key_of(self.reference, self.name, self.backend, self.platforms, self.values)

    def is_up_to_date(self, python_only: bool) -> bool:
        """Whether the FMU that is kept is the one that would be built; python_only: and there is no native one."""
        try:
            noted, digest = _note_file(self.path).read_bytes(), _digest(self.path)
            reads = {name: hash_of_file(name) for name in json.loads(noted)[-1]}
        except (OSError, ValueError, TypeError, LookupError):  # there is none, or it is damaged
            return False
        return noted in [_note(self.key, digest, only, reads) for only in ((True,) if python_only else (True, False))]


def _note_file(fmu: Path) -> Path:
    return fmu.with_name(f".{fmu.name}.key")


def _note(key: str, digest: str, python_only: bool, reads: Reads) -> bytes:
    """Return what is noted beside an FMU: its key, which bytes that is of, is there no native one, what was read."""
    return json.dumps([with_reads(key, reads), digest, python_only, list(reads)]).encode()


def _digest(fmu: Path) -> str:
    return hashlib.sha256(fmu.read_bytes()).hexdigest()


_building: dict[Path, threading.Lock] = {}


def build_reference(
    reference: "str | type",
    backend: str = "native",
    platforms: Sequence[str] = ("host",),
    folder: Path | None = None,
    values: Mapping[str, Any] | None = None,
    name: str | None = None,
    announce: Callable[[str], None] | None = None,
    experiment: DefaultExperiment | None = None,
) -> Path:
    """Return the FMU of a reference or class, built only if it is missing or out of date. Threads may share it.

    folder: where to put it instead of the cache; there it is always built, and nothing is kept beside it.
    values: start values to build in, by variable name. name: the FMU's name (default: the component's, with its
    structure). A Python-only component takes the python back end. announce is told what will be built, before it is.
    experiment: what an FMU in such a folder says that it is flown with.
    """
    if backend not in BACKENDS:
        raise BuildError(f"unknown back end {backend!r}. Back ends: {', '.join(BACKENDS)}.")
    parsed = references.parse(reference)
    order = _Order(parsed, name or parsed.model_name, backend, tuple(platforms), values)
    if folder is not None:
        component, order, _ = _component(order)
        target = folder / f"{order.name}.fmu"
        with _time_told(order, announce):
            return build(component, target, order.backend, platforms, experiment)
    with _building.setdefault(order.path, threading.Lock()):
        kept = _kept(order)
        return kept if kept is not None else _build_and_keep(order, announce)


def _kept(order: _Order) -> Path | None:
    """Return the FMU if it is there and up to date: of the back end asked for, or of the only one that there is."""
    for choice in (order, replace(order, backend="python")):
        if choice.is_up_to_date(python_only=choice.backend != order.backend):
            return choice.path
    return None


def _component(order: _Order) -> "tuple[Component, _Order, Reads]":
    """Return the component of an order, the order with the back end that it can have, what the component has read."""
    component, reads = order.reference.component_and_reads(order.values or {})
    return component, replace(order, backend="python" if component.python_only else order.backend), reads


@contextmanager
def _time_told(order: _Order, announce: Callable[[str], None] | None) -> Generator[None]:
    """Tell what is built, and while it takes long how much time it has taken so far."""
    _announce(order, announce)
    if announce is None:
        yield
        return
    done, began = threading.Event(), time.monotonic()

    def tell() -> None:
        while not done.wait(TELL_EVERY):
            announce(f"building {order.name} ({order.backend}): {time.monotonic() - began:.0f} s so far")

    teller = threading.Thread(target=tell, daemon=True)
    teller.start()
    try:
        yield
    finally:
        done.set()
        teller.join()


def _announce(order: _Order, announce: Callable[[str], None] | None) -> None:
    if announce is not None:
        announce(f"building {order.name} ({order.backend})")


def _build_and_keep(order: _Order, announce: Callable[[str], None] | None) -> Path:
    keys = {b: replace(order, backend=b).key for b in BACKENDS}  # before the import: of what is there now, or older
    component, order, reads = _component(order)
    path = order.path
    with tempfile.TemporaryDirectory(dir=places.workshop(path.parent), prefix=".build-") as place:  # nobody else's
        with noting(reads), _time_told(order, announce):
            made = build(component, Path(place) / path.name, order.backend, order.platforms)
        note = Path(place) / "note"
        note.write_bytes(_note(keys[order.backend], _digest(made), component.python_only, reads))
        try:
            os.replace(made, path)  # it is on the disk
            places.keep(note, _note_file(path))
        except OSError as error:
            reason = f"{path.name} cannot be put there ({error.strerror})"
            raise PlaceUnusable(path.parent, reason, "Remove that folder; it is made again.") from error
    return path


def build_all(backends: Iterable[str] = ("native",), platforms: Sequence[str] = ("host",)) -> list[Path]:
    """Build every component of the catalog."""
    return [build_reference(name, backend, platforms) for backend in backends for name in CATALOG]


# ---- what there is ---------------------------------------------------------------------------------------------


def is_component(reference: str) -> bool:
    """Whether a reference names a component: a catalog name or FILE.py:Class (a class is written with a capital)."""
    file, _, rest = reference.partition(".py:")
    return rest[:1].isupper() if rest else file.partition(":")[0] in CATALOG


def component_docs() -> dict[str, str]:
    """Return catalog name -> first line of what the component's class, or else its module, says about it."""
    docs: dict[str, str] = {}
    for name, module in MODULES.items():
        tree = ast.parse(content(file_of(module)))
        classes = [node for node in tree.body if isinstance(node, ast.ClassDef) and node.name == name]
        text = next((doc for node in (*classes, tree) if (doc := ast.get_docstring(node))), "")
        docs[name] = text.partition("\n")[0]
    return docs
