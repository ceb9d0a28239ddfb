"""The shared library of an FMU: found in its extracted folder, loaded, its FMI functions taken as they are there.

`Unmoved` is mixed into fmpy's classes for FMUs of each version. It loads without a change of the process's working
folder, which threads would see. A function that is not there is refused where none can do without it; any other one is
replaced by one that says so and fails, so that an FMU without fmi2CancelStep flies until somebody wants to cancel.
"""

import ctypes
import os
import re
from collections.abc import Callable, Sequence
from contextlib import nullcontext, suppress
from pathlib import Path
from typing import Any

import fmpy
from fmpy.fmi1 import FMICallException

from cosim.slaves import breadcrumb
from cosim.slaves.slave import Warned, note_warnings
from fmus.description.description import ModelDescription

OK, WARNING, DISCARD, ERROR, FATAL, PENDING = range(6)
"""fmi2Status, of which FMI 1.0 and 3.0 know the same numbers."""

_LACKS = ctypes.CFUNCTYPE(ctypes.c_int)
_MISSING = re.compile(r"(?P<library>\S+\.so\S*): cannot open shared object file")


class Unmoved:
    """fmpy's class for an FMU, of which it is the first base; it is told by name which version of FMI it is.

    A status that FMI does not know is an error, a negative one too. `lacking`: functions that are not there.
    """

    needed: Sequence[str] = ()
    """Functions without which nothing flies, as fmpy names them."""

    def open(self, description: ModelDescription, folder: Path, name: str, heard: Callable[[str], None]) -> None:
        """Load the library; `heard` takes what is to be said of functions that are not there. Raises what is wrong."""
        self.guid, self.modelIdentifier = description.guid, description.model_identifier
        self.unzipDirectory, self.instanceName = str(folder), name
        self.fmiCallLogger, self.requireFunctions = None, True
        self._functions: dict[str, Any] = {}
        self._address = breadcrumb.address(name.encode())
        self._heard, self._stubs = heard, list[Any]()
        self.lacking: set[str] = set()
        loaded = _load(_library(description, folder), name.encode())
        self._handle = loaded._handle  # pyright: ignore[reportPrivateUsage]
        self.dll: Any = _Lenient(loaded, f"{self.modelIdentifier}_", self._stand_in)
        self._loadFunctions()  # pyright: ignore[reportAttributeAccessIssue]
        missing = [function for function in map(self.in_library, self.needed) if function in self.lacking]
        if missing:
            raise ValueError(f"it has no function {', '.join(missing)}")
        self.addresses = {name: _address(function) for name, function in self._functions.items()}
        self.component: Any = None
        self.callbacks: Any = None
        self.warned: Warned = {}

    def close(self) -> None:
        """Unload the library, of which nothing may be called any more."""
        fmpy.freeLibrary(self._handle)

    def in_library(self, function: str) -> str:
        """Return the name that a function has in the library."""
        return function

    def _stand_in(self, function: str) -> Any:
        """Return a function in C that stands for one that is not there; a caller in C may call it too."""
        self.lacking.add(function)

        def fails() -> int:
            self._heard(f"the FMU has no function {function}")
            return ERROR

        self._stubs.append(_LACKS(fails))
        return self._stubs[-1]

    def _call(self, fname: str, *args: Any) -> Any:
        function, here = self._functions[fname], breadcrumb.here()
        here.instance, here.function = self._address, breadcrumb.address(fname.encode())
        try:
            result = function(*args)
        finally:
            here.function = None
        if function.restype is ctypes.c_int and result != OK:
            if result != WARNING:
                raise FMICallException(function=fname, status=result)
            note_warnings(self.warned, fname, 1, breadcrumb.here().time)
        return result


class _Lenient:
    """A library in which every function can be found; `prefix`: what FMI puts before its names in sources."""

    def __init__(self, library: ctypes.CDLL, prefix: str, stand_in: Callable[[str], Any]) -> None:
        self._library, self._prefix, self._stand_in = library, prefix, stand_in

    def __getattr__(self, name: str) -> Any:
        for spelt in (name, self._prefix + name):
            with suppress(AttributeError):
                return getattr(self._library, spelt)
        return self._stand_in(name)


def _library(description: ModelDescription, folder: Path) -> Path:
    """Return the file of this platform's library; where it has another name than it should, the only one there is."""
    place = fmpy.platform_tuple if description.fmi_version.startswith("3") else fmpy.platform
    binaries = folder / "binaries" / place
    path = binaries / f"{description.model_identifier}{fmpy.sharedLibraryExtension}"
    others = [] if path.is_file() else sorted(binaries.glob(f"*{fmpy.sharedLibraryExtension}"))
    return others[0] if len(others) == 1 else path


def _load(path: Path, name: bytes) -> ctypes.CDLL:
    beside: Any = getattr(os, "add_dll_directory", lambda _folder: nullcontext())  # where a DLL finds its like
    try:
        with beside(str(path.parent)), breadcrumb.inside(name, b"dlopen"):
            return ctypes.CDLL(str(path))
    except OSError as error:
        missing = _MISSING.search(str(error))
        if missing is None or missing["library"] == str(path):
            raise
        raise OSError(_advice(missing["library"], path)) from error


def _advice(library: str, path: Path) -> str:
    """Return what to do about a library that another one needs and does not find."""
    if (path.parent / library).is_file():
        here = f"it lies beside {path.name}, which does not look there; start with LD_LIBRARY_PATH={path.parent}"
        return f"it needs the library {library}: {here}, or preload it (LD_PRELOAD)"
    return f"it needs the library {library}, which is not on this machine: install it, or set LD_LIBRARY_PATH"


def _address(function: Any) -> int:
    return int(ctypes.cast(function, ctypes.c_void_p).value or 0)
