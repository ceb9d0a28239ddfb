"""An instance of an FMU file, whatever its version of FMI: its log, its calls, and how they fail.

What a version does not have (derivatives of inputs, states that are saved) fails by name, as if the FMU had refused it.
"""

from collections import deque
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from fmpy.fmi1 import FMICallException

from cosim.arrays import FloatArray
from cosim.errors import CallFailed, FmuError, status_name
from cosim.slaves.binary import ERROR, FATAL, Unmoved
from cosim.slaves.pending import Patience
from cosim.slaves.shelf import SHELF
from cosim.slaves.slave import CInterface, References, Refusal
from fmus.description.description import ModelDescription

LOG_LINES = 200
"""How many of its last log messages a slave keeps."""


class Instance:
    """An instance of an FMU file. `messages` are its last log messages, oldest first; `warned` see `Slave`.

    `made` is one of fmpy's classes with `Unmoved` mixed in. Raises `FmuError` if the file cannot be used on this
    machine, later `CallFailed` for every status above warning.
    """

    prefix = "fmi2"

    def __init__(self, name: str, path: Path, made: type[Unmoved]) -> None:
        self.name = name
        self.path = path
        self.description: ModelDescription = SHELF.description(path)
        self.messages: deque[str] = deque(maxlen=LOG_LINES)
        folder = SHELF.extracted(path, own_copy=self.description.only_once_per_process)
        self._fmu: Any = made.__new__(made)
        try:
            self._fmu.open(self.description, folder, name, self.messages.append)
        except Exception as error:  # whatever a file that is no library, or lacks functions, leads to
            raise FmuError(path, f"its binary cannot be loaded: {error}") from error
        if self.description.only_once_per_process:
            SHELF.lend(self, folder, self._fmu)
        self.warned = self._fmu.warned
        self.patience = Patience()
        self._key = SHELF.listen(self)
        self._alive = False

    def _instantiated(self, function: str, make: Callable[[], None]) -> None:
        """Make the instance, where there is none that was reset."""
        if self._alive:
            return
        try:
            make()
        except Exception as error:
            said = [str(error)] if isinstance(error, ValueError) else []
            raise CallFailed(self.name, function, "no instance", (*self.messages, *said)) from error
        self._alive = True

    def set_input_derivatives(self, references: References, orders: References, values: FloatArray) -> None:
        """Refused: this version has no such function."""
        raise self._unknown("SetInputDerivatives")

    def get_output_derivatives(self, references: References, orders: References) -> FloatArray:
        """Refused, likewise."""
        raise self._unknown("GetOutputDerivatives")

    def get_state(self) -> Any:
        """Refused, likewise."""
        raise self._unknown("GetFMUState")

    def set_state(self, state: Any) -> None:
        """Refused, likewise."""
        raise self._unknown("SetFMUState")

    def free_state(self, state: Any) -> None:
        """Refused, likewise."""
        raise self._unknown("FreeFMUState")

    def serialize_state(self, state: Any) -> bytes:
        """Refused, likewise."""
        raise self._unknown("SerializeFMUState")

    def deserialize_state(self, data: bytes) -> Any:
        """Refused, likewise."""
        raise self._unknown("DeserializeFMUState")

    def directional_derivative(self, unknowns: References, knowns: References, seed: FloatArray) -> FloatArray:
        """Refused, likewise."""
        raise self._unknown("GetDirectionalDerivative")

    def _reset(self, function: Callable[[], Any]) -> bool:
        """Reset the instance; False where there is none, or it cannot be reset: `free` it, and make a new one."""
        self.messages.clear()
        self.warned.clear()
        if not self._alive:
            return False
        try:
            self._call(function)
        except CallFailed:
            return False
        return True

    def _freed(self, function: Callable[[Any], Any]) -> None:
        """Free the instance, once. The library stays loaded: unloading pythonfmu's can end the process."""
        if self._alive:
            self._alive = False
            function(self._fmu.component)
        self._fmu.component = None  # what a copy that is lent is given back by

    def c_interface(self) -> CInterface | None:
        """Return None: the kernel calls the functions of FMI 2.0 alone."""
        return None

    def failed(self, status: int) -> Refusal:
        """Note a call that failed; return what the FMU says of it."""
        if status == FATAL:
            self._alive = False  # FMI: no further call, not even that which frees it
        return Refusal()

    @staticmethod
    def _asked(function: Callable[..., Any], *arguments: Any) -> Any:
        try:
            return function(*arguments)
        except FMICallException:
            return None

    def _call(self, function: Callable[..., Any], *arguments: Any) -> Any:
        try:
            return function(*arguments)
        except FMICallException as error:
            raise self._failure(error) from None

    def _failure(self, error: FMICallException) -> CallFailed:
        said = self.failed(error.status)
        status, messages = status_name(error.status, self.prefix), tuple(self.messages)
        return CallFailed(
            self.name, error.function, status, messages, said.last_successful_time, terminated=said.terminated
        )

    def _refused(self, function: str, status: str, lines: Sequence[str] = ()) -> CallFailed:
        """Return a call that failed without a call of the FMU's."""
        return CallFailed(self.name, function, status, (*self.messages, *lines))

    def _unknown(self, function: str) -> CallFailed:
        line = f"FMI {self.description.fmi_version} has no function for it"
        return self._refused(f"{self.prefix}{function}", status_name(ERROR, self.prefix), [line])
