"""What the FMUs of this process share: extracted files, loaded libraries, and whose log messages are whose.

One object holds it, so that flights in threads do not meet: a lock for what is made once, and nothing that changes the
process's working folder.
"""

import ctypes
import itertools
import logging
import re
import threading
import weakref
from collections.abc import Callable
from pathlib import Path
from tempfile import mkdtemp
from typing import Any

import fmpy
from fmpy import fmi2, fmi3

from fmus import places
from fmus.description.archive import extract
from fmus.description.description import ModelDescription
from fmus.description.errors import FmuError
from fmus.description.read import read_description
from fmus.from_sources import compile_sources

_log = logging.getLogger(__name__)

Stamp = tuple[Path, int, int, int]
"""What tells one version of a file from another: path, inode, time of the last change (ns), size."""

_CONTROL = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f]")
"""What a log may not send to a terminal: all that controls one, but tabs and ends of lines."""

_NOTHING = ("Fatal py exception encountered", "unknown error")
"""Begin and end of what pythonfmu says of an exception that the slave has told itself."""


def stamp_of(path: Path) -> Stamp:
    """Return the identity of a file; raises `FmuError`."""
    try:
        stat = path.stat()
    except (OSError, ValueError) as error:
        raise FmuError(path, "there is no such file") from error
    return path.resolve(), stat.st_ino, stat.st_mtime_ns, stat.st_size


class Shelf:
    """Descriptions and extracted folders by file identity, and the slaves that wait for log messages."""

    def __init__(self) -> None:
        self._lock = threading.RLock()
        self._descriptions: dict[Stamp, ModelDescription] = {}
        self._folders: dict[tuple[Stamp, int], Path] = {}
        self._idle: dict[Stamp, list[int]] = {}  # copies that were lent and given back
        self._files: dict[Path, list[Path]] = {}  # folder -> what was extracted there
        self._copies = itertools.count(1)
        self._keys = itertools.count(1)
        self._listeners: weakref.WeakValueDictionary[int, Any] = weakref.WeakValueDictionary()
        self._logger = fmi2.fmi2CallbackLoggerTYPE(self._log)
        self.logger3 = fmi3.fmi3LogMessageCallback(self._log3)

    def description(self, path: Path) -> ModelDescription:
        """Return what the modelDescription.xml of a file says, read once per version of the file; raises `FmuError`."""
        stamp = stamp_of(path)
        with self._lock:
            if stamp not in self._descriptions:
                self._descriptions[stamp] = read_description(path)
            return self._descriptions[stamp]

    def extracted(self, path: Path, *, own_copy: bool) -> Path:
        """Return the folder of an extracted FMU: one for all of its instances, or `own_copy` one that no other has.

        One that has been emptied meanwhile, as what cleans temporary folders does, is extracted again, with a line.
        One that has C sources and no binary for this platform is compiled there. Raises `FmuError` for a file that has
        neither, or cannot be extracted.
        """
        stamp = stamp_of(path)
        with self._lock:
            idle = self._idle.setdefault(stamp, [])
            key = stamp, (idle.pop() if idle else next(self._copies)) if own_copy else 0
            if key in self._folders and not _is_whole(self._files[self._folders[key]]):
                _log.warning("%s, extracted from %s, was emptied: it is extracted again", self._folders.pop(key), path)
            if key not in self._folders:
                has_binary = _has_binary(path)
                try:
                    folder = extract(path, Path(mkdtemp(dir=places.extracted())))
                    if not has_binary:
                        compile_sources(path, folder, self.description(path))
                    self._folders[key], self._files[folder] = folder, _filled(folder)
                except OSError as error:
                    raise FmuError(path, f"it cannot be extracted: {error}") from error
            return self._folders[key]

    def lend(self, borrower: Any, folder: Path, fmu: Any) -> None:
        """Note who has a copy of its own: when it is gone, its instance freed (`fmu.component`), the next has it.

        The library is unloaded then: what an instance left in its static variables would be the next one's start.
        """
        with self._lock:
            key = next(key for key, place in self._folders.items() if place == folder)
        weakref.finalize(borrower, self._take_back, key, fmu).atexit = False

    def _take_back(self, key: tuple[Stamp, int], fmu: Any) -> None:
        if fmu.component is None:
            fmu.close()
            with self._lock:
                self._idle[key[0]].append(key[1])

    def listen(self, listener: Any) -> int:
        """Return the key under which an instance's log messages come to `listener.messages`."""
        with self._lock:
            key = next(self._keys)
            self._listeners[key] = listener
            return key

    def callbacks(self, key: int) -> Any:
        """Return the callback functions of one instance; fmpy's proxy formats the message with its arguments."""
        callbacks = fmi2.fmi2CallbackFunctions()
        callbacks.logger = self._logger
        callbacks.allocateMemory = fmi2.fmi2CallbackAllocateMemoryTYPE(fmpy.calloc)
        callbacks.freeMemory = fmi2.fmi2CallbackFreeMemoryTYPE(fmpy.free)
        callbacks.componentEnvironment = key
        proxy: Callable[[Any], None] | None = getattr(fmi2, "addLoggerProxy", None)
        if proxy is not None:
            proxy(ctypes.byref(callbacks))
        return callbacks

    def _log(self, environment: int | None, instance: bytes, status: int, category: bytes, message: bytes) -> None:
        self._said(environment, message)

    def _log3(self, environment: int | None, status: int, category: bytes, message: bytes) -> None:
        self._said(environment, message)

    def _said(self, environment: int | None, message: bytes) -> None:
        listener = self._listeners.get(environment or 0)
        text = _CONTROL.sub("?", (message or b"").decode("utf-8", "replace").rstrip())
        if listener is not None and not (text.startswith(_NOTHING[0]) and text.endswith(_NOTHING[1])):
            listener.messages.append(text)


def _filled(folder: Path) -> list[Path]:
    """Return the files in a folder that hold anything."""
    return [file for file in folder.rglob("*") if file.is_file() and file.stat().st_size]


def _is_whole(files: list[Path]) -> bool:
    try:
        return all(file.stat().st_size for file in files)
    except OSError:
        return False


def _has_binary(path: Path) -> bool:
    """Whether an FMU has a binary for this platform, False where it has C sources; raises `FmuError` for neither."""
    offered = fmpy.supported_platforms(str(path))
    if fmpy.platform in offered or "c-code" in offered:
        return fmpy.platform in offered
    there = ", ".join(offered) or "none"
    raise FmuError(path, f"it has no binary for this platform: needed {fmpy.platform}, there: {there}.")


SHELF = Shelf()
"""The one of this process."""
