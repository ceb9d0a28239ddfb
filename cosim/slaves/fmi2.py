"""FMI 2.0 FMUs as slaves, through fmpy. With shelf.py the only place of this package that imports fmpy."""

import ctypes
import os
from collections import deque
from collections.abc import Callable, Sequence
from contextlib import nullcontext
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
from fmpy import fmi2
from fmpy.fmi1 import FMICallException

from cosim.arrays import FloatArray
from cosim.errors import CallFailed, FmuError, status_name
from cosim.slaves import breadcrumb
from cosim.slaves.pending import STOP_IS_ASKED, TIME_IS_UP, Patience
from cosim.slaves.shelf import SHELF
from cosim.slaves.slave import CInterface, References, Refusal, Warned, note_warnings
from fmus.description.description import ModelDescription

LOG_LINES = 200
"""How many of its last log messages a slave keeps."""


class FMU2Unmoved(fmi2.FMU2Slave):
    """fmpy's slave, loaded without a change of the process's working folder, which threads would see.

    A status that FMI does not know is an error, a negative one too. fmpy tells the version of FMI by the class's name.
    """

    def __init__(self, description: ModelDescription, folder: Path, name: str) -> None:
        binaries = folder / "binaries" / fmpy.platform
        library = binaries / f"{description.model_identifier}{fmpy.sharedLibraryExtension}"
        self.guid, self.modelIdentifier = description.guid, description.model_identifier
        self.unzipDirectory, self.instanceName = str(folder), name
        self.fmiCallLogger, self.requireFunctions = None, True
        self._functions: dict[str, Any] = {}
        beside: Any = getattr(os, "add_dll_directory", lambda _folder: nullcontext())  # where a DLL finds its like
        self._name = name.encode()
        with beside(str(binaries)), breadcrumb.inside(self._name, b"dlopen"):
            self.dll = ctypes.CDLL(str(library))
        self._loadFunctions()
        self.addresses = {name: _address(function) for name, function in self._functions.items()}
        self.component: Any = None
        self.callbacks: Any = None
        self.warned: Warned = {}

    def instantiate(self, visible: bool = False, callbacks: Any = None, loggingOn: bool = False) -> None:
        """fmi2Instantiate, with the address of the resources as this FMU reads it."""
        self.callbacks = callbacks
        name, guid, resources = (s.encode() for s in (self.instanceName, self.guid, self._resources()))
        given = name, fmi2.fmi2CoSimulation, guid, resources, ctypes.byref(callbacks), visible, loggingOn
        self.component = self.fmi2Instantiate(*given)
        if self.component is None:
            raise FMICallException(function="fmi2Instantiate", status=fmi2.fmi2Error)

    def _resources(self) -> str:
        """Return a URI; for an FMU of pythonfmu one that is escaped no further than it reads: %20 is a blank."""
        resources = Path(self.unzipDirectory, "resources")
        escaped = resources.as_uri()
        if "%" not in escaped.replace("%20", "") or not (resources / "slavemodule.txt").is_file():
            return escaped
        path = resources.as_posix()
        if "%20" in path:
            raise ValueError(f"pythonfmu takes %20 in {path} for a blank: set ADCS_BUILD to a folder without it")
        begin = escaped[: escaped.index("/", len("file://")) + 1]
        return begin + path.lstrip("/").replace(" ", "%20")

    def _call(self, fname: str, *args: Any) -> Any:
        function = self._functions[fname]
        with breadcrumb.inside(self._name, fname.encode()):
            result = function(*args)
        if function.restype is ctypes.c_int and result != fmi2.fmi2OK:
            if result != fmi2.fmi2Warning:
                raise FMICallException(function=fname, status=result)
            note_warnings(self.warned, fname, 1, breadcrumb.here().time)
        return result


class FmuSlave:
    """An instance of an FMU file. `messages` are its last log messages, oldest first; `warned` see `Slave`.

    Raises `FmuError` if the file cannot be used on this machine, later `CallFailed` for every status above warning.
    """

    def __init__(self, name: str, path: Path) -> None:
        self.name = name
        self.path = path
        self.description = SHELF.description(path)
        self.messages: deque[str] = deque(maxlen=LOG_LINES)
        folder = SHELF.extracted(path, own_copy=self.description.only_once_per_process)
        try:
            self._fmu = FMU2Unmoved(self.description, folder, name)
        except Exception as error:  # whatever a file that is no library, or lacks functions, leads to
            raise FmuError(path, f"its binary cannot be loaded: {error}") from error
        self.warned = self._fmu.warned
        self.patience = Patience()
        self._key = SHELF.listen(self)
        self._alive = False
        self._buffers: dict[References, tuple[Any, FloatArray, Any]] = {}
        self._vectors: dict[References, Any] = {}

    def instantiate(self) -> None:
        """fmi2Instantiate; nothing where there is an instance that was reset."""
        if self._alive:
            return
        try:
            # pythonfmu's FMUs tell why they fail only where logging is on
            self._fmu.instantiate(callbacks=SHELF.callbacks(self._key), loggingOn=True)
        except Exception as error:
            said = [str(error)] if isinstance(error, ValueError) else []
            raise CallFailed(self.name, "fmi2Instantiate", "no instance", (*self.messages, *said)) from error
        self._alive = True

    def setup_experiment(self, t: float, tolerance: float | None = None, stop: float | None = None) -> None:
        """fmi2SetupExperiment."""
        self._call(self._fmu.setupExperiment, tolerance, t, stop)

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

    def get_integer(self, references: References) -> Sequence[int]:
        """fmi2GetInteger."""
        return self._get(self._fmu.fmi2GetInteger, references, fmi2.fmi2Integer)

    def set_integer(self, references: References, values: Sequence[int]) -> None:
        """fmi2SetInteger."""
        self._set(self._fmu.fmi2SetInteger, references, fmi2.fmi2Integer, values)

    def get_boolean(self, references: References) -> Sequence[bool]:
        """fmi2GetBoolean."""
        return [bool(value) for value in self._get(self._fmu.fmi2GetBoolean, references, fmi2.fmi2Boolean)]

    def set_boolean(self, references: References, values: Sequence[bool]) -> None:
        """fmi2SetBoolean."""
        self._set(self._fmu.fmi2SetBoolean, references, fmi2.fmi2Boolean, values)

    def get_string(self, references: References) -> Sequence[bytes]:
        """fmi2GetString; no text at all is the empty one."""
        return [value or b"" for value in self._get(self._fmu.fmi2GetString, references, fmi2.fmi2String)]

    def set_string(self, references: References, values: Sequence[bytes]) -> None:
        """fmi2SetString."""
        self._set(self._fmu.fmi2SetString, references, fmi2.fmi2String, values)

    def set_input_derivatives(self, references: References, orders: References, values: FloatArray) -> None:
        """fmi2SetRealInputDerivatives."""
        self._call(self._fmu.setRealInputDerivatives, references, orders, values)

    def get_output_derivatives(self, references: References, orders: References) -> FloatArray:
        """fmi2GetRealOutputDerivatives."""
        return np.array(self._call(self._fmu.getRealOutputDerivatives, references, orders))

    def do_step(self, t: float, h: float) -> None:
        """fmi2DoStep."""
        try:
            self._fmu.fmi2DoStep(self._fmu.component, t, h, fmi2.fmi2True)
        except FMICallException as error:
            if error.status != fmi2.fmi2Pending:
                raise self._failure(error) from None
            self._wait()

    def _wait(self) -> None:
        """Wait until a step that is pending is done."""
        status, why = self.patience.wait(self._step_status, fmi2.fmi2Pending)
        if status == fmi2.fmi2Warning:
            note_warnings(self.warned, "fmi2DoStep", 1, breadcrumb.here().time)
        elif status != fmi2.fmi2OK:
            failure = self._failure(FMICallException(function="fmi2DoStep", status=status))
            if why == STOP_IS_ASKED:
                raise KeyboardInterrupt
            failure.waited = self.patience.timeout if why == TIME_IS_UP else None
            raise failure

    def _step_status(self) -> int | None:
        """Return the status of the step that is pending, None where the FMU does not tell it."""
        status = ctypes.c_int(fmi2.fmi2Pending)
        question = self._fmu.component, fmi2.fmi2DoStepStatus, ctypes.byref(status)
        return status.value if self._asked(self._fmu.fmi2GetStatus, *question) == fmi2.fmi2OK else None

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

    def reset(self) -> bool:
        """fmi2Reset; False where there is no instance, or it cannot be reset: `free` it, and make a new one."""
        self.messages.clear()
        self.warned.clear()
        if not self._alive:
            return False
        try:
            self._call(self._fmu.reset)
        except CallFailed:
            return False
        return True

    def free(self) -> None:
        """fmi2FreeInstance, once. The library stays loaded: unloading pythonfmu's can end the process."""
        if self._alive:
            self._alive = False
            self._fmu.fmi2FreeInstance(self._fmu.component)

    def c_interface(self) -> CInterface | None:
        """Return the instance for a caller in C."""
        if not self._alive:
            return None
        return CInterface(int(self._fmu.component), self._fmu.addresses)

    def failed(self, status: int) -> Refusal:
        """Note a call that failed; return what the FMU says of it where it discarded the call."""
        if status == fmi2.fmi2Fatal:
            self._alive = False  # FMI: no further call, not even fmi2FreeInstance
        if status == fmi2.fmi2Pending and self._asked(self._fmu.fmi2CancelStep, self._fmu.component) is None:
            self._alive = False  # it still steps, and FMI allows no other call then
        if status != fmi2.fmi2Discard:
            return Refusal()
        return Refusal(
            self._asked(self._fmu.getRealStatus, fmi2.fmi2LastSuccessfulTime),
            bool(self._asked(self._fmu.getBooleanStatus, fmi2.fmi2Terminated)),
        )

    @staticmethod
    def _asked(function: Callable[..., Any], *arguments: Any) -> Any:
        try:
            return function(*arguments)
        except FMICallException:
            return None

    def _buffer(self, references: References) -> tuple[Any, FloatArray, Any]:
        found = self._buffers.get(references)
        if found is None:
            array = np.zeros(len(references))
            found = self._vector(references), array, array.ctypes.data_as(ctypes.POINTER(ctypes.c_double))
            self._buffers[references] = found
        return found

    def _vector(self, references: References) -> Any:
        found = self._vectors.get(references)
        if found is None:
            found = self._vectors[references] = (ctypes.c_uint * len(references))(*references)
        return found

    def _get(self, function: Callable[..., Any], references: References, kind: Any) -> list[Any]:
        values = (kind * len(references))()
        self._call(function, self._fmu.component, self._vector(references), len(references), values)
        return list(values)

    def _set(self, function: Callable[..., Any], references: References, kind: Any, values: Sequence[Any]) -> None:
        array = (kind * len(references))(*values)
        self._call(function, self._fmu.component, self._vector(references), len(references), array)

    def _call(self, function: Callable[..., Any], *arguments: Any) -> Any:
        try:
            return function(*arguments)
        except FMICallException as error:
            raise self._failure(error) from None

    def _failure(self, error: FMICallException) -> CallFailed:
        said = self.failed(error.status)
        status, messages = status_name(error.status), tuple(self.messages)
        return CallFailed(
            self.name, error.function, status, messages, said.last_successful_time, terminated=said.terminated
        )


def _address(function: Any) -> int:
    return int(ctypes.cast(function, ctypes.c_void_p).value or 0)
