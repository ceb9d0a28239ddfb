"""What a master calls: an instance of a component behind the functions of FMI 2.0 for co-simulation."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

from cosim.arrays import FloatArray
from cosim.slaves.pending import Patience
from fmus.description.description import ModelDescription

References = tuple[int, ...]

Warned = dict[str, tuple[int, float]]
"""FMI function -> how often it has returned fmi2Warning, and at which communication point first, s."""


def note_warnings(warned: Warned, function: str, count: int, time: float) -> None:
    """Count calls that returned fmi2Warning, the first of them at `time` s."""
    before, first = warned.get(function, (0, time))
    warned[function] = before + count, first


@dataclass(frozen=True)
class CInterface:
    """An instance for a caller in C: the address of the fmi2Component, and of each FMI function by its name.

    Of FMI `version` 3.0 it has no functions: `component` is a structure of slaves/fmi3_kernel.py then.
    """

    component: int
    functions: Mapping[str, int]
    version: str = "2.0"


@dataclass(frozen=True)
class Refusal:
    """What an FMU says of a call that failed: its last successful time, s, and whether the run is to end.

    `function`, `status`, `line`: where it is not the one of FMI 2.0 that the caller called; "" where it is.
    """

    last_successful_time: float | None = None
    terminated: bool = False
    function: str = ""
    status: str = ""
    line: str = ""


class Slave(Protocol):
    """What a master calls, in the order of FMI 2.0; every call may raise `CallFailed`.

    Arrays and sequences have a value for each value reference. `t` and `h` in s.
    """

    patience: Patience
    """How long a step may stay in fmi2Pending; a flight sets its own."""

    @property
    def name(self) -> str:
        """Instance name."""
        ...

    @property
    def description(self) -> ModelDescription:
        """What modelDescription.xml says."""
        ...

    @property
    def messages(self) -> Sequence[str]:
        """The last log messages, oldest first."""
        ...

    @property
    def warned(self) -> Warned:
        """Which calls have returned fmi2Warning since the instance was new; a caller in C notes its own."""
        ...

    def instantiate(self) -> None:
        """Make the instance."""
        ...

    def setup_experiment(self, t: float, tolerance: float | None = None, stop: float | None = None) -> None:
        """Announce the start time, a relative tolerance and a stop time, both where they are given."""
        ...

    def enter_initialization_mode(self) -> None:
        """Call fmi2EnterInitializationMode."""
        ...

    def exit_initialization_mode(self) -> None:
        """Call fmi2ExitInitializationMode."""
        ...

    def get_real(self, references: References) -> FloatArray:
        """Return Real values; the array is the caller's."""
        ...

    def set_real(self, references: References, values: FloatArray) -> None:
        """Set Real values."""
        ...

    def get_integer(self, references: References) -> Sequence[int]:
        """Return values of Integers and Enumerations."""
        ...

    def set_integer(self, references: References, values: Sequence[int]) -> None:
        """Set values of Integers and Enumerations."""
        ...

    def get_boolean(self, references: References) -> Sequence[bool]:
        """Return Boolean values."""
        ...

    def set_boolean(self, references: References, values: Sequence[bool]) -> None:
        """Set Boolean values."""
        ...

    def get_string(self, references: References) -> Sequence[bytes]:
        """Return Strings, in UTF-8."""
        ...

    def set_string(self, references: References, values: Sequence[bytes]) -> None:
        """Set Strings, in UTF-8."""
        ...

    def set_input_derivatives(self, references: References, orders: References, values: FloatArray) -> None:
        """Set the derivatives of Real inputs for the next step, orders from 1."""
        ...

    def get_output_derivatives(self, references: References, orders: References) -> FloatArray:
        """Return derivatives of Real outputs, orders from 1."""
        ...

    def do_step(self, t: float, h: float) -> None:
        """Step from t to t + h; a step that is pending is waited for, `KeyboardInterrupt` where the run is to stop."""
        ...

    def get_state(self) -> Any:
        """Return a copy of the FMU state, to be freed with `free_state`."""
        ...

    def set_state(self, state: Any) -> None:
        """Call fmi2SetFMUstate."""
        ...

    def free_state(self, state: Any) -> None:
        """Call fmi2FreeFMUstate."""
        ...

    def serialize_state(self, state: Any) -> bytes:
        """Call fmi2SerializeFMUstate."""
        ...

    def deserialize_state(self, data: bytes) -> Any:
        """Call fmi2DeSerializeFMUstate."""
        ...

    def directional_derivative(self, unknowns: References, knowns: References, seed: FloatArray) -> FloatArray:
        """Return (d unknowns / d knowns) @ seed, shape (len(unknowns),)."""
        ...

    def terminate(self) -> None:
        """Call fmi2Terminate."""
        ...

    def reset(self) -> bool:
        """Bring the instance back to where `instantiate` left it; False where it cannot be, and a new one is needed."""
        ...

    def free(self) -> None:
        """Free the instance; may be called at any time, more than once."""
        ...

    def c_interface(self) -> CInterface | None:
        """Return the instance for a caller in C, None for a slave that is not one of C; it holds until `free`."""
        ...

    def failed(self, status: int) -> Refusal:
        """Note a call that a caller in C made and that failed; return what the FMU says of it."""
        ...
