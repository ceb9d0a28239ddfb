"""A step that goes on after fmi2DoStep has returned fmi2Pending; masters/kernel/pending.h is the same in C."""

import ctypes
import time
from collections.abc import Callable
from dataclasses import dataclass, field

from cosim.errors import TimeError

POLL = 2e-4
"""Seconds between two questions whether the step is done."""

NO_ANSWER, TIME_IS_UP, STOP_IS_ASKED = 1, 2, 3
"""Why a step stays pending; the kernel knows the same numbers."""

DEFAULT = 60.0
"""Seconds that a step may take after fmi2DoStep has returned, unless the experiment says otherwise."""


@dataclass(frozen=True)
class Patience:
    """How long a step may stay pending and any call of an isolated FMU take, s; a flag that is not 0 ends the wait."""

    timeout: float = DEFAULT
    call: float = DEFAULT
    stop: ctypes.c_int = field(default_factory=ctypes.c_int)

    def __post_init__(self) -> None:
        """Raise `TimeError` for a time that is none."""
        for name, value in (("pending_timeout", self.timeout), ("isolation_timeout", self.call)):
            if not 0 < value < float("inf"):
                raise TimeError(name, value, "it must be above 0 and finite", "60")

    def wait(self, status: Callable[[], int | None], pending: int) -> tuple[int, int]:
        """Ask for the status of a step until it is not `pending`; return it, and why it stays so, 0 where it does not.

        `status` returns None where the FMU does not answer.
        """
        begun = time.perf_counter()
        while True:
            found = status()
            if found is None:
                return pending, NO_ANSWER
            if found != pending:
                return found, 0
            if self.stop.value:
                return pending, STOP_IS_ASKED
            if time.perf_counter() - begun >= self.timeout:
                return pending, TIME_IS_UP
            time.sleep(POLL)
