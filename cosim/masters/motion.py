"""How the inputs of a component move while it steps: their derivatives at its start, by the timing of each."""

import numpy as np

from cosim.arrays import FloatArray, IntArray
from cosim.masters import curves
from cosim.masters.curves import Ends
from cosim.masters.given import EndsOf, ends_of, seen, slope_or_none
from cosim.masters.slots import NEWEST, POINT, Slots
from cosim.masters.turns import CURVE, LINE, SIGNAL_SLOT, SLOT, Turn
from cosim.slaves.ready import Ready, Span


class Motion:
    """The derivatives of the inputs of one turn over the step of a span.

    `calls` find them and put them into `derivatives`, in the order of `Turn.derivatives`. `ends` as in `Given`.
    """

    def __init__(self, turn: Turn, slots: Slots, span: Span, ends: EndsOf | None = None) -> None:
        self._turn, self._slots, self._span, self._given_ends = turn, slots, span, ends
        told = turn.derivatives
        self.derivatives: FloatArray = np.zeros(len(told.position))
        self.calls = list[Ready]()
        if told.places[LINE].size:
            self.calls.append(self._lines(told.places[LINE]))
        if told.places[CURVE].size:
            self.calls.append(self._curves())
        for form, vector in ((SLOT, POINT), (SIGNAL_SLOT, NEWEST)):
            if told.places[form].size:
                self.calls.append(self._told(told.places[form], vector))
        factor = turn.component.inputs.factor[told.position]
        if (factor != 1).any():
            self.calls.append(_scaling(self.derivatives, factor))

    def _lines(self, places: IntArray) -> Ready:
        """Return what finds the slopes of the lines between both ends."""
        found, span, ends_at = self.derivatives, self._span, self._ends(self._turn.derivatives.position[places])

        def find() -> None:
            ends = ends_at(span.k)
            found[places] = (ends.b - ends.a) / span.h

        return find

    def _curves(self) -> Ready:
        """Return what finds the derivatives of the curves through both ends, of the first three orders."""
        found, span, h = self.derivatives, self._span, np.zeros(())
        first, second, third = self._turn.derivatives.curves
        ends_at = self._ends(self._turn.derivatives.position[first])

        def find() -> None:
            h[()] = span.h
            ends = ends_at(span.k).known(h)
            found[first] = ends.da
            found[second], found[third] = curves.second(ends, h), curves.third(ends, h)

        return find

    def _told(self, places: IntArray, vector: int) -> Ready:
        """Return what finds the derivatives that stand in slots of a vector."""
        found, take = self.derivatives, self._slots.all.take
        slots = self._slots.places(vector, self._turn.derivatives.slot[places])

        def find() -> None:
            found[places] = take(slots)

        def find_known() -> None:
            found[places] = slope_or_none(take(slots))

        return find if vector == NEWEST else find_known

    def _ends(self, at: IntArray) -> EndsOf:
        """Return what gives the ends of the inputs at some places."""
        turn, slots = self._turn, self._slots
        if self._given_ends is None and not turn.component.inputs.faulty.size:
            return ends_of(turn, slots, at)
        whole = seen(turn, slots, self._given_ends or ends_of(turn, slots))
        return lambda k: Ends(*(part[at] for part in whole(k)))


def _scaling(derivatives: FloatArray, factor: FloatArray) -> Ready:
    """Return what multiplies derivatives of sources by the factors of the inputs."""

    def scale() -> None:
        np.multiply(derivatives, factor, derivatives)

    return scale
