"""Which files the code of a component reads while it is imported and built: they make the FMU what it is.

Python tells of each file before it opens it (the audit event "open"), whoever asks: open, pathlib, numpy. It is the
component's read where the nearest code on the stack that is no library's is a component's or of a module that it
imports; what a library reads while it is imported is its own affair. Files of Python and of installed packages, folders
and devices do not count; a .pyc stands for its source.

Limits: what compiled code opens by itself (Arrow, HDF5) is not told, nor what a thread reads that a component starts.
"""

import hashlib
import os
import sys
import sysconfig
import threading
from collections.abc import Generator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from functools import cache
from importlib.util import source_from_cache
from pathlib import Path
from typing import Any

import components

Reads = dict[str, str | None]
"""File, as the component names it -> hash of what it held when it was first read, None where there was none."""

_FMUS = Path(__file__).parents[1]
_COMPONENTS = Path(components.__file__).parent
_LOADER = "adcs_loader_"  # in a python FMU, see python/slave.py
_NO_FILES = ("/proc/", "/sys/", "/dev/")
_INSTALLED = {"site-packages", "dist-packages"}
_PYTHON = tuple(Path(sysconfig.get_path(name)) for name in ("stdlib", "platstdlib"))
_NO_READ = os.O_WRONLY | os.O_CREAT | os.O_TRUNC

_noted: ContextVar[Reads | None] = ContextVar("noted", default=None)


@contextmanager
def noting(reads: Reads) -> Generator[None]:
    """Add to `reads` what this thread's components read, but for what they make and remove again."""
    _listen()
    token = _noted.set(reads)
    try:
        yield
    finally:
        _noted.reset(token)
    for name in [name for name, held in reads.items() if held is not None and not os.path.exists(name)]:
        reads.pop(name, None)


def hold(reads: Mapping[str, str | None]) -> bool:
    """Whether all files hold what they held when they were read."""
    return all(held == hash_of_file(name) for name, held in reads.items())


def hash_of_file(name: str) -> str | None:
    """Return the hash of what a file holds, None where there is none; a relative name is one of the folder of now."""
    try:
        with open(name, "rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except (OSError, ValueError):  # gone, no file, not ours to read; a name that is none
        return None


# ---- the hook --------------------------------------------------------------------------------------------------

_turn = threading.Lock()
_listening = False


def _listen() -> None:
    """Hear audit events from now on. A hook stays for the life of the process: it is silent where nobody notes."""
    global _listening
    with _turn:
        if not _listening:
            sys.addaudithook(_heard)
            _listening = True


def _heard(event: str, arguments: tuple[Any, ...]) -> None:
    if event != "open" or (reads := _noted.get()) is None:
        return
    token = _noted.set(None)  # what is opened in here is no read of a component's
    try:
        name = _file_read(*arguments)
        if name is not None and name not in reads and _by_component():
            reads[name] = hash_of_file(name)
    finally:
        _noted.reset(token)


def _file_read(path: Any, mode: str | None, flags: int) -> str | None:
    """Return the name of a file that is opened to be read and may be a component's, otherwise None."""
    if isinstance(path, int) or ("r" not in mode if mode is not None else flags & _NO_READ):
        return None
    name = os.fsdecode(path)
    if name.endswith(".pyc"):
        try:
            name = source_from_cache(name)
        except ValueError:  # without its source
            return None
    absolute = os.path.abspath(name)
    if absolute.startswith(_NO_FILES) or _is_library(absolute) or _is_ours(absolute):
        return None
    return name if os.path.isfile(name) or not os.path.exists(name) else None


def _by_component() -> bool:
    """Whether the file is opened by a component's code, or by a library that it calls."""
    frame = sys._getframe(2)  # pyright: ignore[reportPrivateUsage]
    while frame is not None:
        file = frame.f_code.co_filename
        if _is_in(file, _FMUS) or frame.f_globals.get("__name__", "").startswith(_LOADER):
            return False
        if not _is_library(file) or _is_in(file, _COMPONENTS):
            return True
        if frame.f_code.co_name == "<module>":
            return False
        frame = frame.f_back
    return False


def _is_ours(file: str) -> bool:
    """Whether a file is known without a read of it, from the imports of a component's module (sources.py)."""
    return _is_in(file, _FMUS) or _is_in(file, _COMPONENTS)


@cache
def _is_in(file: str, folder: Path) -> bool:
    return Path(file).is_relative_to(folder)


@cache
def _is_library(file: str) -> bool:
    """Whether a file is of Python or installed; code that was made in memory is a library's."""
    known = bool(_INSTALLED & set(Path(file).parts)) or any(_is_in(file, folder) for folder in _PYTHON)
    return known or file.startswith("<")
