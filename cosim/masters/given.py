"""What the inputs of a component are given while it steps, by the timing of each; how they move is in motion.py."""

from collections.abc import Callable

import numpy as np

from cosim.arrays import FloatArray, IntArray
from cosim.masters import curves
from cosim.masters.curves import Ends
from cosim.masters.slots import NEWEST, POINT, Slots, conversion
from cosim.masters.turns import BETWEEN, EXTRAPOLATED_MEAN, MEAN, MIDPOINT, Turn
from cosim.slaves.ready import Span

EndsOf = Callable[[int], Ends]
"""Communication step -> values and slopes of the inputs' sources at both ends of the component's period around it."""


class Given:
    """The inputs of one turn over the step of a span: `find` puts them into `values`.

    `ends` where sources step at other rates, None where all step together. Where each input then is the value of one
    slot, all are one gather.
    """

    def __init__(self, turn: Turn, slots: Slots, span: Span, values: FloatArray, ends: EndsOf | None = None) -> None:
        self._turn, self._slots, self._span, self._values = turn, slots, span, values
        self._inputs = turn.component.inputs
        self._ends = seen(turn, slots, ends or ends_of(turn, slots))
        single = ends is None and not turn.blends
        self.find = conversion(self._inputs, slots, self._single(), values) if single else self._find

    def _find(self) -> None:
        blend = self._blend(self._ends(self._span.k), self._span.h)
        self._values[:] = self._inputs.factor * blend + self._inputs.addend

    def _single(self) -> IntArray:
        """Return the place that each input has its value from."""
        turn, inputs, places = self._turn, self._inputs, self._slots.places
        found = np.where(turn.newest, places(NEWEST, inputs.source), places(POINT, inputs.source))
        return np.where(turn.fed, places(NEWEST, inputs.signal), found)

    def _blend(self, ends: Ends, h: float) -> FloatArray:
        """Return the values of inputs of any timing."""
        inputs, timing, slots = self._inputs, self._turn.timing, self._slots
        if self._turn.has_curves:
            ends = ends.known(h)
        value = np.where(self._turn.newest, ends.b, ends.a)
        value = np.where(timing == MIDPOINT, 0.5 * (ends.a + ends.b), value)
        value = np.where(timing == MEAN, curves.mean(ends, h), value)
        follows = timing == EXTRAPOLATED_MEAN
        value[follows] += 0.5 * h * slope_or_none(slots.point[inputs.slope[follows]])
        fed = self._turn.fed
        value[fed] = slots.newest[inputs.signal[fed]]
        return value


def ends_of(turn: Turn, slots: Slots, at: IntArray | None = None) -> EndsOf:
    """Return the ends of a turn whose sources step with it: the point, and what they have returned since.

    `at`: of which inputs, None: of all. Each call changes what the one before has returned.
    """
    inputs, take, places = turn.component.inputs, slots.all.take, slots.places
    slope = np.where(turn.curved, inputs.slope, inputs.source)  # what follows no curve has none: any number does
    whole = np.array([places(v, of) for of in (inputs.source, slope) for v in (POINT, NEWEST)])
    sources = whole if at is None else whole[:, at]
    found: FloatArray = np.zeros(sources.shape)
    ends = Ends(*found)

    def find(_k: int) -> Ends:
        take(sources, None, found, "clip")
        return ends

    return find


def seen(turn: Turn, slots: Slots, ends: EndsOf) -> EndsOf:
    """Return the ends that inputs see over a step: what a fault makes move in steps stays at its start."""
    inputs = turn.component.inputs
    if not inputs.faulty.size:
        return ends

    def stepped(k: int) -> Ends:
        a, b, da, db = (part.copy() for part in ends(k))
        stepping = inputs.stepping(slots.newest)
        at = stepping[np.isin(turn.timing[stepping], BETWEEN)]
        b[at], da[at], db[at] = a[at], 0.0, 0.0
        return Ends(a, b, da, db)

    return stepped


def slope_or_none(slope: FloatArray) -> FloatArray:
    """Return slopes that are known; an input whose source's slope is not is held."""
    return slope if curves.surely_known(slope) else np.where(np.isnan(slope), 0.0, slope)
