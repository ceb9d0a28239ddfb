"""The zip archive that an FMU is: it is read only if its files stay within it, are files, and have a size that fits."""

import stat
import zipfile
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path

from fmus.description.errors import FmuError

LARGEST = 2**31
"""Bytes of all files together, unpacked. What an archive says of a file is as much as is unpacked of it."""

METHODS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED, zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA)
_ENCRYPTED = 0x1
_UNIX = 3


def read_file(path: Path, name: str) -> bytes:
    """Return one file of an FMU; raises `FmuError`."""
    with opened(path, "it is not an FMU, for it is no readable zip archive") as archive:
        if name not in archive.namelist():
            raise FmuError(path, f"it is not an FMU, for there is no {name} inside")
        return archive.read(name)


def extract(path: Path, folder: Path) -> Path:
    """Extract an FMU into a folder and return it; raises `FmuError`."""
    with opened(path, "it cannot be extracted") as archive:
        archive.extractall(folder)
    return folder


@contextmanager
def opened(path: Path, failed: str, kind: str = "an FMU") -> Generator[zipfile.ZipFile]:
    """Open an archive whose files may all be extracted; `failed`, `kind`: for messages. Raises `FmuError`."""
    try:
        mode = path.stat().st_mode
    except FileNotFoundError as error:
        raise FmuError(path, "there is no such file") from error
    except (OSError, ValueError) as error:
        raise FmuError(path, f"it cannot be read: {error}") from error
    if not stat.S_ISREG(mode):  # of a pipe nothing may ever come
        raise FmuError(path, f"it is not {kind}, for it is {'a folder' if stat.S_ISDIR(mode) else 'no regular file'}")
    try:
        with zipfile.ZipFile(path) as archive:
            for entry in archive.infolist():
                problem = _problem(entry, kind)
                if problem is not None:
                    raise FmuError(path, f"its file {entry.orig_filename!r} {problem}")
            size = sum(entry.file_size for entry in archive.infolist())
            if size > LARGEST:
                raise FmuError(path, f"it has {size} bytes unpacked, at most {LARGEST} are taken")
            yield archive
    except FmuError:
        raise
    except Exception as error:  # zipfile raises whatever a damaged archive leads to
        raise FmuError(path, f"{failed}: {str(error) or type(error).__name__}") from error


def _problem(entry: zipfile.ZipInfo, kind: str) -> str | None:
    """Return why a file is not to be extracted, None where it may be."""
    name = entry.orig_filename
    if name.startswith("/") or not {"\\", ":", "\0"}.isdisjoint(name) or ".." in name.split("/"):
        return "has a name that leads out of the archive, or is none on every platform"
    if entry.create_system == _UNIX and stat.S_ISLNK(entry.external_attr >> 16):
        return f"is a symbolic link: {kind} has files"
    if entry.flag_bits & _ENCRYPTED:
        return "is encrypted"
    if entry.compress_type not in METHODS:
        return f"is compressed by a method that is not known here, number {entry.compress_type}"
    return None
