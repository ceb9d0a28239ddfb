"""A native FMU in this process, by variable names, with its log messages."""

import ctypes
from pathlib import Path

import fmpy
from fmpy.fmi2 import FMU2Slave, calloc, fmi2CallbackAllocateMemoryTYPE, fmi2CallbackFreeMemoryTYPE
from fmpy.fmi2 import fmi2CallbackFunctions, fmi2CallbackLoggerTYPE, free
from fmpy.logging import addLoggerProxy
from fmpy.model_description import read_model_description

from fmus.interface import Interface


class Slave:
    """One instance, instantiated; `folder` is where the FMU was unpacked. Has the methods of fmpy's FMU2Slave."""

    def __init__(self, folder: Path, name: str = "unit", guid: str | None = None):
        self.description = read_model_description(str(folder))
        self.reference = {v.name: v.valueReference for v in self.description.modelVariables}
        self.messages: list[str] = []
        self._slave = FMU2Slave(
            guid=guid or self.description.guid,
            modelIdentifier=self.description.coSimulation.modelIdentifier,
            unzipDirectory=str(folder),
            instanceName=name,
        )
        self._callbacks = fmi2CallbackFunctions()
        self._callbacks.logger = fmi2CallbackLoggerTYPE(self._log)
        self._callbacks.allocateMemory = fmi2CallbackAllocateMemoryTYPE(calloc)
        self._callbacks.freeMemory = fmi2CallbackFreeMemoryTYPE(free)
        addLoggerProxy(ctypes.byref(self._callbacks))
        self._slave.instantiate(callbacks=self._callbacks)

    def __getattr__(self, name: str):
        return getattr(self._slave, name)

    def _log(self, environment, name, status, category, message):
        self.messages.append(message.decode())

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
    interface = Interface(component, model_name, derivatives=True)
    names = [s.name for s in interface.variables]
    return [names[interface.offset[r] + i] for r in regions for i in range(interface.size[r])]
