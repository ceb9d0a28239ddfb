"""The vectors of slots that a loop in Python works in: always the same ones, so that calls can be made ready once."""

from collections.abc import Callable
from math import isfinite

import numpy as np

from cosim.arrays import FloatArray, IntArray
from cosim.masters.layout import Inputs, Layout
from cosim.masters.point import Point
from cosim.masters.types import Texts

POINT, NEWEST, COMING = range(3)
"""Which vector, for `Slots.places`."""

FEW = 6
"""Up to so many numbers are converted faster in plain Python than in NumPy."""

SOME = 100
"""Up to so many are added faster."""


class Slots:
    """All slots three times, each of shape (size,), and what else a point has.

    `point`: as they are seen at communication point `index`; `newest`: what the components returned last; `coming`:
    the next point in the making; `begun` as in `Point`.
    """

    def __init__(self, layout: Layout) -> None:
        self._rows = np.zeros((3, layout.size + 2))  # the last places have time and index, which change with the values
        self.all: FloatArray = self._rows.reshape(-1)
        self.point, self.newest, self.coming = (row[:-2] for row in self._rows)
        self._here, self._coming = self._rows[POINT], self._rows[COMING]
        self._views = tuple(row.data for row in self._rows)  # which are copied faster than arrays
        self._columns = np.append(layout.size, layout.columns.slots)
        self._shows = bool(np.isin(layout.inputs.slots, layout.columns.slots).any())
        self.begun: FloatArray = np.zeros((2, len(layout.inputs.links)))
        self.texts = Texts()
        self._memory: FloatArray = np.zeros(0)
        self._inputs: FloatArray = np.zeros(len(layout.inputs.links))
        sources = self.places(POINT, layout.inputs.source)
        self._shown, self._show = place(layout.inputs.slots), conversion(layout.inputs, self, sources, self._inputs)

    @property
    def index(self) -> int:
        """The communication point at which `point` stands."""
        return int(self._here[-1])

    def places(self, vector: int, slots: IntArray) -> IntArray:
        """Return where slots of one of the vectors stand in `all`."""
        return slots + vector * self._rows.shape[1]

    def put(self, point: Point) -> None:
        """Go to a point."""
        self.point[:], self.newest[:], self.begun[:] = point.values, point.newest, point.begun
        self._here[-1], self.texts, self._memory = point.index, point.texts, point.memory

    def arrive(self, index: int, time: float) -> None:
        """Make what is coming the point: in one copy, so that an interrupt leaves the one or the other."""
        self._coming[-2], self._coming[-1] = time, index
        self._views[POINT][:] = self._views[COMING]

    def come(self) -> None:
        """Let what the components have returned last be what is coming."""
        self._views[COMING][:] = self._views[NEWEST]

    def row(self) -> FloatArray:
        """Return the row of the point, time first, shape (1 + columns,), after `arrive`."""
        if self._shows:
            self.show_inputs()
        return self._here[self._columns]

    def show_inputs(self) -> None:
        """Put into the own slot of every connected input what its source gives it at the point."""
        self._show()
        self.point[self._shown] = self._inputs

    def reached(self) -> Point:
        """Return a copy of the point."""
        values, newest, begun = self.point.copy(), self.newest.copy(), self.begun.copy()
        return Point(self.index, values, newest, begun, self.texts, self._memory)


def place(slots: IntArray) -> slice | IntArray:
    """Return slots as what one indexes with: a slice where they follow each other, for that makes a view."""
    consecutive = slots.size and bool((np.diff(slots) == 1).all())
    return slice(int(slots[0]), int(slots[-1]) + 1) if consecutive else slots


def conversion(inputs: Inputs, slots: Slots, sources: IntArray, values: FloatArray) -> Callable[[], None]:
    """Return what puts inputs = factor * all[sources] + addend into `values`, shape (n,)."""
    factor, addend = inputs.factor, inputs.addend
    if len(sources) <= FEW:
        numbers, given = slots.all.data, values.data
        each = list(zip(range(len(sources)), sources.tolist(), factor.tolist(), addend.tolist(), strict=True))

        def convert_few() -> None:
            for i, source, a, b in each:
                given[i] = a * numbers[source] + b

        return convert_few
    converts, take, add, multiply = bool((factor != 1).any()), slots.all.take, np.add, np.multiply

    def convert() -> None:
        take(sources, None, values, "clip")  # any mode but "raise" gathers without a copy, and no place is outside
        if converts:
            multiply(values, factor, values)
        add(values, addend, values)  # by nothing too: it makes -0.0 a zero, as the kernel does

    return convert


def finiteness(vector: FloatArray, slots: IntArray) -> Callable[[], bool]:
    """Return what tells whether some slots of a vector are finite for sure.

    Where it says no, each has to be asked: of not too many it is their sum, which may be infinite where they are not.
    """
    where, take = place(slots), vector.take
    numbers = vector[where]  # a view where they follow each other
    terms, apart = numbers.data, not isinstance(where, slice)

    def is_sum_finite() -> bool:
        if apart:
            take(slots, None, numbers, "clip")
        return isfinite(sum(terms))

    return is_sum_finite if len(slots) <= SOME else lambda: bool(np.isfinite(vector[where]).all())
