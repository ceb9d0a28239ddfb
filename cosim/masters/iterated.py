"""The iterated master: a step is repeated until what the components exchange agrees at its end."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

from cosim.errors import NotSupported, UnknownName, WiringErrors
from cosim.masters import rates
from cosim.masters.control.constant import Constant
from cosim.masters.implicit.cut import Stage, stages
from cosim.masters.implicit.iterating import Iterating
from cosim.masters.implicit.plan import Plan
from cosim.masters.kernel.iterated import IteratedKernel, iterated_obstacle
from cosim.masters.kernel.library import KERNEL, why_python
from cosim.masters.layout import Layout
from cosim.masters.master import Algorithm, Control, Flown
from cosim.masters.turns import Turns
from cosim.masters.watch import Watch
from cosim.slaves.slave import Slave
from cosim.system.timing import between, moving
from cosim.system.wiring import Link, Wiring
from cosim.time import Schedule

INPUTS = ("smooth", "ramp")


@dataclass(frozen=True)
class Iterated:
    """Settings of the iterated master: implicit, with rollback by FMU state.

    Every input whose source moves follows it through both ends of the step: `inputs` "smooth", the cubic with the
    source's slopes (order 4), or "ramp", the line (order 2), as far as its FMU can. Outputs of sampled components and
    step means are held, and what such a mean is of is a line to who takes both. `tolerance`: up to which part of their
    nominal size the exchanged values agree.
    `kernel`: whether the loop runs in the compiled kernel.
    """

    inputs: Literal["smooth", "ramp"] = "smooth"
    tolerance: float = 1e-9
    kernel: Literal["auto", "never", "always"] = "auto"

    def __post_init__(self) -> None:
        """Raise `UnknownName` or `NotSupported` for settings that do not exist."""
        for name, known in (("inputs", INPUTS), ("kernel", KERNEL)):
            if getattr(self, name) not in known:
                raise UnknownName(name, getattr(self, name), "Iterated", known)
        if not 0 < self.tolerance < 1:
            raise NotSupported(f"tolerance = {self.tolerance:g}", "It must be above 0 and below 1, such as 1e-9.")

    def timed(self, wiring: Wiring) -> Wiring:
        """Return the wiring with the timings of this master: step means after their step, all that moves on curves."""

        def held(link: Link) -> Link:
            if link.fed:
                return link
            steps = not link.step_mean and not between(wiring, link)
            return replace(link, timing="at_point" if steps else "after_step", asked="")

        return moving(replace(wiring, links=tuple(map(held, wiring.links))), self.inputs)

    def course(
        self, wiring: Wiring, schedule: Schedule, record: Sequence[str], stop_when: str = ""
    ) -> "IteratedCourse":
        """Apply the settings to a timed wiring; see `Master.course`."""
        found = stages(wiring)
        refuse(wiring, schedule, found, type(self).__name__)
        layout = Layout.of(wiring, record, stop_when)
        turns = Turns.ordered(wiring, layout, schedule, [name for stage in found for name in stage.members])
        return IteratedCourse(self, Plan.of(wiring, turns, found))


def refuse(wiring: Wiring, schedule: Schedule, found: Sequence[Stage], master: str) -> None:
    """Raise `NotSupported` or `WiringErrors` for what cannot be repeated."""
    for name in wiring.components:
        if wiring.period(name) != 1:
            what = f"{master} steps all components together, but {name} takes {wiring.period(name)} steps in one"
            raise NotSupported(what, "Leave it out of `steps`, or choose master=Explicit().")
    for stage in found:
        for name in stage.members if stage.cut else ():
            if not wiring.descriptions[name].can_get_and_set_state:
                what = f"{name} cannot save its state (canGetAndSetFMUstate=false), so its step cannot be repeated"
                raise NotSupported(what, "Choose master=Explicit().")
    for link in wiring.links:
        description = wiring.descriptions[link.target.component]
        if link.timing in ("midpoint", "mean", "signal_mean") and not description.refresh:
            follows = [
                v.name for v in description.real_outputs if link.target.variable in description.feedthrough(v.name)
            ]
            if follows:
                what = (
                    f"{link.target.component} cannot interpolate {link.target.variable} (canInterpolateInputs=false), "
                    f"and {follows[0]} follows it directly, but cannot be read again without a step"
                )
                raise NotSupported(what, "Choose master=Explicit().")
    why = "halves steps that do not converge, and a delay would count each half"
    refuse_faults(wiring, ("delay",), master, why)
    if mistakes := rates.of_one_rate(wiring, schedule):
        raise WiringErrors(wiring.system, mistakes)


def refuse_faults(wiring: Wiring, kinds: Sequence[str], master: str, why: str) -> None:
    """Raise `NotSupported` for a fault of some kinds on a connection."""
    for port, faulty in wiring.faulty.items():
        for kind in kinds:
            if kind in faulty.kinds:
                raise NotSupported(f"the fault {kind} of {port}: {master} {why}", "Choose master=Explicit().")


@dataclass(frozen=True)
class IteratedCourse:
    """The iterated master over one wiring and one schedule."""

    master: Iterated
    plan: Plan

    @property
    def layout(self) -> Layout:
        """Where every value has its place."""
        return self.plan.turns.layout

    @property
    def schedule(self) -> Schedule:
        """The communication points."""
        return self.plan.turns.schedule

    @property
    def order(self) -> Sequence[str]:
        """Instance names in stepping order."""
        return [turn.component.name for turn in self.plan.turns.all]

    def algorithm(self, slaves: Mapping[str, Slave], watch: Watch) -> tuple[Algorithm, Flown]:
        """Return the kernel where it can fly these instances and may, else the loop in Python.

        Raises `NotSupported` where only the kernel may, and cannot.
        """
        reason = why_python(self.master.kernel, lambda: iterated_obstacle(slaves))
        if not reason:
            return IteratedKernel(self.plan, slaves, watch, self.master.tolerance), Flown("kernel")
        return Iterating(self.plan, slaves, self.master.tolerance), Flown("python", reason)

    def control(self) -> Control:
        """Return the control of the steps: all of one size."""
        return Constant()
