"""A name that nothing has, a file that is no FMU; and the base of every error between an FMU file and a last row."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fmus.description.names import did_you_mean


class SimulationError(Exception):
    """Base of every error of `cosim` that a user can cause or must hear of."""

    result: Any = None
    """The partial `Result` of a run that ended early, set by `simulate`."""


@dataclass(eq=False)
class UnknownName(SimulationError):
    """A name that nothing has: `kind` says what it should name, `where` where it was looked for."""

    kind: str
    name: str
    where: str
    available: Sequence[str]

    def __str__(self) -> str:
        """Name, place, the nearest names, what there is."""
        meant = did_you_mean(self.name, self.available)
        listed = ", ".join(self.available) if self.available else "nothing"
        return f'unknown {self.kind} "{self.name}" in {self.where}.{meant} There: {listed}.'


@dataclass(eq=False)
class FmuError(SimulationError):
    """A file that cannot be used as an FMI 2.0 co-simulation FMU on this machine."""

    path: Path
    problem: str

    def __str__(self) -> str:
        """File and problem."""
        return f"{self.path}: {self.problem}"
