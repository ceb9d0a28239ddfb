"""The archive that a .ssp is: its texts are read whole, its FMUs put on the disk when somebody asks for one.

A reference FILE.ssp#resources/plant.fmu names an FMU in it, FILE.ssp#resources/inner.ssp#resources/plant.fmu one in a
package within. Files that leave the archive, links, and more bytes than can be meant are refused, as in FMUs.
"""

import os
import posixpath
import shutil
import threading
import zipfile
from collections.abc import Generator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from tempfile import mkdtemp
from urllib.parse import unquote, urlsplit

from cosim.errors import FmuError
from cosim.ssp.errors import SspError
from fmus import places
from fmus.description.archive import opened, read_file

SUFFIX, STRUCTURE = ".ssp", "SystemStructure.ssd"

LARGEST_TEXT = 2**26
"""Bytes of one XML file: 64 MiB are some 500000 parameters."""

_turn = threading.RLock()
_extracted: dict[tuple[Path, int, int, int, str], Path] = {}
"""(file, inode, time of the last change, size, name in it) -> where it lies; the place is this process's own."""


def is_packed(reference: object) -> bool:
    """Whether a reference names a file within a package."""
    return isinstance(reference, str) and f"{SUFFIX}#" in reference.lower()


def is_package(reference: object) -> bool:
    """Whether a reference is the file of a package."""
    return isinstance(reference, str) and reference.lower().endswith(SUFFIX)


def path_of(reference: str) -> Path:
    """Return the file of an FMU, extracted where it lies in a package. Raises `SspError`."""
    return extracted(reference) if is_packed(reference) else Path(reference)


def extracted(reference: str) -> Path:
    """Return where a file of a package lies on the disk; it is extracted once. Raises `SspError`."""
    at = reference.lower().index(f"{SUFFIX}#") + len(SUFFIX)
    outer, inner = reference[:at], reference[at + 1 :]
    if is_packed(inner):
        name = inner[: inner.lower().index(f"{SUFFIX}#") + len(SUFFIX)]
        return extracted(f"{Package.of(outer).file(name)}#{inner[len(name) + 1 :]}")
    return Package.of(outer).file(inner)


@dataclass(frozen=True)
class Package:
    """A .ssp file; `label`: how it is referred to, where it lies within another one."""

    path: Path
    label: str
    names: frozenset[str]

    @classmethod
    def of(cls, path: Path | str, label: str = "") -> "Package":
        """Look into a file; raises `SspError` for what is no package."""
        label = label or str(path)
        with _opened(Path(path), label) as archive:
            names = archive.namelist()
        twice = sorted({name for name in names if names.count(name) > 1}) if len(set(names)) < len(names) else []
        if twice:
            raise SspError(label, [f"it holds two files of one name, {twice[0]!r}"])
        return cls(Path(path), label, frozenset(names))

    def text(self, name: str) -> bytes:
        """Return one XML file; raises `SspError`."""
        self._refuse_missing(name)
        with _opened(self.path, self.label) as archive:
            size = archive.getinfo(name).file_size
            if size > LARGEST_TEXT:
                raise SspError(self.label, [f"its file {name!r} has {size} bytes, at most {LARGEST_TEXT} are read"])
            return archive.read(name)

    def text_within(self, fmu: str, name: str) -> bytes:
        """Return a file within one of its FMUs; raises `SspError`."""
        try:
            return read_file(self.file(fmu), name)
        except FmuError as error:
            raise SspError(f"{self.label}#{fmu}", [error.problem]) from error

    def file(self, name: str) -> Path:
        """Return where one of its files lies on the disk, extracted once in this process; raises `SspError`."""
        self._refuse_missing(name)
        status = self.path.stat()
        place = places.extracted()
        key = self.path.resolve(), status.st_ino, status.st_mtime_ns, status.st_size, name
        with _turn:
            found = _extracted.get(key)
            if found is None or not found.is_file() or not found.is_relative_to(place):
                folder = Path(mkdtemp(dir=place, prefix="ssp-"))
                found = folder / posixpath.basename(name)
                with _opened(self.path, self.label) as archive, archive.open(name) as source:
                    part = folder / ".part"
                    with part.open("wb") as target:
                        shutil.copyfileobj(source, target)
                    os.replace(part, found)
                _extracted[key] = found
            return found

    def package(self, name: str) -> "Package":
        """Return a package that lies within this one."""
        return Package.of(self.file(name), f"{self.label}#{name}")

    def resolve(self, source: str, base: str = "") -> str:
        """Return the name of the file that a URI in the file `base` means; raises `SspError` for one outside."""
        parts = urlsplit(source)
        name = posixpath.normpath(posixpath.join(posixpath.dirname(base), unquote(parts.path)))
        if parts.scheme or parts.netloc or name.startswith(("/", "../")) or name in ("..", "."):
            raise SspError(self.label, [f"its source {source!r} lies outside of it: only its own files are read"])
        return name

    def _refuse_missing(self, name: str) -> None:
        if name not in self.names:
            raise SspError(self.label, [f"there is no file {name!r} inside"])


@contextmanager
def _opened(path: Path, label: str) -> Generator[zipfile.ZipFile]:
    try:
        with opened(path, "it is no readable zip archive", "a system structure package") as archive:
            yield archive
    except FmuError as error:
        raise SspError(label, [error.problem]) from error
