"""The error-controlled master: iterated steps that are as long as a tolerance allows."""

import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from fractions import Fraction
from typing import Literal

from cosim.errors import NotSupported, TimeError, UnknownName
from cosim.masters.control.error_controlled import ErrorControlled as Control
from cosim.masters.implicit.cut import Stage, stages
from cosim.masters.implicit.estimating import Estimating, Pair, Solver
from cosim.masters.implicit.iterating import Iterating
from cosim.masters.implicit.norm import Norm
from cosim.masters.implicit.plan import Plan
from cosim.masters.iterated import Iterated, refuse, refuse_faults
from cosim.masters.kernel.iterated import KernelSolver, iterated_obstacle
from cosim.masters.kernel.library import KERNEL, why_python
from cosim.masters.layout import Layout
from cosim.masters.master import Algorithm, Flown
from cosim.masters.rates import sample_times
from cosim.masters.turns import Turns
from cosim.masters.watch import Watch
from cosim.slaves.slave import Slave
from cosim.system.fault import JUMPING
from cosim.system.timing import between
from cosim.system.wiring import Wiring
from cosim.time import Schedule, Seconds, exact_seconds

HALVINGS = 20
"""How often a communication step may be halved where no least step is given, as far as that can be counted."""

AGREEMENT, ROUNDING = 1e-2, 1e-13
"""Of the tolerance, up to which exchanged values agree; and the least that doubles, some roundings later, can."""


@dataclass(frozen=True)
class ErrorControlled:
    """Settings of the error-controlled master: the iterated one with smooth inputs, its steps of any length.

    A step is as long as the estimated error of no connected Real output is above `absolute` of its nominal value plus
    `relative` of its size; `absolute` None: as `relative`. `tolerances`: pattern -> both of these for the outputs that
    match, {"plant.omega_BN_B": 1e-9}. Outputs of sampled components and step means are not judged.

    Rows come at the experiment's communication points, each `every`-th, and steps land on these: no step is longer than
    `every` communication steps. `least_step`, `largest_step` in s; None: a communication step / 2^20, and no limit.
    Steps land on the samples of sampled components too, and on events. Every FMU must be able to save its state and
    take steps of any length. `kernel`: whether steps are solved in the compiled kernel.
    """

    relative: float = 1e-6
    absolute: float | None = None
    tolerances: Mapping[str, float] | tuple[tuple[str, float], ...] = ()
    least_step: Seconds | None = None
    largest_step: Seconds | None = None
    kernel: Literal["auto", "never", "always"] = "auto"

    def __post_init__(self) -> None:
        """Raise `UnknownName` or `NotSupported` for settings that cannot be; make the tolerances plain."""
        if self.kernel not in KERNEL:
            raise UnknownName("kernel", self.kernel, "ErrorControlled", KERNEL)
        tolerances = dict(self.tolerances)
        object.__setattr__(self, "tolerances", tuple(tolerances.items()))
        named = {"relative": self.relative, "absolute": self.absolute}
        named |= {f'tolerances["{pattern}"]': value for pattern, value in tolerances.items()}
        for name, value in named.items():
            if value is not None and not 0 < value < 1:
                raise NotSupported(f"{name} = {value:g}", "A tolerance must be above 0 and below 1, such as 1e-6.")
        least, largest = self._seconds("least_step"), self._seconds("largest_step")
        if least is not None and largest is not None and least > largest:
            what = f"least_step = {float(least):g} s is above largest_step = {float(largest):g} s"
            raise NotSupported(what, "Choose a least step that is the shorter one.")

    def _seconds(self, name: str) -> Fraction | None:
        value: Seconds | None = getattr(self, name)
        if value is None:
            return None
        exact = exact_seconds(value, name)
        if exact <= 0:
            raise NotSupported(f"{name} = {float(exact):g} s", "A step must be longer than 0 s.")
        return exact

    def timed(self, wiring: Wiring) -> Wiring:
        """Return the wiring with the timings of this master, those of the iterated one."""
        return Iterated("smooth").timed(wiring)

    def course(
        self, wiring: Wiring, schedule: Schedule, record: Sequence[str], stop_when: str = ""
    ) -> "ErrorControlledCourse":
        """Apply the settings to a timed wiring; see `Master.course`."""
        found = stages(wiring)
        self._refuse(wiring)
        why = "chooses its steps, at each of whose ends the connection would move to another value"
        refuse_faults(wiring, JUMPING, type(self).__name__, why)
        refuse(wiring, schedule, found, type(self).__name__)
        fine, landings = self._divided(wiring, schedule)
        layout = Layout.of(wiring, record, stop_when)
        relative = self.relative
        absolute = relative if self.absolute is None else self.absolute
        norm = Norm.of(wiring, layout, absolute, relative, dict(self.tolerances))
        return ErrorControlledCourse(self, _pair(wiring, layout, fine, found), norm, schedule, landings)

    def _refuse(self, wiring: Wiring) -> None:
        for name, description in wiring.descriptions.items():
            missing = {
                "cannot save its state (canGetAndSetFMUstate=false), so its step cannot be taken back": (
                    not description.can_get_and_set_state
                ),
                "needs a constant step (canHandleVariableCommunicationStepSize=false)": (
                    not description.can_handle_variable_step
                ),
            }
            for what, is_so in missing.items():
                if is_so:
                    advice = "Choose master=Explicit(), or master=Iterated() where it is in no loop."
                    raise NotSupported(f"{name} {what}", advice)

    def _divided(self, wiring: Wiring, schedule: Schedule) -> tuple[Schedule, tuple[int, ...]]:
        """Return the schedule of the points at which a step may end, and the landings, counted in these."""
        step, samples = schedule.step_size, sample_times(wiring).values()
        start = Fraction(schedule.start, schedule.denominator)
        events = (Fraction(event, schedule.denominator) - start for event in schedule.events)
        n = math.lcm(*((time / step).denominator for time in (*samples, *events)))
        least, longest = self._seconds("least_step"), step * schedule.every
        if least is not None and least > longest:
            what = f"least_step = {float(least):g} s is above the distance of two rows, {float(longest):g} s"
            raise NotSupported(what, "Choose a shorter one, or record fewer rows (every).")
        while least is not None and step / n > least:
            n *= 2
        fine = schedule.divided(n)
        for k in range(1, HALVINGS + 1) if least is None else ():
            with suppress(TimeError):
                fine = schedule.divided(n * 2**k)
        if (largest := self._seconds("largest_step")) is not None and largest < fine.step_size:
            what = f"largest_step = {float(largest):g} s is below the least step, {float(fine.step_size):g} s"
            raise NotSupported(what, "Choose a longer one, or give least_step too.")
        return fine, (fine.every, *(int(sample / fine.step_size) for sample in samples))


def _pair(wiring: Wiring, layout: Layout, schedule: Schedule, found: Sequence[Stage]) -> Pair:
    order = [name for stage in found for name in stage.members]
    flown = Plan.of(wiring, Turns.ordered(wiring, layout, schedule, order), found)
    smooth = all(link.timing == "smooth" for link in wiring.links if between(wiring, link) and not link.fed)
    means = any(link.step_mean for link in wiring.links)
    told = all(c.outputs.differences is None for c in layout.components)
    if not smooth or means or not told:
        return Pair(flown, flown, 2)
    ramps = Iterated("ramp").timed(wiring)
    turns = Turns.ordered(ramps, layout.without_slopes(ramps), schedule, order)
    return Pair(Plan.of(ramps, turns, found), flown, 1)


@dataclass(frozen=True)
class ErrorControlledCourse:
    """The error-controlled master over one wiring and one schedule: `own`, that of the experiment."""

    master: ErrorControlled
    pair: Pair
    norm: Norm
    own: Schedule
    landings: tuple[int, ...]

    @property
    def layout(self) -> Layout:
        """Where every value has its place."""
        return self.pair.flown.turns.layout

    @property
    def schedule(self) -> Schedule:
        """The points at which a step may end; those of the experiment are among them."""
        return self.pair.flown.turns.schedule

    @property
    def order(self) -> Sequence[str]:
        """Instance names in stepping order."""
        return [turn.component.name for turn in self.pair.flown.turns.all]

    def algorithm(self, slaves: Mapping[str, Slave], watch: Watch) -> tuple[Algorithm, Flown]:
        """Return the loop, which solves its steps in the kernel where that can fly these instances and may.

        Raises `NotSupported` where only the kernel may, and cannot.
        """
        agreement = max(AGREEMENT * float(min([self.master.relative, *self.norm.relative])), ROUNDING)

        def in_kernel(plan: Plan) -> Solver:
            return KernelSolver(plan, slaves, watch, agreement)

        def in_python(plan: Plan) -> Solver:
            return Iterating(plan, slaves, agreement)

        reason = why_python(self.master.kernel, lambda: iterated_obstacle(slaves))
        solver, flown = (in_python, Flown("python", reason)) if reason else (in_kernel, Flown("kernel"))
        return Estimating(self.pair, slaves, self.norm, solver), flown

    def control(self) -> Control:
        """Return the control of the steps, which begins with the experiment's own."""
        step = self.schedule.step_size
        least, largest = self.master.least_step, self.master.largest_step
        return Control(
            self.schedule,
            least=1 if least is None else math.ceil(exact_seconds(least, "least_step") / step),
            largest=self.schedule.steps if largest is None else int(exact_seconds(largest, "largest_step") / step),
            first=int(self.own.step_size / step),
            landings=self.landings,
        )
