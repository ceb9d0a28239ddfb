"""What the explicit master does in a step, as plain numbers: who steps when, with which input, what is read again.

The Python loop (stepping.py) and the kernel take the same turns with the same arithmetic.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cosim.arrays import BoolArray, IntArray
from cosim.errors import WiringErrors
from cosim.masters import rates
from cosim.masters.algebraic_loop import Loop
from cosim.masters.layout import ComponentLayout, Layout, Reading
from cosim.masters.slopes import MOVING
from cosim.system import graph
from cosim.system.wiring import Port, Wiring
from cosim.time import Schedule

TIMING_CODES = {
    "at_point": 0,
    "after_step": 1,
    "midpoint": 2,
    "ramp": 3,
    "smooth": 5,
    "mean": 6,
    "extrapolated": 7,
    "extrapolated_mean": 8,
    "signal": 9,
    "signal_mean": 10,
    "signal_held": 10,
}
AT_POINT, AFTER_STEP, MIDPOINT, RAMP, STEP_MEAN, SMOOTH, MEAN, EXTRAPOLATED, EXTRAPOLATED_MEAN, SIGNAL, SIGNAL_MEAN = (
    range(11)
)
"""Codes of `Turn.timing`, see cosim/system/timing.py; a step mean is an after_step input that shows its source's newest
mean."""

BETWEEN = (MIDPOINT, RAMP, SMOOTH, MEAN)
"""Timings whose inputs are between the values at both ends of a step."""

LINE, CURVE, SLOT, SIGNAL_SLOT = range(4)
"""Where an input derivative comes from: the line between both ends, the curve through them, a slot of the step's start,
or that of a signal, which has stepped already."""


@dataclass(frozen=True)
class InputDerivatives:
    """Input derivatives of a step, arrays of length m: of the input at `position` in `Inputs`, from `form`.

    `slot`: of the source's derivative of that order, where it comes from a slot.
    """

    references: tuple[int, ...]
    orders: tuple[int, ...]
    position: IntArray
    form: IntArray
    slot: IntArray

    @cached_property
    def order(self) -> IntArray:
        """The orders as an array."""
        return np.array(self.orders, dtype=np.int64)

    @cached_property
    def places(self) -> dict[int, IntArray]:
        """Form -> places of the derivatives of it."""
        return {form: np.flatnonzero(self.form == form) for form in (LINE, CURVE, SLOT, SIGNAL_SLOT)}

    @cached_property
    def curves(self) -> list[IntArray]:
        """Places of the first, second and third derivatives of curves, the same inputs in each."""
        return [np.flatnonzero((self.form == CURVE) & (self.order == n)) for n in (1, 2, 3)]


@dataclass(frozen=True)
class Turn:
    """A component in its turn. `period` counts communication steps.

    It takes its step at the start of its period, or `at_end`, when its inputs come from faster components. `timing[i]`
    decides what input i is over the step. `ahead[i]`: source i steps more slowly and at the start of its period, so
    that its newest value may lie in the target's future; `source_turn[i]` is the place of its turn. `begun` are the
    places of the component's inputs in `Point.begun`. `moving`: places of inputs that have slopes when a step ends.
    """

    component: ComponentLayout
    period: int
    at_end: bool
    timing: IntArray
    ahead: BoolArray
    source_turn: IntArray
    derivatives: InputDerivatives
    moving: IntArray
    begun: slice

    @cached_property
    def curved(self) -> BoolArray:
        """Which inputs follow the curve through both ends, or are held at its mean."""
        return (self.timing == SMOOTH) | (self.timing == MEAN)

    @cached_property
    def has_curves(self) -> bool:
        """Whether any does."""
        return bool(self.curved.any())

    @cached_property
    def halfway(self) -> bool:
        """Whether any input is held between the values at both ends."""
        return bool(np.isin(self.timing, (MIDPOINT, MEAN, SIGNAL_MEAN)).any())

    @cached_property
    def newest(self) -> BoolArray:
        """Which inputs are what their sources have returned last."""
        return np.isin(self.timing, (AFTER_STEP, STEP_MEAN))

    @cached_property
    def fed(self) -> BoolArray:
        """Which inputs are signals."""
        return np.isin(self.timing, (SIGNAL, SIGNAL_MEAN))

    @cached_property
    def apart(self) -> bool:
        """Whether what inputs have at an end of the period is not simply what their sources had or have returned."""
        depends = np.isin(self.timing, (AFTER_STEP, *BETWEEN))
        return self.at_end or bool((self.ahead & depends).any())

    @cached_property
    def blends(self) -> bool:
        """Whether any input is made of more than one value."""
        return bool(np.isin(self.timing, (MIDPOINT, MEAN, EXTRAPOLATED_MEAN)).any())

    @cached_property
    def moving_references(self) -> tuple[int, ...]:
        """Value references of the inputs that have slopes when a step ends."""
        return tuple(self.component.inputs.references[i] for i in self.moving)

    def start(self, k: int) -> int:
        """Return the communication point where the period around step k begins."""
        return k - k % self.period

    def end(self, k: int, schedule: Schedule) -> int:
        """Return the communication point where it ends; the last period may be shorter."""
        return min(self.start(k) + self.period, schedule.steps)

    def due(self, k: int, schedule: Schedule) -> bool:
        """Whether the component takes its step within communication step k."""
        return k + 1 == self.end(k, schedule) if self.at_end else k == self.start(k)


@dataclass(frozen=True)
class Turns:
    """The turns of a communication step in their order, and the outputs and loops that are then evaluated again."""

    layout: Layout
    schedule: Schedule
    all: tuple[Turn, ...]
    refresh: tuple[Reading | Loop, ...]

    @property
    def loops(self) -> tuple[Loop, ...]:
        """The algebraic loops among them."""
        return tuple(part for part in self.refresh if isinstance(part, Loop))

    def turn_of(self, reading: Reading) -> int:
        """Return the place of the turn of a reading's component."""
        component = self.layout.components[reading.component]
        return next(place for place, turn in enumerate(self.all) if turn.component is component)

    @classmethod
    def of(cls, wiring: Wiring, layout: Layout, schedule: Schedule) -> "Turns":
        """Order the components of a wiring, by the timings of its links.

        Raises `CyclicOrder`, and `WiringErrors` for rates that do not fit and algebraic loops that cannot be solved.
        """
        if mistakes := [*rates.mistakes(wiring, schedule), *graph.unsolved_loops(wiring)]:
            raise WiringErrors(wiring.system, mistakes)
        again: list[Reading | Loop] = []
        for e in graph.refresh_order(wiring).evaluations:
            readings = layout.readings(wiring, e.outputs)
            again += [_loop(wiring, e.outputs, readings)] if e.loop else readings
        return cls.ordered(wiring, layout, schedule, graph.stepping_order(wiring), rates.waiting(wiring), again)

    @classmethod
    def ordered(
        cls,
        wiring: Wiring,
        layout: Layout,
        schedule: Schedule,
        order: Sequence[str],
        late: frozenset[str] = frozenset(),
        refresh: Sequence[Reading | Loop] = (),
    ) -> "Turns":
        """Return the turns in an order; `late`: who steps at the end of its period; `refresh`: what is read again."""
        by_name = {c.name: c for c in layout.components}
        begun, first = dict[str, slice](), 0
        for c in layout.components:
            begun[c.name] = slice(first, first + len(c.inputs.links))
            first += len(c.inputs.links)

        def turn(name: str) -> Turn:
            links, period = by_name[name].inputs.links, wiring.period(name)
            slower = [wiring.period(k.source.component) > period and k.source.component not in late for k in links]
            return Turn(
                component=by_name[name],
                period=period,
                at_end=name in late,
                timing=np.array([STEP_MEAN if k.step_mean else TIMING_CODES[k.timing] for k in links], dtype=np.int64),
                ahead=np.array(slower, dtype=np.bool_),
                source_turn=np.array([order.index(k.source.component) for k in links], dtype=np.int64),
                derivatives=_input_derivatives(wiring, by_name[name], layout),
                moving=np.array([i for i, k in enumerate(links) if k.timing in MOVING], dtype=np.int64),
                begun=begun[name],
            )

        return cls(layout, schedule, tuple(turn(name) for name in order), tuple(refresh))


def _loop(wiring: Wiring, outputs: Sequence[Port], readings: tuple[Reading, ...]) -> Loop:
    declared = all(wiring.descriptions[port.component].declares(port.variable) for port in outputs)
    return Loop(readings, graph.loop_path(wiring, outputs, initial=False), settles=not declared)


def _input_derivatives(wiring: Wiring, component: ComponentLayout, layout: Layout) -> InputDerivatives:
    rows: list[tuple[int, int, int, int]] = []
    for i, link in enumerate(component.inputs.links):
        if link.timing == "ramp":
            rows.append((i, 1, LINE, -1))
        elif link.timing == "smooth":
            rows += [(i, order, CURVE, -1) for order in (1, 2, 3)]
        elif link.timing == "extrapolated":
            rows += [(i, n, SLOT, layout.slope(link, n)) for n in range(1, link.order + 1)]
        elif link.timing == "signal":
            first = int(component.inputs.signal[i])
            rows += [(i, n, SIGNAL_SLOT, first + n) for n in range(1, link.order + 1)]
    links = component.inputs.links
    position, form, slot = (np.array([row[column] for row in rows], dtype=np.int64) for column in (0, 2, 3))
    return InputDerivatives(
        references=tuple(wiring.variable(links[i].target).value_reference for i, *_ in rows),
        orders=tuple(order for _, order, *_ in rows),
        position=position,
        form=form,
        slot=slot,
    )
