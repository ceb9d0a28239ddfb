"""What a master calls: an instance of a component behind the functions of FMI 2.0 for co-simulation."""

from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from fmus.description.description import ModelDescription, Scalar, ScalarVariable

FloatArray = NDArray[np.float64]
References = tuple[int, ...]


class Slave(Protocol):
    """What a master calls, in the order of FMI 2.0; every call may raise `CallFailed`.

    Arrays have shape (n,) for n value references. `t` and `h` in s.
    """

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

    def instantiate(self) -> None:
        """Make the instance."""
        ...

    def set(self, variable: ScalarVariable, value: Scalar) -> None:
        """Set one variable of any type: parameters and start values before initialization, held inputs in it."""
        ...

    def setup_experiment(self, t: float) -> None:
        """Announce the start time; no stop time is defined."""
        ...

    def enter_initialization_mode(self) -> None:
        """Call fmi2EnterInitializationMode."""
        ...

    def exit_initialization_mode(self) -> None:
        """Call fmi2ExitInitializationMode."""
        ...

    def get_real(self, references: References) -> FloatArray:
        """Return values; the array is the caller's."""
        ...

    def set_real(self, references: References, values: FloatArray) -> None:
        """Call fmi2SetReal."""
        ...

    def set_input_derivatives(self, references: References, orders: References, values: FloatArray) -> None:
        """Set the derivatives of inputs for the next step, orders from 1."""
        ...

    def get_output_derivatives(self, references: References, orders: References) -> FloatArray:
        """Return derivatives of outputs, orders from 1."""
        ...

    def do_step(self, t: float, h: float) -> None:
        """Step from t to t + h."""
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

    def free(self) -> None:
        """Free the instance; may be called at any time, more than once."""
        ...
