"""FMI 3.0 co-simulation FMUs as slaves, through fmpy.

Event mode is off and a step may not end early: the FMU handles its events within fmi3DoStep, as in FMI 2.0. An FMU that
returns early all the same has failed; one that asks for the end of the run at the end of a step has taken that step.

Limits: FMI 3.0 has no derivatives of inputs: inputs are held. Intermediate updates are not asked for. A whole number
beyond 2^53, which is no double, is refused where it would have to be exchanged or recorded; parameters may be any.
"""

import ctypes
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from fmpy import fmi3
from fmpy.fmi1 import FMICallException

from cosim.arrays import FloatArray
from cosim.errors import CallFailed, status_name
from cosim.slaves.binary import DISCARD, Unmoved
from cosim.slaves.elements import DTYPES, Call, Elements
from cosim.slaves.fmi3_kernel import ForKernel, obstacle
from cosim.slaves.instance import Instance
from cosim.slaves.shelf import SHELF
from cosim.slaves.slave import CInterface, References, Refusal
from cosim.system.parameters import EXACT

COMMON = ("fmi3FreeInstance", "fmi3EnterInitializationMode", "fmi3ExitInitializationMode")
"""Functions without which nothing flies."""

EARLY = "fmi3OK, but early, which was not allowed"


class FMU3Unmoved(Unmoved, fmi3.FMU3Slave):
    """fmpy's slave; fmpy tells the version of FMI by the class's name."""

    needed = ("fmi3InstantiateCoSimulation", *COMMON, "fmi3DoStep")

    def make(self, environment: int) -> None:
        """fmi3InstantiateCoSimulation; log messages come under the key `environment`."""
        none = (fmi3.fmi3ValueReference * 0)()
        resources = os.path.join(self.unzipDirectory, "resources", "")
        self._no_update: Any = fmi3.fmi3IntermediateUpdateCallback()
        self.component = self.fmi3InstantiateCoSimulation(
            str(self.instanceName).encode(),
            self.guid.encode(),
            resources.encode(),
            visible=False,
            loggingOn=True,
            eventModeUsed=False,
            earlyReturnAllowed=False,
            requiredIntermediateVariables=none,
            nRequiredIntermediateVariables=0,
            instanceEnvironment=ctypes.c_void_p(environment),
            logMessage=SHELF.logger3,
            intermediateUpdate=self._no_update,
        )
        if not self.component:
            raise RuntimeError("no instance")


class Fmi3Slave(Instance):
    """An instance of an FMI 3.0 FMU; see `Instance`."""

    prefix = "fmi3"

    def __init__(self, name: str, path: Path, made: type[Unmoved] = FMU3Unmoved) -> None:
        super().__init__(name, path, made)
        self._elements = Elements(self.description)
        self._experiment: tuple[float, float | None, float | None] = (0.0, None, None)
        self._ended: float | None = None
        self._for_kernel: ForKernel | None = None

    def instantiate(self) -> None:
        """fmi3InstantiateCoSimulation; nothing where there is an instance that was reset."""
        self._instantiated("fmi3InstantiateCoSimulation", lambda: self._fmu.make(self._key))

    def setup_experiment(self, t: float, tolerance: float | None = None, stop: float | None = None) -> None:
        """Note what fmi3EnterInitializationMode is to be told."""
        self._experiment = t, tolerance, stop

    def enter_initialization_mode(self) -> None:
        """fmi3EnterInitializationMode."""
        t, tolerance, stop = self._experiment
        self._call(self._fmu.enterInitializationMode, tolerance, t, stop)

    def exit_initialization_mode(self) -> None:
        """fmi3ExitInitializationMode."""
        self._call(self._fmu.exitInitializationMode)

    def get_real(self, references: References) -> FloatArray:
        """fmi3GetFloat64 and fmi3GetFloat32."""
        return np.array(self._get(references), dtype=np.float64)

    def set_real(self, references: References, values: FloatArray) -> None:
        """fmi3SetFloat64 and fmi3SetFloat32."""
        self._set(references, np.asarray(values))

    def get_integer(self, references: References) -> Sequence[int]:
        """fmi3GetInt8 to fmi3GetUInt64; raises `CallFailed` for what is no double."""
        values = [int(value) for value in self._get(references)]
        for reference, value in zip(references, values, strict=True):
            if abs(value) > EXACT:
                line = f"{self._elements.name(reference)} is {value}: beyond 2^53 whole numbers are not carried exactly"
                raise self._refused("fmi3GetInt64", "fmi3OK", [line])
        return values

    def set_integer(self, references: References, values: Sequence[int]) -> None:
        """fmi3SetInt8 to fmi3SetUInt64; raises `CallFailed` for what a type cannot hold."""
        given = np.array(values, dtype=np.object_)
        for call in self._elements.calls(references):
            i = self._elements.beyond(call, given[call.places])
            if i is not None:
                place = int(call.places[i])
                line = self._cannot_be(references[place], values[place])
                raise self._refused(f"fmi3Set{call.function}", "no call", [line])
        self._set(references, given)

    def _cannot_be(self, reference: int, value: int) -> str:
        name = self._elements.name(reference)
        element = self.description.variables[name].element
        return f"{name} is {element.type if element is not None else ''}, which cannot be {value}"

    def get_boolean(self, references: References) -> Sequence[bool]:
        """fmi3GetBoolean."""
        return [bool(value) for value in self._get(references)]

    def set_boolean(self, references: References, values: Sequence[bool]) -> None:
        """fmi3SetBoolean."""
        self._set(references, np.array(values, dtype=np.bool_))

    def get_string(self, references: References) -> Sequence[bytes]:
        """fmi3GetString; no text at all is the empty one."""
        return [value or b"" for value in self._get(references)]

    def set_string(self, references: References, values: Sequence[bytes]) -> None:
        """fmi3SetString."""
        self._set(references, np.array(values, dtype=np.object_))

    def get_output_derivatives(self, references: References, orders: References) -> FloatArray:
        """fmi3GetOutputDerivatives, order by order, for it takes whole arrays."""
        found = np.zeros(len(references))
        for order in sorted(set(orders)):
            places = [i for i, o in enumerate(orders) if o == order]
            for call in self._elements.calls(tuple(references[i] for i in places)):
                n, values = len(call.references), np.zeros(call.size)
                given = (ctypes.c_int32 * n)(*[order] * n)
                into = values.ctypes.data_as(ctypes.POINTER(ctypes.c_double))
                arguments = self._fmu.component, call.references, n, given, into, call.size
                self._call(self._fmu.fmi3GetOutputDerivatives, *arguments)
                found[np.array(places)[call.places]] = values[call.indices]
        return found

    def do_step(self, t: float, h: float) -> None:
        """fmi3DoStep."""
        if self._ended is not None:
            raise self._stopped("fmi3OK", self._ended, terminated=True)
        event, terminate, early = ctypes.c_bool(), ctypes.c_bool(), ctypes.c_bool()
        last = ctypes.c_double(t + h)
        told = [ctypes.byref(flag) for flag in (event, terminate, early, last)]
        self._call(self._fmu.fmi3DoStep, self._fmu.component, t, h, True, *told)
        complete = not early.value and last.value >= t + h - 1e-12 * max(abs(t), h)
        if terminate.value and complete:
            self._ended = last.value  # the step counts; there is no other
        elif terminate.value or early.value:
            status = "fmi3OK" if terminate.value else EARLY
            raise self._stopped(status, last.value, terminated=terminate.value)

    def _stopped(self, status: str, last: float, *, terminated: bool) -> Exception:
        failure = self._refused("fmi3DoStep", status)
        failure.last_successful_time, failure.terminated = last, terminated
        return failure

    def get_state(self) -> Any:
        """fmi3GetFMUState, with whether the run is to end."""
        return self._call(self._fmu.getFMUState), self._ended

    def set_state(self, state: Any) -> None:
        """fmi3SetFMUState."""
        self._call(self._fmu.setFMUState, state[0])
        self._ended = state[1]

    def free_state(self, state: Any) -> None:
        """fmi3FreeFMUState."""
        self._call(self._fmu.freeFMUState, state[0])

    def serialize_state(self, state: Any) -> bytes:
        """fmi3SerializeFMUState."""
        return self._call(self._fmu.serializeFMUState, state[0])

    def deserialize_state(self, data: bytes) -> Any:
        """fmi3DeserializeFMUState."""
        return self._call(self._fmu.deserializeFMUState, data), None

    def directional_derivative(self, unknowns: References, knowns: References, seed: FloatArray) -> FloatArray:
        """fmi3GetDirectionalDerivative, of whole arrays; elements that are not asked for are still."""
        (of,), (by,) = self._elements.calls(unknowns), self._elements.calls(knowns)
        seeds = np.zeros(by.size)
        seeds[by.indices] = np.asarray(seed)[by.places]
        sizes = {"nSensitivity": of.size}
        found = self._call(
            lambda: self._fmu.getDirectionalDerivative(list(of.references), list(by.references), seeds, **sizes)
        )
        result = np.zeros(len(unknowns))
        result[of.places] = np.array(found)[of.indices]
        return result

    def terminate(self) -> None:
        """fmi3Terminate, where FMI still allows it."""
        if self._alive:
            self._call(self._fmu.terminate)

    def reset(self) -> bool:
        """fmi3Reset; False where there is no instance, or it cannot be reset."""
        self._elements.forget()
        self._ended = None
        return self._reset(self._fmu.reset)

    def free(self) -> None:
        """fmi3FreeInstance, once."""
        self._elements.forget()
        self._ended = None
        self._freed(self._fmu.fmi3FreeInstance)

    def c_interface(self) -> CInterface | None:
        """Return the instance for a caller in C, None where it exchanges what the kernel cannot carry."""
        if not self._alive or obstacle(self.description):
            return None
        if self._for_kernel is None:
            self._for_kernel = ForKernel(self.description, self._elements, self._fmu.addresses)
        return CInterface(self._for_kernel.of(self._fmu.component), {}, "3.0")

    def _failure(self, error: FMICallException) -> CallFailed:
        if self._for_kernel is not None:
            self._for_kernel.told.function = None  # that the kernel called before: this call is another
        return super()._failure(error)

    def failed(self, status: int) -> Refusal:
        """Note a call that failed; of one that the kernel made, return what the FMU says of it."""
        super().failed(status)
        told = None if self._for_kernel is None else self._for_kernel.told
        if told is None or not told.function:
            return Refusal()
        function, told.function = told.function.decode(), None
        if status == DISCARD and (told.terminated or told.early):
            ends = bool(told.terminated)
            return Refusal(told.last, ends, "fmi3DoStep", "fmi3OK" if ends else EARLY)
        if told.refused >= 0:
            line = self._cannot_be(told.refused, told.refused_value)
            return Refusal(None, False, function, "no call", line)
        return Refusal(None, False, function, status_name(status, self.prefix))

    def _get(self, references: References) -> Any:
        found: Any = np.zeros(len(references), dtype=np.object_)
        for call in self._elements.calls(references):
            values, pointer = _buffer(call)
            self._transfer("Get", call, pointer)
            found[call.places] = np.array(list(values), dtype=DTYPES[call.type])[call.indices]
        return found

    def _set(self, references: References, given: Any) -> None:
        structural = [self._elements.is_structural(r) for r in references]
        if any(structural):
            self._set_structural(references, given, structural)
            return
        for call in self._elements.calls(references):
            values, pointer = _buffer(call)
            values[:] = self._elements.with_values(call, given[call.places])
            self._transfer("Set", call, pointer)

    def _set_structural(self, references: References, given: Any, structural: Sequence[bool]) -> None:
        """Set structural parameters in configuration mode, and the others after it."""
        for wanted in (True, False):
            places = [i for i, is_one in enumerate(structural) if is_one == wanted]
            if wanted:
                self._call(self._fmu.enterConfigurationMode)
            for call in self._elements.calls(tuple(references[i] for i in places)):
                values, pointer = _buffer(call)
                values[:] = self._elements.with_values(call, given[places][call.places])
                self._transfer("Set", call, pointer)
            if wanted:
                self._call(self._fmu.exitConfigurationMode)

    def _transfer(self, verb: str, call: Call, pointer: Any) -> None:
        function = getattr(self._fmu, f"fmi3{verb}{call.function}")
        self._call(function, self._fmu.component, call.references, len(call.references), pointer, call.size)


def _buffer(call: Call) -> tuple[Any, Any]:
    """Return an array for a call's values, and what fmpy's function takes of it."""
    if call.type == "String":
        texts = (ctypes.c_char_p * call.size)()
        return texts, texts
    values: Any = np.zeros(call.size, dtype=DTYPES[call.type])
    return values, np.ctypeslib.as_ctypes(values)
