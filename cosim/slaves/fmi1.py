"""FMI 1.0 co-simulation FMUs as slaves, through fmpy.

FMI 1.0 has no initialization mode: fmiInitializeSlave is called when the first output is asked for, with the inputs and
parameters that were set before it; inputs that are set later act from then on.

Limits: states are not saved, inputs are held.
"""

import ctypes
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
from fmpy import fmi1

from cosim.arrays import FloatArray
from cosim.slaves.binary import Unmoved
from cosim.slaves.instance import Instance
from cosim.slaves.slave import References

_TEXTS = ("fmi1GetVersion", "fmi1GetTypesPlatform")


class Unmoved1(Unmoved):
    """What FMI 1.0 FMUs for co-simulation and for model exchange have in common."""

    instantiating = ""
    """Name of the function that makes an instance."""

    def in_library(self, function: str) -> str:
        """Return the name that a function has in the library."""
        return f"{self.modelIdentifier}_{function.replace('fmi1', 'fmi')}"

    def _loadFunctions(self) -> None:
        super()._loadFunctions()  # pyright: ignore[reportAttributeAccessIssue]
        for name, function in self._functions.items():
            if function.restype is ctypes.c_char_p and name not in _TEXTS:
                function.restype = ctypes.c_int  # fmpy takes the status of some for a text


class FMU1Unmoved(Unmoved1, fmi1.FMU1Slave):
    """fmpy's slave; fmpy tells the version of FMI by the class's name."""

    needed = ("fmi1InstantiateSlave", "fmi1FreeSlaveInstance", "fmi1InitializeSlave", "fmi1DoStep")
    instantiating = "fmiInstantiateSlave"


class Fmi1Slave(Instance):
    """An instance of an FMI 1.0 FMU; see `Instance`."""

    prefix = "fmi"

    def __init__(self, name: str, path: Path, made: type[Unmoved1] = FMU1Unmoved) -> None:
        super().__init__(name, path, made)
        self._begin: tuple[float, float | None] = (0.0, None)
        self._initialized = False
        self._callbacks = fmi1.fmi1CallbackFunctions()
        self._callbacks.logger = fmi1.fmi1CallbackLoggerTYPE(self._log)
        self._callbacks.allocateMemory = fmi1.fmi1CallbackAllocateMemoryTYPE(fmpy.calloc)
        self._callbacks.freeMemory = fmi1.fmi1CallbackFreeMemoryTYPE(fmpy.free)
        self._callbacks.stepFinished = None
        proxy: Callable[[Any], None] | None = getattr(fmi1, "addLoggerProxy", None)
        if proxy is not None:
            proxy(ctypes.byref(self._callbacks))

    def _log(self, _component: Any, _instance: bytes, _status: int, _category: bytes, message: bytes) -> None:
        self.messages.append((message or b"").decode("utf-8", "replace").rstrip())

    def instantiate(self) -> None:
        """Make the instance; nothing where there is one that was reset."""
        self._initialized = False

        def make() -> None:
            self._fmu.instantiate(functions=self._callbacks, loggingOn=True)
            if not self._fmu.component:
                raise RuntimeError("no instance")

        self._instantiated(self._fmu.instantiating, make)

    def setup_experiment(self, t: float, tolerance: float | None = None, stop: float | None = None) -> None:
        """Note the times; FMI 1.0 takes no tolerance."""
        self._begin = t, stop

    def enter_initialization_mode(self) -> None:
        """Do nothing: there is none."""

    def exit_initialization_mode(self) -> None:
        """fmiInitializeSlave, where no output was asked for before."""
        self._initialize()

    def _initialize(self) -> None:
        if not self._initialized:
            self._call(self._fmu.initialize, *self._begin)
            self._initialized = True

    def get_real(self, references: References) -> FloatArray:
        """FmiGetReal."""
        return np.array(self._get(self._fmu.fmi1GetReal, references, ctypes.c_double))

    def set_real(self, references: References, values: FloatArray) -> None:
        """FmiSetReal."""
        self._set(self._fmu.fmi1SetReal, references, ctypes.c_double, np.asarray(values).tolist())

    def get_integer(self, references: References) -> Sequence[int]:
        """FmiGetInteger."""
        return self._get(self._fmu.fmi1GetInteger, references, ctypes.c_int)

    def set_integer(self, references: References, values: Sequence[int]) -> None:
        """FmiSetInteger."""
        self._set(self._fmu.fmi1SetInteger, references, ctypes.c_int, values)

    def get_boolean(self, references: References) -> Sequence[bool]:
        """FmiGetBoolean."""
        return [value != b"\0" for value in self._get(self._fmu.fmi1GetBoolean, references, ctypes.c_char)]

    def set_boolean(self, references: References, values: Sequence[bool]) -> None:
        """FmiSetBoolean."""
        self._set(self._fmu.fmi1SetBoolean, references, ctypes.c_char, [bytes([bool(v)]) for v in values])

    def get_string(self, references: References) -> Sequence[bytes]:
        """FmiGetString."""
        return [value or b"" for value in self._get(self._fmu.fmi1GetString, references, ctypes.c_char_p)]

    def set_string(self, references: References, values: Sequence[bytes]) -> None:
        """FmiSetString."""
        self._set(self._fmu.fmi1SetString, references, ctypes.c_char_p, values)

    def do_step(self, t: float, h: float) -> None:
        """FmiDoStep."""
        self._call(self._fmu.fmi1DoStep, self._fmu.component, t, h, b"\x01")

    def terminate(self) -> None:
        """fmiTerminateSlave, where FMI still allows it."""
        if self._alive:
            self._call(self._fmu.terminate)

    def reset(self) -> bool:
        """fmiResetSlave; False where there is no instance, or it cannot be reset."""
        self._initialized = False
        return self._reset(self._fmu.reset)

    def free(self) -> None:
        """fmiFreeSlaveInstance, once."""
        self._freed(self._fmu.fmi1FreeSlaveInstance)

    def _get(self, function: Callable[..., Any], references: References, kind: Any) -> list[Any]:
        self._initialize()
        values = (kind * len(references))()
        self._call(function, self._fmu.component, _vector(references), len(references), values)
        return list(values)

    def _set(self, function: Callable[..., Any], references: References, kind: Any, values: Sequence[Any]) -> None:
        given = (kind * len(references))(*values)
        self._call(function, self._fmu.component, _vector(references), len(references), given)


def _vector(references: References) -> Any:
    return (ctypes.c_uint * len(references))(*references)
