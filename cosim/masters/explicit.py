"""The explicit master: each component steps once per communication step; the timing of each input is data."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

from cosim.errors import NotSupported, UnknownName
from cosim.masters.control.constant import Constant
from cosim.masters.kernel.kernel import Kernel
from cosim.masters.kernel.library import obstacle
from cosim.masters.layout import Layout
from cosim.masters.master import Algorithm, Control, Flown
from cosim.masters.stepping import Stepping
from cosim.masters.turns import Turns, extrapolated
from cosim.masters.watch import Watch
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
            real = {wiring.variable(link.source).type, wiring.variable(link.target).type} == {"Real"}
            centred = self.centred and real and wiring.descriptions[link.target.component].refresh
            return "centred" if centred and chosen == "after_step" else chosen

        return replace(wiring, links=tuple(replace(link, timing=timing(link)) for link in wiring.links))

    def course(
        self, wiring: Wiring, schedule: Schedule, record: Sequence[str], stop_when: str = ""
    ) -> "ExplicitCourse":
        """Apply the settings to a timed wiring; see `Master.course`."""
        layout = Layout.of(wiring, record, stop_when, lambda link: extrapolated(wiring, link, self.extrapolation))
        return ExplicitCourse(self, Turns.of(wiring, layout, schedule, self.extrapolation))


@dataclass(frozen=True)
class ExplicitCourse:
    """The explicit master over one wiring and one schedule."""

    master: Explicit
    turns: Turns

    @property
    def layout(self) -> Layout:
        """Where every value has its place."""
        return self.turns.layout

    @property
    def schedule(self) -> Schedule:
        """The communication points."""
        return self.turns.schedule

    @property
    def order(self) -> Sequence[str]:
        """Instance names in stepping order."""
        return [turn.component.name for turn in self.turns.all]

    def algorithm(self, slaves: Mapping[str, Slave], watch: Watch) -> tuple[Algorithm, Flown]:
        """Return the kernel where it can fly these instances and may, else the loop in Python.

        Raises `NotSupported` where only the kernel may, and cannot.
        """
        reason = 'kernel="never"' if self.master.kernel == "never" else obstacle(slaves)
        if not reason:
            return Kernel(self.turns, slaves, watch), Flown("kernel")
        if self.master.kernel == "always":
            raise NotSupported(f'kernel="always": {reason}', 'Choose kernel="auto".')
        return Stepping(self.turns, slaves), Flown("python", reason)

    def control(self) -> Control:
        """Return the control of the steps: all of one size."""
        return Constant(self.schedule)
