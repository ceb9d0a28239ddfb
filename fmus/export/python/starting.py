"""How an instance starts, and inputs that are waited for: the twin of fmi2.c's rules.

A condition that an input breaks is warned of at the end of initialization and refused by the first step: till then a
host may give better inputs. Start values stand for all inputs meanwhile, while those given are refused; the step begins
as if its inputs had been there in initialization mode.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from fmus.description.annotations import INPUTS_REFUSED
from fmus.export.python.conditions import OF_INPUTS, Broken, broken
from fmus.export.python.failure import RuntimeFailure
from fmus.export.python.modes import INITIALIZATION
from fmus.export.python.vector import Vector


class Starting(Vector):
    """Variables that begin from what is set, with conditions; a subclass evaluates them and steps."""

    def __init__(self, component: Any, name: str):
        super().__init__(component, name)
        self.component: Any = component
        self._t = np.zeros(1)
        self._u_start = self.u.copy()
        self.warn: Callable[[str], None] = lambda _text: None

    @property
    def t(self) -> float:
        """The time that the instance has reached, s."""
        return float(self._t[0])

    @property
    def starting(self) -> bool:
        """Whether initial values follow what is set: in initialization mode, or while inputs are waited for."""
        return self.mode == INITIALIZATION or self.given is not None

    def _begin(self) -> None:
        """Calculate states and step means from the values set; where there are any, a subclass does."""

    def _begin_waiting(self) -> None:
        """Begin with the inputs that were given, where they are refused with their start values."""
        self.u[:] = self.given
        self._begin()
        if any(kind == OF_INPUTS for kind, _ in self._broken()):
            self.u[:] = self._u_start
            self._begin()

    def _wait_for_inputs(self, refused: Broken) -> None:
        """Leave initialization although inputs are refused."""
        for _, text in refused:
            self.warn(f"{self.name}: {text}")
        self.given = self.u.copy()
        self._evaluate()
        self.warn(f"{self.name}: {INPUTS_REFUSED}.")

    def _take_inputs(self) -> None:
        """Begin with the inputs that were given, or refuse to step."""
        self.u[:] = self.given
        self._begin()
        self._stale = True
        self._refuse(OF_INPUTS)
        self.given = None

    def _broken(self) -> Broken:
        return broken(self.component, self.t, self)

    def _refuse(self, kinds: int) -> None:
        """Raise RuntimeFailure where a condition of these kinds does not hold."""
        texts = [text for kind, text in self._broken() if kind & kinds]
        if texts:
            raise RuntimeFailure(f"{self.name}: " + " ".join(texts))
