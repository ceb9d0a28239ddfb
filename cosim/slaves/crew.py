"""Instances of a system's FMUs that fly together, and a store of them that threads share."""

import threading
import weakref
from collections.abc import Callable, Mapping

from cosim.errors import CallFailed
from cosim.slaves.slave import Slave

Crew = Mapping[str, Slave]
"""Slaves by instance name."""


class Crews:
    """Crews that wait for their next flight: as many as flew at once."""

    def __init__(self, make: Callable[[], Crew]) -> None:
        self._make = make
        self._lock = threading.Lock()
        self._idle: list[tuple[Crew, bool]] = []
        weakref.finalize(self, _free_all, self._idle)

    def take(self) -> Crew:
        """Return a crew whose slaves are as new: one that waits, else a new one; raises `FmuError`."""
        with self._lock:
            crew, flown = self._idle.pop() if self._idle else (None, False)
        if crew is None:
            return self._make()
        for slave in crew.values() if flown else ():
            if not slave.reset():
                slave.free()  # the next `instantiate` makes a new one
        return crew

    def give_back(self, crew: Crew, *, flown: bool = True) -> None:
        """Take a crew back after its flight, or one that has not `flown`."""
        with self._lock:
            self._idle.append((crew, flown))

    def close(self) -> None:
        """Free all crews that wait."""
        with self._lock:
            _free_all(self._idle)


def end(crew: Crew, failed: str | None) -> dict[str, CallFailed]:
    """Terminate all slaves but the one that `failed`, as FMI wants it; return those that would not, and how."""
    refused: dict[str, CallFailed] = {}
    for name, slave in crew.items():
        if name != failed:
            said = len(slave.messages)
            try:
                slave.terminate()
            except CallFailed as error:
                error.messages = error.messages[said:]  # what was said before is told elsewhere
                refused[name] = error
    return refused


def _free_all(crews: list[tuple[Crew, bool]]) -> None:
    while crews:
        for slave in crews.pop()[0].values():
            slave.free()
