"""An instance in a system as its FMU and how it flies: Component("wheel.fmu", isolated=True).

The word is SSP's for an element that is an FMU. `components.framework.Component` is another thing, the equations that
an FMU is built from; a file that has both says `import cosim` and `cosim.Component`.
"""

from dataclasses import dataclass
from pathlib import Path

from cosim.errors import WiringError
from cosim.system.reference import Reference, reference_of


@dataclass(frozen=True)
class Component:
    """An FMU of a system, `fmu` as in `System.components`; `isolated`: it flies in a process of its own."""

    fmu: Reference | Path
    isolated: bool = False

    def __post_init__(self) -> None:
        """Raise `WiringError` for what names no FMU, and for a flag that is none."""
        object.__setattr__(self, "fmu", reference_of(self.fmu))
        if not isinstance(self.isolated, bool):  # pyright: ignore[reportUnnecessaryIsInstance]
            problem = f"isolated of the component {self.fmu} is {self.isolated!r}, which is neither True nor False"
            raise WiringError(problem, "Give isolated=True to fly it in a process of its own.")
