"""Values and slopes of a component's sources at both ends of its period, where these step at other rates."""

from collections.abc import Sequence

import numpy as np

from cosim.arrays import BoolArray, FloatArray, IntArray
from cosim.masters import curves
from cosim.masters.curves import Ends
from cosim.masters.slots import Slots
from cosim.masters.turns import BETWEEN, STEP_MEAN, Turn, Turns


class Between:
    """The sources of the inputs of one turn at any communication point of its period.

    A source that has stepped already stands ahead of it: what an input that goes from end to end has in between lies on
    the line or the curve over the source's step, what another one has is the source's value where that began.
    """

    def __init__(self, turn: Turn, turns: Turns, slots: Slots) -> None:
        self._turn, self._slots, self._schedule = turn, slots, turns.schedule
        between = np.isin(turn.timing, BETWEEN)
        self._moving = _by_source(turn, turns, turn.ahead & between)
        self._waiting = _by_source(turn, turns, turn.ahead & ~between & (turn.timing != STEP_MEAN))

    def ends(self, k: int) -> Ends:
        """Return the ends of the period around communication step k; see `EndsOf`."""
        a, da = self._slots.begun[:, self._turn.begun] if self._turn.at_end else self.at_start(k)
        b, db = self._at_end(k)
        return Ends(a, b, da, db)

    def at_start(self, k: int) -> FloatArray:
        """Return a, a': the sources' values and slopes where the period begins, shape (2, n_in)."""
        found = self._seen(self._slots.point)
        for source, places in self._moving:
            found[:, places] = self._over(source, places, k, self._turn.start(k))
        return found

    def _at_end(self, k: int) -> FloatArray:
        """Return b, b': the same where it ends."""
        found, end = self._seen(self._slots.newest), self._turn.end(k, self._schedule)
        for source, places in self._moving:
            if source.end(k, self._schedule) > end:
                found[:, places] = self._over(source, places, k, end)
        for source, places in self._waiting:
            if source.end(k, self._schedule) > end:
                found[0, places] = self._slots.point[self._turn.component.inputs.source[places]]
        return found

    def _seen(self, values: FloatArray) -> FloatArray:
        """Return the sources' values, and slopes where inputs follow curves, in a vector of slots."""
        inputs, curved = self._turn.component.inputs, self._turn.curved
        found = np.zeros((2, len(inputs.links)))
        found[0], found[1, curved] = values[inputs.source], values[inputs.slope[curved]]
        return found

    def _over(self, source: Turn, places: IntArray, k: int, at: int) -> FloatArray:
        """Return values and slopes at communication point `at` of inputs whose source is within its step."""
        begin, end = self._schedule.count(source.start(k)), self._schedule.count(source.end(k, self._schedule))
        since, whole = self._schedule.count(at) - begin, end - begin
        inputs, point, newest = self._turn.component.inputs, self._slots.point, self._slots.newest
        slots, curved, slopes = inputs.source[places], self._turn.curved[places], inputs.slope[places]
        ends = Ends(point[slots], newest[slots], point[slopes], newest[slopes])  # slopes: of curves only
        found = np.zeros((2, len(places)))
        if not curved.all():
            found[0] = ends.a + (ends.b - ends.a) * (since / whole)
        if curved.any():
            h, s = whole / self._schedule.denominator, since / self._schedule.denominator
            bent = Ends(*(part[curved] for part in ends)).known(h)
            found[:, curved] = curves.at(bent, h, s)
        if inputs.faulty.size:
            stepping = np.isin(places, inputs.stepping(newest))
            found[0, stepping], found[1, stepping] = ends.a[stepping], 0.0
        return found


def _by_source(turn: Turn, turns: Turns, which: BoolArray) -> Sequence[tuple[Turn, IntArray]]:
    """Return the places of some inputs by the turns of their sources."""
    found = np.unique(turn.source_turn[which])
    return [(turns.all[place], np.flatnonzero(which & (turn.source_turn == place))) for place in found]
