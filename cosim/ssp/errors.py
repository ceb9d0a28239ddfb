"""What is wrong with a .ssp file."""

from collections.abc import Sequence
from dataclasses import dataclass

from cosim.errors import SimulationError


@dataclass(eq=False)
class SspError(SimulationError):
    """A system structure package that cannot be read or written; `file`: which, and which file of it."""

    file: str
    problems: Sequence[str]

    def __str__(self) -> str:
        """File and problem, or a line for each problem."""
        if len(self.problems) == 1:
            return f"{self.file}: {self.problems[0]}"
        return "\n".join([f"{self.file} has {len(self.problems)} mistakes:", *(f"  {p}" for p in self.problems)])
