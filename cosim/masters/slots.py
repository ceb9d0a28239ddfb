"""The vectors of slots that a loop in Python works in: always the same ones, so that calls can be made ready once."""

from collections.abc import Callable

import numpy as np

from cosim.arrays import FloatArray, IntArray
from cosim.masters.layout import Inputs, Layout
from cosim.masters.point import Point
from cosim.masters.types import Texts

POINT, NEWEST, COMING = range(3)
"""Which vector, for `Slots.places`."""


class Slots:
    """All slots three times, each of shape (size,), and what else a point has.

    `point`: as they are seen at communication point `index`; `newest`: what the components returned last; `coming`:
    the next point in the making; `begun` as in `Point`.
    """

    def __init__(self, layout: Layout) -> None:
        self._rows = np.zeros((3, layout.size + 1))  # the last place has the index, which so changes with the values
        self.all: FloatArray = self._rows.reshape(-1)
        self.point, self.newest, self.coming = (row[:-1] for row in self._rows)
        self._here, self._coming = self._rows[POINT], self._rows[COMING]
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

    def arrive(self, index: int) -> None:
        """Make what is coming the point, at `index`: in one copy, so that an interrupt leaves the one or the other."""
        self._coming[-1] = index
        self._here[:] = self._coming

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
    converts, take, add, multiply = bool((factor != 1).any()), slots.all.take, np.add, np.multiply

    def convert() -> None:
        take(sources, out=values)
        if converts:
            multiply(values, factor, values)
        add(values, addend, values)  # by nothing too: it makes -0.0 a zero, as the kernel does

    return convert


def finiteness(vector: FloatArray, slots: IntArray) -> Callable[[], bool]:
    """Return what tells whether some slots of a vector are finite: only then their product with zeros is zero."""
    zeros, where = np.zeros(len(slots)), place(slots)
    if isinstance(where, slice):
        view = vector[where]
        return lambda: view.dot(zeros) == 0.0
    return lambda: vector.take(where).dot(zeros) == 0.0
