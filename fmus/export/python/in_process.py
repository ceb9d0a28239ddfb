"""A slave without an FMU: the Python runtime behind the functions that a master calls. For fast tests of masters.

It is no FMU, so a master must be told the exception that stands for a failed call.
"""

import json
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from components.framework import Component
from fmus.description.description import ModelDescription
from fmus.export.describe import describe
from fmus.export.python.failure import RuntimeFailure
from fmus.export.python.runtime import Runtime


def describe_in_process(component: Component) -> ModelDescription:
    """Return what an FMU with the capabilities of this slave would say."""
    order = 0 if component.sampled or component.python_only else 1
    return describe(
        component,
        component.name,
        derivatives=False,
        can_interpolate_inputs=True,
        max_input_derivative_order=3,
        max_output_derivative_order=order,
    )


class InProcessSlave:
    """One instance of a component in this process.

    failed(instance, function, status, messages) returns the exception that the master expects where an FMU would have
    returned an error.
    """

    def __init__(self, name: str, component: Component, failed: Callable[..., Exception]):
        self.name, self.description, self.messages = name, describe_in_process(component), list[str]()
        self.warned: dict[str, tuple[int, float]] = {}
        self._component, self._failed = component, failed
        self._runtime = Runtime(component)

    def _call(self, function: str, call: Callable[..., Any], *arguments: Any) -> Any:
        try:
            return call(*arguments)
        except RuntimeFailure as error:
            self.messages.append(str(error))
            raise self._failed(self.name, function, "fmi2Error", tuple(self.messages)) from error

    def instantiate(self) -> None:
        """Start afresh."""
        self._runtime = Runtime(self._component)
        self._runtime.warn = self.messages.append

    def setup_experiment(self, t: float, tolerance: float | None = None, stop: float | None = None) -> None:
        """Announce the start time."""
        self._call("fmi2SetupExperiment", self._runtime.setup, t)

    def enter_initialization_mode(self) -> None:
        """From now on variables follow every set."""
        self._call("fmi2EnterInitializationMode", self._runtime.enter_initialization)

    def exit_initialization_mode(self) -> None:
        """Check the component's conditions and freeze what was calculated."""
        self._call("fmi2ExitInitializationMode", self._runtime.exit_initialization)

    def get_real(self, references: Sequence[int]) -> np.ndarray:
        """Return values, shape (n,)."""
        return np.array(self._call("fmi2GetReal", self._runtime.get, list(references)))

    def set_real(self, references: Sequence[int], values: np.ndarray) -> None:
        """Set values, shape (n,)."""
        self._call("fmi2SetReal", self._runtime.set, list(references), values.tolist())

    def _no_other_type(self, references: Sequence[int], *_values: Any) -> list[Any]:
        """Get or set nothing: all variables are Real."""
        return []

    get_integer = set_integer = get_boolean = set_boolean = get_string = set_string = _no_other_type

    def set_input_derivatives(self, references: Sequence[int], orders: Sequence[int], values: np.ndarray) -> None:
        """Set derivatives of inputs for the next step."""
        call = self._runtime.set_input_derivatives
        self._call("fmi2SetRealInputDerivatives", call, references, orders, values.tolist())

    def get_output_derivatives(self, references: Sequence[int], orders: Sequence[int]) -> np.ndarray:
        """Return derivatives of outputs, of order 1, shape (n,)."""
        call = self._runtime.get_output_derivatives
        return self._call("fmi2GetRealOutputDerivatives", call, list(references), list(orders))

    def do_step(self, t: float, h: float) -> None:
        """Step from t to t + h."""
        self._call("fmi2DoStep", self._runtime.do_step, t, h)

    def get_state(self) -> Any:
        """Return the whole state."""
        return self._runtime.save()

    def set_state(self, state: Any) -> None:
        """Take a state back."""
        self._runtime.restore(state)

    def free_state(self, state: Any) -> None:
        """Nothing to free."""

    def serialize_state(self, state: Any) -> bytes:
        """Return a state as bytes."""
        return json.dumps(state).encode()

    def deserialize_state(self, data: bytes) -> Any:
        """Return the state of bytes."""
        return json.loads(data)

    def directional_derivative(self, unknowns: Sequence[int], knowns: Sequence[int], seed: np.ndarray) -> np.ndarray:
        """Not offered: providesDirectionalDerivative is false."""
        raise self._failed(self.name, "fmi2GetDirectionalDerivative", "fmi2Error", ("no directional derivatives.",))

    def terminate(self) -> None:
        """End the run."""
        self._call("fmi2Terminate", self._runtime.terminate)

    def reset(self) -> bool:
        """Start afresh."""
        self.instantiate()
        return True

    def c_interface(self) -> None:
        """There is none: this is no slave of C."""

    def free(self) -> None:
        """Drop the CasADi objects."""
        self._runtime.release()
