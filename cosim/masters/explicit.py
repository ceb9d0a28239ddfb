"""The explicit master: each component steps once per communication step; the timing of each input is data."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

from cosim.errors import NotSupported, UnknownName
from cosim.masters import slopes
from cosim.masters.control.constant import Constant
from cosim.masters.kernel.kernel import Kernel
from cosim.masters.kernel.library import KERNEL, obstacle, why_python
from cosim.masters.layout import Layout
from cosim.masters.master import Algorithm, Control, Flown
from cosim.masters.stepping import Stepping
from cosim.masters.turns import Turns
from cosim.masters.watch import Watch
from cosim.slaves.slave import Slave
from cosim.system.timing import between, extrapolated, limited, moving
from cosim.system.wiring import Link, Wiring
from cosim.time import Schedule

PRESETS = ("declared", "jacobi", "plain", "gauss_seidel")
INPUTS = ("declared", "held", "ramp", "smooth")


@dataclass(frozen=True)
class Explicit:
    """Settings of the explicit master.

    `preset`: the timings as the system declares them; "jacobi": all at_point; "gauss_seidel": after_step where the
    source is declared before the target, at_point elsewhere; step means stay after_step in all of these. "plain": what
    most tools do, to check an export: all inputs, step means too, are what the sources returned at the end of their
    last step, which nothing evaluates again; algebraic loops are delayed.
    `inputs`: how inputs whose sources step first are carried over a step: as the system declares it, or all of them
    held at the end's value (after_step), on a line (ramp), on a curve (smooth).
    `extrapolation`: up to which order at_point inputs follow their sources' derivatives; with smooth inputs and
    order 1 the exchange is of second order, and its stable steps are shorter than those of held inputs.
    `kernel`: whether the loop runs in the compiled kernel.
    """

    preset: Literal["declared", "jacobi", "plain", "gauss_seidel"] = "declared"
    inputs: Literal["declared", "held", "ramp", "smooth"] = "declared"
    extrapolation: Literal[0, 1, 2] = 0
    kernel: Literal["auto", "never", "always"] = "auto"

    def __post_init__(self) -> None:
        """Raise `UnknownName` or `NotSupported` for settings that do not exist."""
        for name, known in (("preset", PRESETS), ("inputs", INPUTS), ("kernel", KERNEL)):
            if getattr(self, name) not in known:
                raise UnknownName(name, getattr(self, name), "Explicit", known)
        if self.extrapolation not in (0, 1, 2):
            raise NotSupported(f"extrapolation of order {self.extrapolation}", "Choose 0, 1 or 2.")
        if self.preset in ("jacobi", "plain") and self.inputs != "declared":
            problem = (
                f'preset="{self.preset}" with inputs="{self.inputs}": no source steps first, all inputs are at_point'
            )
            ways = "Choose another preset, or extrapolation=1." if self.preset == "jacobi" else "Choose another preset."
            raise NotSupported(problem, ways)
        if self.preset == "plain" and self.extrapolation:
            problem = f'preset="plain" with extrapolation={self.extrapolation}: its inputs are held'
            raise NotSupported(problem, "Choose another preset.")

    def timed(self, wiring: Wiring) -> Wiring:
        """Return the wiring with the timings of the settings, as far as its FMUs can; `asked` where they cannot."""
        place = {name: i for i, name in enumerate(wiring.components)}
        if self.preset == "plain":
            return replace(wiring, links=tuple(map(_plain, wiring.links)), refreshed=False)
        timed = replace(wiring, links=tuple(self._preset(link, place) for link in wiring.links))
        if self.inputs != "declared":
            timed = moving(timed, "after_step" if self.inputs == "held" else self.inputs)
        if not self.extrapolation:
            return timed
        timed = replace(timed, links=tuple(_extrapolated(timed, link) for link in timed.links))
        return replace(timed, links=tuple(self._limited(timed, link) for link in timed.links))

    def _preset(self, link: Link, place: Mapping[str, int]) -> Link:
        if self.preset == "declared" or link.step_mean or link.fed:
            return link
        earlier = place[link.source.component] < place[link.target.component]
        timing = "after_step" if self.preset == "gauss_seidel" and earlier else "at_point"
        return replace(link, timing=timing, asked="")

    def _limited(self, wiring: Wiring, link: Link) -> Link:
        """Return a link with the order up to which it is extrapolated; which slopes are true follows from all links."""
        if not link.timing.startswith("extrapolated"):
            return link
        told = slopes.told(wiring, link.source)
        return limited(link, self.extrapolation, told, wiring.descriptions[link.target.component])

    def course(
        self, wiring: Wiring, schedule: Schedule, record: Sequence[str], stop_when: str = ""
    ) -> "ExplicitCourse":
        """Apply the settings to a timed wiring; see `Master.course`."""
        return ExplicitCourse(self, Turns.of(wiring, Layout.of(wiring, record, stop_when), schedule))


def _plain(link: Link) -> Link:
    """Return a link that hands on what its source has returned last; a signal goes on as it is."""
    return link if link.fed else replace(link, timing="at_point", step_mean=False, asked="")


def _extrapolated(wiring: Wiring, link: Link) -> Link:
    """Return an at_point link that follows its source's slope; a slower source's value may be too old for that.

    What a sampled component reads is what its sources show at its sample.
    """
    source, target = link.source.component, wiring.descriptions[link.target.component]
    if link.timing != "at_point" or not between(wiring, link) or target.sampled:
        return link
    if wiring.period(source) > wiring.period(link.target.component):
        return link
    return extrapolated(link, target)


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
        reason = why_python(self.master.kernel, lambda: self._loops() or obstacle(slaves))
        if not reason:
            return Kernel(self.turns, slaves, watch), Flown("kernel")
        return Stepping(self.turns, slaves, watch), Flown("python", reason)

    def _loops(self) -> str:
        """Return why the kernel cannot fly these turns, "" if it can: what solves algebraic loops is in Python."""
        paths = "; ".join(" <- ".join(loop.path) for loop in self.turns.loops)
        return f"an algebraic loop is solved at each communication point ({paths})" if paths else ""

    def control(self) -> Control:
        """Return the control of the steps: all of one size."""
        return Constant()
