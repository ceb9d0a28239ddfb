"""The explicit master: each component steps once per communication step; the timing of each input is data."""

from collections.abc import Callable, Generator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from cosim.errors import NotSupported, UnknownName
from cosim.masters import loop, planning
from cosim.masters.kernel import kernel
from cosim.masters.master import Block
from cosim.masters.plan import Plan
from cosim.slaves.slave import Slave
from cosim.system.wiring import Link, Wiring
from cosim.time import Schedule

PRESETS = ("declared", "jacobi", "gauss_seidel")
KERNEL = ("auto", "never", "always")


@dataclass(frozen=True)
class Explicit:
    """Settings of the explicit master.

    `preset`: the timings as the system declares them; "jacobi": all at_point; "gauss_seidel": after_step where the
    source is declared before the target, at_point elsewhere. Step means stay after_step in every preset.
    `extrapolation`: up to which order at_point inputs are extrapolated with output derivatives, where the FMUs can.
    `centred`: an FMU that can be refreshed steps with the mean of both ends where an input is after_step, and its
    outputs are then evaluated with the value at the end: as fresh as after_step, and its states of second order.
    `kernel`: whether the loop runs in the compiled kernel.
    """

    preset: Literal["declared", "jacobi", "gauss_seidel"] = "declared"
    extrapolation: Literal[0, 1, 2] = 0
    centred: bool = False
    kernel: Literal["auto", "never", "always"] = "auto"

    def __post_init__(self) -> None:
        """Raise `UnknownName` or `NotSupported` for settings that do not exist."""
        if self.preset not in PRESETS:
            raise UnknownName("preset", self.preset, "Explicit", PRESETS)
        if self.kernel not in KERNEL:
            raise UnknownName("kernel", self.kernel, "Explicit", KERNEL)
        if self.extrapolation not in (0, 1, 2):
            raise NotSupported(f"extrapolation of order {self.extrapolation}", "Choose 0, 1 or 2.")

    def plan(self, wiring: Wiring, schedule: Schedule, record: Sequence[str], stop_when: str = "") -> Plan:
        """Turn a checked wiring into plain data; see `Master.plan`."""
        return planning.build(self.timed(wiring), schedule, record, self.extrapolation, stop_when)

    def timed(self, wiring: Wiring) -> Wiring:
        """Return the wiring with the timings of the preset, centred where that is asked for and can be."""
        place = {name: i for i, name in enumerate(wiring.components)}

        def timing(link: Link) -> str:
            chosen = link.timing
            if link.step_mean:
                return chosen
            if self.preset != "declared":
                earlier = place[link.source.component] < place[link.target.component]
                chosen = "after_step" if self.preset == "gauss_seidel" and earlier else "at_point"
            centred = self.centred and wiring.descriptions[link.target.component].refresh
            return "centred" if centred and chosen == "after_step" else chosen

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
        reason = "" if self.kernel != "never" else 'kernel="never"'
        reason = reason or kernel.obstacle(slaves)
        if not reason:
            return kernel.steps(plan, slaves, values, block, stop)
        if self.kernel == "always":
            raise NotSupported(f'kernel="always": {reason}', 'Choose kernel="auto".')
        return loop.steps(plan, slaves, values, block, stop)
