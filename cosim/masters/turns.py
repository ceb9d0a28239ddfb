"""What the explicit master does in a step, as plain numbers: who steps when, with which input, what is read again.

The Python loop (explicit.py) and the kernel take the same turns with the same arithmetic.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cosim.arrays import BoolArray, IntArray
from cosim.errors import WiringErrors
from cosim.masters import rates
from cosim.masters.layout import ComponentLayout, Layout, Reading
from cosim.system import graph
from cosim.system.wiring import Link, Wiring
from cosim.time import Schedule

AT_POINT, AFTER_STEP, MIDPOINT, RAMP, STEP_MEAN, CENTRED = range(6)
"""Codes of `Turn.timing`; a step mean is an after_step input that shows its source's newest mean, a centred one is an
after_step input that is the mean of both ends while the target steps (`Explicit.centred`)."""

TIMING_CODES = {"at_point": AT_POINT, "after_step": AFTER_STEP, "midpoint": MIDPOINT, "ramp": RAMP, "centred": CENTRED}


@dataclass(frozen=True)
class InputDerivatives:
    """Input derivatives, arrays of length m: factor * ((b - a) / H) where `slot` is -1 (ramp), else factor * slot.

    `position` is the place of the input in `Inputs`, and gives the factor.
    """

    references: tuple[int, ...]
    orders: tuple[int, ...]
    position: IntArray
    slot: IntArray


@dataclass(frozen=True)
class Turn:
    """A component in its turn. `period` counts communication steps.

    It takes its step at the start of its period, or `at_end`, when its inputs come from faster components. With a and
    b the source's values at the start and the end of its step, an input is a (at_point, ramp), b (after_step, step
    mean) or 0.5 * (a + b) (midpoint, centred). `ahead[i]`: source i steps more slowly and at the start of its period,
    so that its newest value may lie in the target's future; `source_turn[i]` is the place of its turn. `begun` are
    the places of the component's inputs in `Point.begun`.
    """

    component: ComponentLayout
    period: int
    at_end: bool
    timing: IntArray
    ahead: BoolArray
    source_turn: IntArray
    derivatives: InputDerivatives
    begun: slice

    @cached_property
    def centred(self) -> IntArray:
        """Places of the centred inputs: set to b between the step and the reading of the outputs."""
        return np.flatnonzero(self.timing == CENTRED)

    @cached_property
    def centred_references(self) -> tuple[int, ...]:
        """Their value references."""
        return tuple(self.component.inputs.groups[0].references[i] for i in self.centred)

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
    """The turns of a communication step in their order, and the outputs that are then evaluated again."""

    layout: Layout
    schedule: Schedule
    all: tuple[Turn, ...]
    refresh: tuple[Reading, ...]

    def turn_of(self, reading: Reading) -> int:
        """Return the place of the turn of a reading's component."""
        component = self.layout.components[reading.component]
        return next(place for place, turn in enumerate(self.all) if turn.component is component)

    @classmethod
    def of(cls, wiring: Wiring, layout: Layout, schedule: Schedule, extrapolation: int = 0) -> "Turns":
        """Order the components of a wiring, by the timings of its links.

        Raises `CyclicOrder`, and `WiringErrors` for rates that do not fit.
        """
        if mistakes := rates.mistakes(wiring, schedule):
            raise WiringErrors(wiring.system, mistakes)
        order = graph.stepping_order(wiring)
        late = rates.waiting(wiring)
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
                derivatives=_input_derivatives(wiring, by_name[name], layout, extrapolation),
                begun=begun[name],
            )

        again = graph.refresh_order(wiring).evaluations
        readings = [reading for e in again for reading in layout.readings(wiring, e.outputs)]
        return cls(layout, schedule, tuple(turn(name) for name in order), tuple(readings))


def extrapolated(wiring: Wiring, link: Link, extrapolation: int) -> int:
    """Return up to which order an at_point input is extrapolated; the value of a slower source may be too old."""
    target, source = link.target.component, link.source.component
    if link.timing != "at_point" or not wiring.descriptions[target].can_interpolate_inputs:
        return 0
    if {wiring.variable(link.source).type, wiring.variable(link.target).type} != {"Real"}:
        return 0
    if wiring.period(source) > wiring.period(target):
        return 0
    return min(extrapolation, wiring.descriptions[source].max_output_derivative_order)


def _input_derivatives(
    wiring: Wiring, component: ComponentLayout, layout: Layout, extrapolation: int
) -> InputDerivatives:
    links = component.inputs.links
    ramps = [(i, 1, -1) for i, k in enumerate(links) if k.timing == "ramp"]
    extrapolations = [
        (i, n, layout.derivative_slots[k.source, n])
        for i, k in enumerate(links)
        for n in range(1, extrapolated(wiring, k, extrapolation) + 1)
    ]
    derivatives = ramps + extrapolations
    return InputDerivatives(
        references=tuple(wiring.variable(links[i].target).value_reference for i, _, _ in derivatives),
        orders=tuple(n for _, n, _ in derivatives),
        position=np.array([i for i, _, _ in derivatives], dtype=np.int64),
        slot=np.array([slot for _, _, slot in derivatives], dtype=np.int64),
    )
