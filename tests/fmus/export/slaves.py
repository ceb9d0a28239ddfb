"""An FMU in this process, by variable names, with its log messages."""

import ctypes
from itertools import count
from pathlib import Path

import fmpy
import pytest
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import (
    FMU2Slave,
    calloc,
    fmi2CallbackAllocateMemoryTYPE,
    fmi2CallbackFreeMemoryTYPE,
    fmi2CallbackFunctions,
    fmi2CallbackLoggerTYPE,
    free,
)
from fmpy.logging import addLoggerProxy
from fmpy.model_description import read_model_description

from fmus.export.native.native_fmu import describe_native
from fmus.export.regions import regions_of

_MESSAGES: dict[str, list[str]] = {}  # by instance: fmpy's proxy, which formats messages, knows one logger only
_COUNT = count()


def _log(environment, name, status, category, message):
    _MESSAGES.setdefault(name.decode(), []).append(message.decode())


_LOGGER = fmi2CallbackLoggerTYPE(_log)


def _callbacks() -> fmi2CallbackFunctions:
    callbacks = fmi2CallbackFunctions()
    callbacks.logger = _LOGGER
    callbacks.allocateMemory = _ALLOCATE
    callbacks.freeMemory = _FREE
    addLoggerProxy(ctypes.byref(callbacks))
    return callbacks


_ALLOCATE, _FREE = fmi2CallbackAllocateMemoryTYPE(calloc), fmi2CallbackFreeMemoryTYPE(free)


class Slave:
    """One instance, instantiated; `folder` is where the FMU was unpacked. Has the methods of fmpy's FMU2Slave."""

    def __init__(self, folder: Path, name: str = "unit", guid: str | None = None, logging: bool = False):
        self.description = read_model_description(str(folder))
        self.reference = {v.name: v.valueReference for v in self.description.modelVariables}
        self._slave = FMU2Slave(
            guid=guid or self.description.guid,
            modelIdentifier=self.description.coSimulation.modelIdentifier,
            unzipDirectory=str(folder),
            instanceName=name,
        )
        self._messages_of = f"{name}-{next(_COUNT)}" if name else ""
        self._slave.instanceName = self._messages_of
        self._slave.instantiate(callbacks=_callbacks(), loggingOn=logging)

    def __getattr__(self, name: str):
        return getattr(self._slave, name)

    @property
    def messages(self) -> list[str]:
        return _MESSAGES.setdefault(self._messages_of, [])

    def vr(self, *names: str) -> list[int]:
        return [self.reference[n] for n in names]

    def get(self, *names: str) -> list[float]:
        return self.getReal(self.vr(*names))

    def set(self, values: dict[str, float]) -> None:
        self.setReal(self.vr(*values), list(values.values()))

    def begin(self, start: float = 0.0, stop: float | None = None) -> "Slave":
        self.setupExperiment(startTime=start, stopTime=stop)
        self.enterInitializationMode()
        return self

    def start(self, start: float = 0.0, stop: float | None = None) -> "Slave":
        self.begin(start, stop).exitInitializationMode()
        return self

    def everything(self) -> list[float]:
        return self.getReal(sorted(self.reference.values()))


def unpack(path: Path) -> Path:
    """Unpack an FMU beside itself."""
    return Path(fmpy.extract(str(path), str(path.with_suffix(""))))


def names_of(component, model_name: str, *regions: str) -> list[str]:
    """Names of the scalars of some regions of v."""
    names, places = list(describe_native(component, model_name).variables), regions_of(component, derivatives=True)
    return [names[places.offset[r] + i] for r in regions for i in range(places.size[r])]


def refused(call, *arguments, **named) -> None:
    """Expect a call to return fmi2Error."""
    with pytest.raises(FMICallException) as caught:
        call(*arguments, **named)
    assert caught.value.status == 3
