"""FMUs for model exchange alone, FMI 1.0 to 3.0, as slaves: their derivatives are integrated here (integration.py).

Inputs are held over each step. A continuous input is set in continuous time, any other one in event mode; one that is
set to what it is makes no event.

Limits: states are not saved, so such an FMU flies in no master that repeats steps.
"""

import ctypes
import os
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from fmpy import fmi1, fmi2, fmi3
from fmpy.fmi1 import FMICallException

from cosim.arrays import FloatArray
from cosim.errors import status_name
from cosim.slaves.binary import ERROR, Unmoved
from cosim.slaves.fmi1 import Fmi1Slave, Unmoved1
from cosim.slaves.fmi2 import COMMON, FmuSlave, Unmoved2
from cosim.slaves.fmi3 import COMMON as COMMON3
from cosim.slaves.fmi3 import Fmi3Slave
from cosim.slaves.instance import Instance
from cosim.slaves.integration import TOLERANCE, Ended, Integration, Stuck
from cosim.slaves.shelf import SHELF
from cosim.slaves.slave import CInterface, References

Update = tuple[bool, bool, float | None]


class FMU1UnmovedModel(Unmoved1, fmi1.FMU1Model):
    """fmpy's model of FMI 1.0, as `Integration` wants one: an event needs no mode, initialization is the first one."""

    needed = ("fmi1InstantiateModel", "fmi1FreeModelInstance", "fmi1SetTime", "fmi1Initialize", "fmi1EventUpdate")
    instantiating = "fmiInstantiateModel"
    _first: Any = None

    def initialize_at(self, t: float, tolerance: float) -> None:
        """FmiSetTime and fmiInitialize, whose event counts as the first one."""
        self.setTime(t)
        self._first = self.initialize(fmi1.fmi1True, tolerance)

    def derivatives(self, values: Any, count: int) -> None:
        """FmiGetDerivatives."""
        self.getDerivatives(values, count)

    def nominals(self, values: Any, count: int) -> None:
        """FmiGetNominalContinuousStates."""
        self.getNominalContinuousStates(values, count)

    def completed(self) -> tuple[bool, bool]:
        """FmiCompletedIntegratorStep, where there is one."""
        return "fmi1CompletedIntegratorStep" not in self.lacking and self.completedIntegratorStep(), False

    def enter_events(self) -> None:
        """Do nothing: there is no such mode."""

    def update(self) -> Update:
        """FmiEventUpdate, after fmiInitialize what that has said."""
        (settled, _, _, ends, named, time), self._first = self._first or self.eventUpdate(), None
        return not settled, ends, time if named else None

    def leave_events(self) -> None:
        """Do nothing, likewise."""


class _Calls:
    """What fmpy calls alike in FMI 2.0 and 3.0."""

    completing = ""
    """Name of the function that ends an integrator's step, which an FMU may lack."""

    def nominals(self: Any, values: Any, count: int) -> None:
        """Get the nominal values of the continuous states."""
        self.getNominalsOfContinuousStates(values, count)

    def completed(self: Any) -> tuple[bool, bool]:
        """fmiXCompletedIntegratorStep, where there is one."""
        return (False, False) if self.completing in self.lacking else self.completedIntegratorStep()

    def enter_events(self: Any) -> None:
        """Enter event mode."""
        self.enterEventMode()

    def leave_events(self: Any) -> None:
        """Enter continuous-time mode."""
        self.enterContinuousTimeMode()


class FMU2UnmovedModel(_Calls, Unmoved2, fmi2.FMU2Model):
    """fmpy's model of FMI 2.0, as `Integration` wants one."""

    kind = fmi2.fmi2ModelExchange
    completing = "fmi2CompletedIntegratorStep"
    needed = (*COMMON, "fmi2SetTime", "fmi2NewDiscreteStates", "fmi2EnterContinuousTimeMode", "fmi2EnterEventMode")

    def derivatives(self, values: Any, count: int) -> None:
        """fmi2GetDerivatives."""
        self.getDerivatives(values, count)

    def update(self) -> Update:
        """fmi2NewDiscreteStates."""
        again, ends, _, _, named, time = self.newDiscreteStates()
        return again, ends, time if named else None


class FMU3UnmovedModel(_Calls, Unmoved, fmi3.FMU3Model):
    """fmpy's model of FMI 3.0, likewise."""

    completing = "fmi3CompletedIntegratorStep"
    needed = ("fmi3InstantiateModelExchange", *COMMON3, "fmi3SetTime", "fmi3UpdateDiscreteStates")

    def make(self, environment: int) -> None:
        """fmi3InstantiateModelExchange; log messages come under the key `environment`."""
        name, resources = str(self.instanceName), os.path.join(self.unzipDirectory, "resources", "")
        key = ctypes.c_void_p(environment)
        self.component = self.fmi3InstantiateModelExchange(
            name.encode(), self.guid.encode(), resources.encode(), False, True, key, SHELF.logger3
        )
        if not self.component:
            raise RuntimeError("no instance")

    def derivatives(self, values: Any, count: int) -> None:
        """fmi3GetContinuousStateDerivatives."""
        self.getContinuousStateDerivatives(values, count)

    def update(self) -> Update:
        """fmi3UpdateDiscreteStates."""
        again, ends, _, _, named, time = self.updateDiscreteStates()
        return again, ends, time if named else None


_Base: Any = object  # the slave that it is mixed into has the rest


class Integrated(_Base):
    """Mixed into the slave of a version of FMI, whose co-simulation it replaces."""

    _integration: Integration | None = None
    _solving: tuple[float, float] = (0.0, TOLERANCE)
    _given: dict[tuple[str, References], Any]

    def setup_experiment(self, t: float, tolerance: float | None = None, stop: float | None = None) -> None:
        """Note the start time and the solver's tolerance."""
        super().setup_experiment(t, tolerance, stop)
        self._solving = t, tolerance or TOLERANCE
        self._integration, self._given = None, {}

    def exit_initialization_mode(self) -> None:
        """Exit initialization mode, update discrete states, enter continuous time."""
        super().exit_initialization_mode()
        t, tolerance = self._solving
        sizes = self.description.states, self.description.event_indicators
        self._integration = self._told(lambda: Integration(self._fmu, *sizes, tolerance, t), t)

    def set_real(self, references: References, values: FloatArray) -> None:
        """Set Reals, where they are others than before."""
        if self._changes("Real", references, tuple(np.asarray(values).tolist())):
            super().set_real(references, values)

    def set_integer(self, references: References, values: Sequence[int]) -> None:
        """Set Integers, likewise."""
        if self._changes("Integer", references, tuple(values)):
            super().set_integer(references, values)

    def set_boolean(self, references: References, values: Sequence[bool]) -> None:
        """Set Booleans, likewise."""
        if self._changes("Boolean", references, tuple(values)):
            super().set_boolean(references, values)

    def set_string(self, references: References, values: Sequence[bytes]) -> None:
        """Set Strings, likewise."""
        if self._changes("String", references, tuple(values)):
            super().set_string(references, values)

    def _changes(self, kind: str, references: References, values: Any) -> bool:
        """Whether something is to be set; then, once the model runs, it is prepared for that."""
        if self._integration is None:
            return True
        if self._given.get((kind, references)) == values:
            return False
        self._given[kind, references] = values
        discrete = kind != "Real" or not self._continuous.issuperset(references)
        self._told(lambda: self._integration and self._integration.change(discrete=discrete), self._solving[0])
        return True

    @property
    def _continuous(self) -> frozenset[int]:
        variables = self.description.variables.values()
        return frozenset(v.value_reference for v in variables if v.type == "Real" and v.variability == "continuous")

    def do_step(self, t: float, h: float) -> None:
        """Integrate from t to t + h."""
        assert self._integration is not None, "it has left initialization mode"
        integration = self._integration
        self._told(lambda: integration.advance(t, h), t)

    def _told(self, do: Callable[[], Any], t: float) -> Any:
        """Return what a piece of the model's way returns; raises `CallFailed`, in the words of co-simulation."""
        try:
            return do()
        except FMICallException as error:
            raise self._failure(error) from None
        except Ended as end:
            failure = self._refused(f"{self.prefix}DoStep", f"{self.prefix}OK")
            failure.last_successful_time, failure.terminated = end.time, True
            raise failure from None
        except Stuck as stuck:
            raise self._refused(f"{self.prefix}DoStep", status_name(ERROR, self.prefix), [str(stuck)]) from None

    def c_interface(self) -> CInterface | None:
        """Return None: the integrator is in Python."""
        return None

    def get_state(self) -> Any:
        """Refused: the integrator's state is not saved."""
        return Instance.get_state(self)


class ModelExchange1(Integrated, Fmi1Slave):
    """An instance of an FMI 1.0 FMU for model exchange; see `Instance`. It cannot be reset."""

    def __init__(self, name: str, path: Path) -> None:
        super().__init__(name, path, FMU1UnmovedModel)

    def _initialize(self) -> None:
        if not self._initialized:
            self._call(self._fmu.initialize_at, *self._solving)
            self._initialized = True

    def terminate(self) -> None:
        """fmiTerminate, where FMI still allows it."""
        if self._alive:
            self._call(self._fmu.fmi1Terminate, self._fmu.component)

    def reset(self) -> bool:
        """Return False: FMI 1.0 has no function for it."""
        self.messages.clear()
        self.warned.clear()
        return False

    def free(self) -> None:
        """fmiFreeModelInstance, once."""
        self._freed(self._fmu.fmi1FreeModelInstance)


class ModelExchange2(Integrated, FmuSlave):
    """An instance of an FMI 2.0 FMU for model exchange; see `Instance`."""

    def __init__(self, name: str, path: Path) -> None:
        super().__init__(name, path, FMU2UnmovedModel)


class ModelExchange3(Integrated, Fmi3Slave):
    """An instance of an FMI 3.0 FMU for model exchange; see `Instance`."""

    def __init__(self, name: str, path: Path) -> None:
        super().__init__(name, path, FMU3UnmovedModel)
