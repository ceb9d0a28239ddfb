"""The kernel as a loaded library: compiled once, kept on disk, checked before it is trusted."""

import ctypes
import hashlib
import logging
import os
import sys
import threading
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import replace
from functools import cache
from pathlib import Path
from platform import machine
from typing import Any

import fmpy

from cosim.errors import NotSupported
from cosim.masters.kernel.structures import sizes_and_offsets
from cosim.slaves.slave import CInterface, Slave
from fmus import places
from fmus.errors import BuildError
from fmus.toolchain import compile_library

SOURCES = tuple(
    Path(__file__).with_name(name)
    for name in (
        "kernel.c",
        "structures.h",
        "texts.h",
        "points.h",
        "curves.h",
        "calls.h",
        "inputs.h",
        "pass.h",
        "values.h",
        "waves.h",
        "pending.h",
        "ends.h",
        "iterated.h",
        "faults.h",
        "signals.h",
        "fmi3.h",
        "crash.h",
    )
)

KERNEL = ("auto", "never", "always")
"""What a master may be told of it."""

_log = logging.getLogger(__name__)
_lock = threading.Lock()
_loaded: dict[Path, ctypes.CDLL] = {}


def library() -> ctypes.CDLL:
    """Return the kernel; raises `BuildError` where it cannot be compiled."""
    folder, name = SOURCES[0].parent, SOURCES[0].name
    return kept(f"kernel-{key()}", lambda path: compile_library(folder, name, path), _declared)


def kept(name: str, make: Callable[[Path], None], declared: Callable[[ctypes.CDLL], ctypes.CDLL]) -> ctypes.CDLL:
    """Return a library of this package that `make` compiles where it is not on the disk; raises `BuildError`.

    A file that is empty, cut, damaged, or of other structures than this process has is compiled anew, with a line.
    `declared` raises AttributeError for another library.
    """
    with _lock:
        path = _path(name)
        if path not in _loaded:
            found = _load(path, declared)
            if found is None:
                if path.is_file() and _seal(path).is_file():  # before the seal is written it is nobody's fault
                    _log.warning("the kernel %s is damaged, or of another version: it is compiled anew", path)
                make(path)  # replaces the file, also of other processes
                _write_seal(path)
                found = _load(path, declared)
            if found is None:
                raise BuildError(f"{path} was compiled, but cannot be loaded. Is $CC a compiler for this machine?")
            _loaded[path] = found
        return _loaded[path]


def is_kept(name: str) -> bool:
    """Whether a library of this package has been compiled."""
    return _path(name).is_file()


def _path(name: str) -> Path:
    return places.kernel() / f"{name}{'.dll' if os.name == 'nt' else '.so'}"


def why_python(wanted: str, obstacle: Callable[[], str]) -> str:
    """Return why a run flies in Python, "" where it flies in the kernel; `wanted`: one of `KERNEL`.

    `obstacle` tells why the kernel cannot, "" if it can; it may compile it. Raises `NotSupported` where only the kernel
    may, and cannot.
    """
    reason = 'kernel="never"' if wanted == "never" else obstacle()
    if reason and wanted == "always":
        raise NotSupported(f'kernel="always": {reason}', 'Choose kernel="auto".')
    return reason


SIGNAL_FUNCTIONS = {
    "fmi2DoStep": "signal_do_step",
    "fmi2GetReal": "signal_get_real",
    "fmi2GetRealOutputDerivatives": "signal_get_derivatives",
    "fmi2GetFMUstate": "signal_get_state",
    "fmi2SetFMUstate": "signal_set_state",
    "fmi2FreeFMUstate": "signal_free_state",
}
"""The functions of an instance that signals are (signals.h)."""


def signal_functions() -> Mapping[str, int]:
    """Return their addresses."""
    return _addresses(SIGNAL_FUNCTIONS)


def _addresses(functions: Mapping[str, str]) -> Mapping[str, int]:
    found = library()
    return {
        name: ctypes.cast(getattr(found, function), ctypes.c_void_p).value or 0 for name, function in functions.items()
    }


FMI3_FUNCTIONS = {
    "fmi2SetReal": "fmi3_set_real",
    "fmi2GetReal": "fmi3_get_real",
    "fmi2SetInteger": "fmi3_set_integer",
    "fmi2GetInteger": "fmi3_get_integer",
    "fmi2SetBoolean": "fmi3_set_integer",
    "fmi2GetBoolean": "fmi3_get_integer",
    "fmi2SetString": "fmi3_set_string",
    "fmi2GetString": "fmi3_get_string",
    "fmi2GetRealOutputDerivatives": "fmi3_get_derivatives",
    "fmi2DoStep": "fmi3_do_step",
    "fmi2GetBooleanStatus": "fmi3_get_boolean_status",
    "fmi2GetRealStatus": "fmi3_get_real_status",
    "fmi2GetFMUstate": "fmi3_get_state",
    "fmi2SetFMUstate": "fmi3_set_state",
    "fmi2FreeFMUstate": "fmi3_free_state",
}
"""What the kernel calls of an FMI 3.0 instance (fmi3.h)."""


def callable_by_kernel(interface: CInterface) -> CInterface:
    """Return an instance with the functions of FMI 2.0 that the kernel calls, its own or those that stand for them."""
    return interface if interface.version == "2.0" else replace(interface, functions=_addresses(FMI3_FUNCTIONS))


def obstacle(slaves: Mapping[str, Slave]) -> str:
    """Return why these slaves cannot fly in the kernel, "" if they can."""
    other = next((name for name, slave in slaves.items() if slave.c_interface() is None), None)
    if other is not None:
        return f"{other} has no interface in C"
    try:
        library()
    except (BuildError, OSError) as error:
        return str(error).partition("\n")[0]
    return ""


@cache
def key() -> str:
    """Return what tells these sources, on this kind of machine, from others."""
    parts = [*(source.read_bytes() for source in SOURCES), f"{sys.platform} {machine()}".encode()]
    return hashlib.sha256(b"\0".join(parts)).hexdigest()[:16]


def _load(path: Path, declared: Callable[[ctypes.CDLL], ctypes.CDLL]) -> ctypes.CDLL | None:
    """Return the library of a file, None if it is not whole, not loadable, or not of this process's structures."""
    try:
        if _seal(path).read_bytes() != _digest(path):
            return None  # a cut library may load and end the process later
        found = ctypes.CDLL(str(path))
    except OSError:
        return None
    with suppress(AttributeError):  # another library
        if _layout(found) == list(sizes_and_offsets()):
            return declared(found)
    # while it is loaded, its path means it and not the file that is there now
    fmpy.freeLibrary(found._handle)  # pyright: ignore[reportPrivateUsage]
    return None


def _layout(found: ctypes.CDLL) -> list[int]:
    count = ctypes.c_longlong()
    found.kernel_layout.restype = ctypes.POINTER(ctypes.c_longlong)
    numbers: Any = found.kernel_layout(ctypes.byref(count))
    return [int(numbers[i]) for i in range(count.value)]


def _declared(found: ctypes.CDLL) -> ctypes.CDLL:
    integer, pointer = ctypes.c_longlong, ctypes.c_void_p
    found.kernel_run.restype = ctypes.c_int
    found.kernel_run.argtypes = [pointer, integer, ctypes.c_double, pointer, integer, integer, pointer]
    found.kernel_attempt.restype = ctypes.c_int
    found.kernel_attempt.argtypes = [pointer, ctypes.c_double, ctypes.c_double]
    for name in (*SIGNAL_FUNCTIONS.values(), *FMI3_FUNCTIONS.values()):
        getattr(found, name)  # AttributeError: it is another library
    found.kernel_texts.restype = pointer
    found.kernel_texts.argtypes = []
    found.kernel_free_texts.restype = None
    found.kernel_free_texts.argtypes = [pointer]
    found.kernel_text_number.restype = integer
    found.kernel_text_number.argtypes = [pointer, ctypes.c_char_p]
    found.kernel_text.restype = ctypes.c_char_p
    found.kernel_text.argtypes = [pointer, integer]
    found.kernel_text_count.restype = integer
    found.kernel_text_count.argtypes = [pointer]
    found.kernel_tell_crashes.restype = None
    found.kernel_tell_crashes.argtypes = [pointer, integer]
    found.kernel_take_stack.restype = pointer
    found.kernel_take_stack.argtypes = []
    found.kernel_give_stack_back.restype = None
    found.kernel_give_stack_back.argtypes = [pointer]
    return found


def _seal(path: Path) -> Path:
    return path.with_name(f"{path.name}.sha256")


def _write_seal(path: Path) -> None:
    """Write the checksum of a library beside it, whole or not at all, for other processes read it."""
    part = _seal(path).with_name(f".{path.name}.{os.getpid()}")
    part.write_bytes(_digest(path))
    places.keep(part, _seal(path))


def _digest(path: Path) -> bytes:
    return hashlib.sha256(path.read_bytes()).hexdigest().encode()
