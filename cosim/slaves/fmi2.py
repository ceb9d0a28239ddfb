"""FMI 2.0 FMUs as slaves, through fmpy."""

import ctypes
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from fmpy import fmi2
from fmpy.fmi1 import FMICallException

from cosim.arrays import FloatArray
from cosim.errors import CallFailed
from cosim.slaves import breadcrumb
from cosim.slaves.binary import Unmoved
from cosim.slaves.instance import Instance
from cosim.slaves.pending import STOP_IS_ASKED, TIME_IS_UP
from cosim.slaves.ready import ReadyCalls
from cosim.slaves.shelf import SHELF
from cosim.slaves.slave import CInterface, References, Refusal, note_warnings

COMMON = (
    "fmi2Instantiate",
    "fmi2FreeInstance",
    "fmi2SetupExperiment",
    "fmi2EnterInitializationMode",
    "fmi2ExitInitializationMode",
)
"""Functions without which nothing flies."""


class Unmoved2(Unmoved):
    """What FMI 2.0 FMUs for co-simulation and for model exchange have in common; `kind`: which of them it is."""

    kind = fmi2.fmi2CoSimulation
    fmi2Instantiate: Callable[..., Any]

    def instantiate(self, visible: bool = False, callbacks: Any = None, loggingOn: bool = False) -> None:
        """fmi2Instantiate, with the address of the resources as this FMU reads it."""
        self.callbacks = callbacks
        name, guid, resources = (s.encode() for s in (self.instanceName, self.guid, self._resources()))
        given = name, self.kind, guid, resources, ctypes.byref(callbacks), visible, loggingOn
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


class FMU2Unmoved(Unmoved2, fmi2.FMU2Slave):
    """fmpy's slave; fmpy tells the version of FMI by the class's name."""

    needed = (*COMMON, "fmi2DoStep")


class FmuSlave(Instance):
    """An instance of an FMI 2.0 FMU, `made` by fmpy; see `Instance`."""

    def __init__(self, name: str, path: Path, made: type[Unmoved2] = FMU2Unmoved) -> None:
        super().__init__(name, path, made)
        self._buffers: dict[References, tuple[Any, FloatArray, Any]] = {}
        self._vectors: dict[References, Any] = {}
        self._ended: float | None = None

    def instantiate(self) -> None:
        """fmi2Instantiate; nothing where there is an instance that was reset."""
        # pythonfmu's FMUs tell why they fail only where logging is on
        callbacks = SHELF.callbacks(self._key)
        self._instantiated("fmi2Instantiate", lambda: self._fmu.instantiate(callbacks=callbacks, loggingOn=True))

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
        """fmi2DoStep; one that is discarded at its very end, because the FMU wants no other, counts."""
        if self._ended is not None:
            raise self._stopped(self._ended)
        try:
            self._fmu.fmi2DoStep(self._fmu.component, t, h, fmi2.fmi2True)
            return
        except FMICallException as error:
            status = error.status
        self._stepped(status, t, h)

    def _stepped(self, status: int, t: float, h: float) -> None:
        """Take the status of a step that is not fmi2OK."""
        if self._ended is not None:
            raise self._stopped(self._ended)
        if status == fmi2.fmi2Warning:
            note_warnings(self.warned, "fmi2DoStep", 1, breadcrumb.here().time)
        elif status == fmi2.fmi2Pending:
            self._wait()
        else:
            failure = self._failure(FMICallException(function="fmi2DoStep", status=status))
            last = failure.last_successful_time
            if not failure.terminated or last is None or last < t + h - 1e-12 * max(abs(t), h):
                raise failure
            self._ended = last

    def _stopped(self, last: float) -> CallFailed:
        failure = self._refused("fmi2DoStep", "fmi2Discard")
        failure.last_successful_time, failure.terminated = last, True
        return failure

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
        self._ended = None

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
        self._ended = None
        return self._reset(self._fmu.reset)

    def free(self) -> None:
        """fmi2FreeInstance, once."""
        self._ended = None
        self._freed(self._fmu.fmi2FreeInstance)

    def c_interface(self) -> CInterface | None:
        """Return the instance for a caller in C."""
        if not self._alive:
            return None
        return CInterface(int(self._fmu.component), self._fmu.addresses)

    def ready(self) -> ReadyCalls | None:
        """Return the instance for a loop in Python; see `ReadyCalls`."""
        found = self.c_interface()
        return None if found is None else ReadyCalls(self.name, found, self._returned, self._stepped)

    def _returned(self, function: str, status: int) -> None:
        """Take a status that is not fmi2OK."""
        if status == fmi2.fmi2Warning:
            note_warnings(self.warned, function, 1, breadcrumb.here().time)
        else:
            raise self._failure(FMICallException(function=function, status=status))

    def failed(self, status: int) -> Refusal:
        """Note a call that failed; return what the FMU says of it where it discarded the call."""
        super().failed(status)
        if status == fmi2.fmi2Pending and self._asked(self._fmu.fmi2CancelStep, self._fmu.component) is None:
            self._alive = False  # it still steps, and FMI allows no other call then
        if status != fmi2.fmi2Discard:
            return Refusal()
        return Refusal(
            self._asked(self._fmu.getRealStatus, fmi2.fmi2LastSuccessfulTime),
            bool(self._asked(self._fmu.getBooleanStatus, fmi2.fmi2Terminated)),
        )

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
