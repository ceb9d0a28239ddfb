"""The explicit master: each component steps once per communication step; the timing of each input is data."""

from collections.abc import Callable, Generator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from cosim.errors import NotSupported, UnknownName
from cosim.links import Link, Wiring
from cosim.masters import loop, planning
from cosim.masters.master import Block
from cosim.masters.plan import Plan
from cosim.protocol import Slave
from cosim.time import Schedule

PRESETS = ("declared", "jacobi", "gauss_seidel")
KERNEL = ("auto", "never", "always")


@dataclass(frozen=True)
class Explicit:
    """Settings of the explicit master.

    `preset`: the timings as the system declares them; "jacobi": all at_point; "gauss_seidel": after_step where the
    source is declared before the target, at_point elsewhere. Step means stay after_step in every preset.
    `extrapolation`: up to which order at_point inputs are extrapolated with output derivatives, where the FMUs can.
    `kernel`: whether the loop runs in the compiled kernel.
    """

    preset: Literal["declared", "jacobi", "gauss_seidel"] = "declared"
    extrapolation: Literal[0, 1, 2] = 0
    kernel: Literal["auto", "never", "always"] = "auto"

    def __post_init__(self) -> None:
        """Raise `UnknownName` or `NotSupported` for settings that do not exist."""
        if self.preset not in PRESETS:
            raise UnknownName("preset", self.preset, "Explicit", PRESETS)
        if self.kernel not in KERNEL:
            raise UnknownName("kernel", self.kernel, "Explicit", KERNEL)
        if self.extrapolation not in (0, 1, 2):
            raise NotSupported(f"extrapolation of order {self.extrapolation}", "Choose 0, 1 or 2.")

    def plan(self, wiring: Wiring, schedule: Schedule, record: Sequence[str]) -> Plan:
        """Turn a checked wiring into plain data; see `Master.plan`."""
        return planning.build(self.timed(wiring), schedule, record, self.extrapolation)

    def timed(self, wiring: Wiring) -> Wiring:
        """Return the wiring with the timings of the preset."""
        if self.preset == "declared":
            return wiring
        place = {name: i for i, name in enumerate(wiring.components)}

        def timing(link: Link) -> str:
            if link.step_mean:
                return link.timing
            earlier = place[link.source.component] < place[link.target.component]
            return "after_step" if self.preset == "gauss_seidel" and earlier else "at_point"

        return replace(wiring, links=tuple(replace(link, timing=timing(link)) for link in wiring.links))

    def steps(
        self,
        plan: Plan,
        slaves: Mapping[str, Slave],
        values: NDArray[np.float64],
        block: Block,
        stop: Callable[[], bool],
    ) -> Generator[int]:
        """Run from the initialized slaves to the stop time; see `Master.steps`."""
        if self.kernel == "always":
            raise NotSupported('kernel="always": there is no compiled kernel here', 'Choose kernel="auto".')
        return loop.steps(plan, slaves, values, block, stop)
