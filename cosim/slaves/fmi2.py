"""FMUs as slaves, through fmpy.

fmpy is imported here and nowhere else in this package.
"""

import atexit
import ctypes
import itertools
import os
import shutil
import tempfile
from collections import deque
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
from fmpy import fmi2
from fmpy.fmi1 import FMICallException

from cosim.errors import STATUS, CallFailed, FmuError
from cosim.slaves.slave import FloatArray, References, Slave
from fmus.description.description import ModelDescription, Scalar, ScalarVariable
from fmus.description.read import read_description

__all__ = ["FmuSlave", "Slave"]

LOG_LINES = 200
"""How many of its last log messages a slave keeps."""


@cache
def _temporary() -> Path:
    folder = Path(tempfile.mkdtemp(prefix="adcs-fmu-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return folder


@cache
def _extracted(path: Path, stamp: tuple[int, int], copy: int) -> Path:
    """Extract an FMU once per version of the file (`stamp`: time and size), or once more per `copy`."""
    return Path(fmpy.extract(path, tempfile.mkdtemp(dir=_temporary())))


_copies = itertools.count(1)
_slaves: dict[int, "FmuSlave"] = {}
_keys = itertools.count(1)


_NOTHING = ("Fatal py exception encountered", "unknown error")
"""Begin and end of what pythonfmu says of an exception that the slave has told itself."""


def _log(environment: int | None, instance: bytes, status: int, category: bytes, message: bytes) -> None:
    slave = _slaves.get(environment or 0)
    text = (message or b"").decode("utf-8", "replace").rstrip()
    if slave is not None and not (text.startswith(_NOTHING[0]) and text.endswith(_NOTHING[1])):
        slave.messages.append(text)


_logger = fmi2.fmi2CallbackLoggerTYPE(_log)


def _callbacks(key: int) -> Any:
    """Return the callback functions of one instance; fmpy's proxy formats the message with its arguments."""
    callbacks = fmi2.fmi2CallbackFunctions()
    callbacks.logger = _logger
    callbacks.allocateMemory = fmi2.fmi2CallbackAllocateMemoryTYPE(fmpy.calloc)
    callbacks.freeMemory = fmi2.fmi2CallbackFreeMemoryTYPE(fmpy.free)
    callbacks.componentEnvironment = key
    proxy: Callable[[Any], None] | None = getattr(fmi2, "addLoggerProxy", None)
    if proxy is not None:
        proxy(ctypes.byref(callbacks))
    return callbacks


class FmuSlave:
    """An instance of an FMU file. `messages` are its last log messages, oldest first.

    Raises `FmuError` if the file cannot be used on this machine, later `CallFailed` for every status above warning.
    """

    def __init__(self, name: str, path: Path, description: ModelDescription | None = None) -> None:
        self.name = name
        self.path = path
        self.description = description or read_description(path)
        self.messages: deque[str] = deque(maxlen=LOG_LINES)
        offered = fmpy.supported_platforms(str(path))
        if fmpy.platform not in offered:
            there = ", ".join(p for p in offered if p != "c-code") or "none"
            advice = " It has C sources: fmpy compile builds them." if "c-code" in offered else ""
            raise FmuError(path, f"it has no binary for this platform: needed {fmpy.platform}, there: {there}.{advice}")
        stat = path.stat()
        copy = next(_copies) if self.description.only_once_per_process else 0
        folder = _extracted(path.resolve(), (stat.st_mtime_ns, stat.st_size), copy)
        self._fmu = self._load(folder)
        self._key = next(_keys)
        self._alive = False
        self._buffers: dict[References, tuple[Any, FloatArray, Any]] = {}

    def _load(self, folder: Path) -> Any:
        here = Path.cwd()
        try:
            return fmi2.FMU2Slave(
                guid=self.description.guid,
                modelIdentifier=self.description.model_identifier,
                unzipDirectory=str(folder),
                instanceName=self.name,
            )
        except Exception as error:  # fmpy raises plain Exceptions here
            raise FmuError(self.path, f"its binary cannot be loaded: {error}") from error
        finally:
            os.chdir(here)

    def instantiate(self) -> None:
        """fmi2Instantiate."""
        _slaves[self._key] = self
        try:
            # pythonfmu's FMUs tell why they fail only where logging is on
            self._fmu.instantiate(callbacks=_callbacks(self._key), loggingOn=True)
        except Exception as error:
            raise CallFailed(self.name, "fmi2Instantiate", "no instance", tuple(self.messages)) from error
        self._alive = True

    def set(self, variable: ScalarVariable, value: Scalar) -> None:
        """fmi2SetReal, fmi2SetInteger, fmi2SetBoolean or fmi2SetString."""
        function = {"Real": "Real", "Boolean": "Boolean", "String": "String"}.get(variable.type, "Integer")
        self._call(getattr(self._fmu, f"set{function}"), [variable.value_reference], [value])

    def setup_experiment(self, t: float) -> None:
        """fmi2SetupExperiment."""
        self._call(self._fmu.setupExperiment, None, t)

    def enter_initialization_mode(self) -> None:
        """fmi2EnterInitializationMode."""
        self._call(self._fmu.enterInitializationMode)

    def exit_initialization_mode(self) -> None:
        """fmi2ExitInitializationMode."""
        self._call(self._fmu.exitInitializationMode)

    def get_real(self, references: References) -> FloatArray:
        """fmi2GetReal."""
        vr, array, pointer = self._buffer(references)
        self._call(self._fmu.fmi2GetReal, self._fmu.component, vr, len(references), pointer)
        return array.copy()

    def set_real(self, references: References, values: FloatArray) -> None:
        """fmi2SetReal."""
        vr, array, pointer = self._buffer(references)
        array[:] = values
        self._call(self._fmu.fmi2SetReal, self._fmu.component, vr, len(references), pointer)

    def set_input_derivatives(self, references: References, orders: References, values: FloatArray) -> None:
        """fmi2SetRealInputDerivatives."""
        self._call(self._fmu.setRealInputDerivatives, references, orders, values)

    def get_output_derivatives(self, references: References, orders: References) -> FloatArray:
        """fmi2GetRealOutputDerivatives."""
        return np.array(self._call(self._fmu.getRealOutputDerivatives, references, orders))

    def do_step(self, t: float, h: float) -> None:
        """fmi2DoStep."""
        self._call(self._fmu.fmi2DoStep, self._fmu.component, t, h, fmi2.fmi2True)

    def get_state(self) -> Any:
        """fmi2GetFMUstate."""
        return self._call(self._fmu.getFMUstate)

    def set_state(self, state: Any) -> None:
        """fmi2SetFMUstate."""
        self._call(self._fmu.setFMUstate, state)

    def free_state(self, state: Any) -> None:
        """fmi2FreeFMUstate."""
        self._call(self._fmu.freeFMUstate, state)

    def serialize_state(self, state: Any) -> bytes:
        """fmi2SerializeFMUstate."""
        return self._call(self._fmu.serializeFMUstate, state)

    def deserialize_state(self, data: bytes) -> Any:
        """fmi2DeSerializeFMUstate."""
        return self._call(self._fmu.deSerializeFMUstate, data)

    def directional_derivative(self, unknowns: References, knowns: References, seed: FloatArray) -> FloatArray:
        """fmi2GetDirectionalDerivative."""
        return np.array(self._call(self._fmu.getDirectionalDerivative, unknowns, knowns, seed))

    def terminate(self) -> None:
        """fmi2Terminate, where FMI still allows it."""
        if self._alive:
            self._call(self._fmu.terminate)

    def free(self) -> None:
        """fmi2FreeInstance, once. The library stays loaded: unloading pythonfmu's can end the process."""
        if self._alive:
            self._alive = False
            self._fmu.fmi2FreeInstance(self._fmu.component)
        _slaves.pop(self._key, None)

    def _buffer(self, references: References) -> tuple[Any, FloatArray, Any]:
        found = self._buffers.get(references)
        if found is None:
            vr = (ctypes.c_uint * len(references))(*references)
            array = np.zeros(len(references))
            found = vr, array, array.ctypes.data_as(ctypes.POINTER(ctypes.c_double))
            self._buffers[references] = found
        return found

    def _call(self, function: Callable[..., Any], *arguments: Any) -> Any:
        try:
            return function(*arguments)
        except FMICallException as error:
            status = STATUS.get(error.status, f"the illegal status {error.status}")
            last = self.lost(error.status)
            messages = tuple(self.messages)
            raise CallFailed(self.name, error.function, status, messages, last) from None

    @property
    def address(self) -> int:
        """Address of the fmi2Component, for a caller in C."""
        return int(self._fmu.component)

    def entry(self, function: str) -> int:
        """Return the address of an FMI function, 0 where the library lacks it."""
        found = getattr(self._fmu.dll, function, None)
        return 0 if found is None else int(ctypes.cast(found, ctypes.c_void_p).value or 0)

    def lost(self, status: int) -> float | None:
        """Note a failed call that was made in C; return the last successful time where the FMU knows it."""
        if status == fmi2.fmi2Fatal:
            self._alive = False  # FMI: no further call, not even fmi2FreeInstance
        return self._last_successful_time() if status == fmi2.fmi2Discard else None

    def _last_successful_time(self) -> float | None:
        try:
            return self._fmu.getRealStatus(fmi2.fmi2LastSuccessfulTime)
        except FMICallException:
            return None
