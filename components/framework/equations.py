"""What CasADi functions are made from: declared variables and equations. A component has more; they ask for this."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

from .variables import CalculatedParameter, Input, Output, Parameter, State, Variable


@dataclass(frozen=True)
class Condition:
    """A condition of `check`: violated unless margin > 0.

    text: the message, with one {} for each of `shown` (numbers to print, in the units that the text names).
    """

    margin: Any
    text: str
    shown: tuple[Any, ...] = ()


class Equations(Protocol):
    """Declarations and equations; `Component` says what they mean."""

    @property
    def name(self) -> str:
        """Name, for messages."""
        ...

    @property
    def sampled(self) -> bool:
        """Whether `update` takes the place of `derivatives`."""
        ...

    @property
    def parameters(self) -> Sequence[Parameter]:
        """Parameters p."""
        ...

    @property
    def calculated_parameters(self) -> Sequence[CalculatedParameter]:
        """Parameters that follow from p."""
        ...

    @property
    def inputs(self) -> Sequence[Input]:
        """Inputs u."""
        ...

    @property
    def states(self) -> Sequence[State]:
        """States x."""
        ...

    @property
    def outputs_declared(self) -> Sequence[Output]:
        """Outputs that are not states, those whose start is set first."""
        ...

    @property
    def exact_outputs(self) -> Sequence[Output]:
        """Outputs whose start is set."""
        ...

    def size(self, group: Iterable[Variable]) -> int:
        """Return how many scalars a group of variables has."""
        ...

    def derivatives(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        """Return the rate of each continuous state."""
        ...

    def update(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        """Return the next value of each sampled state."""
        ...

    def outputs(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        """Return the outputs that are not states."""
        ...

    def step_means(self, t: Any, x: Any, p: Any) -> dict[str, Any]:
        """Return the quantities whose rate a step mean averages."""
        ...

    def calculate(self, p: Any) -> dict[str, Any]:
        """Return the calculated parameters."""
        ...

    def initial(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        """Return the states that initialization calculates."""
        ...

    def project(self, x: Any, p: Any) -> dict[str, Any]:
        """Return the states that are put back onto their manifold after an internal step."""
        ...

    def check(self, t: Any, x: Any, u: Any, p: Any) -> list[Condition]:
        """Return the conditions that the start must meet."""
        ...
