"""What is watched while a run goes on: the rows, the flag that ends it, the wish to stop, the clock."""

import ctypes
import sys
import time
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from cosim.arrays import FloatArray
from cosim.masters.columns import FLAG
from cosim.masters.layout import Layout
from cosim.masters.point import Point
from cosim.time import Schedule

LINE = 8
"""Values in a line of the cache, 64 bytes."""

LOOK = 0.1
"""Seconds of wall time after which whoever flies a run gets a look at it."""


class Block:
    """Preallocated rows: `data` has shape (capacity, 1 + columns), time in s first; the first `count` rows are valid.

    A row counts only once it is complete, so that an interrupted step leaves no half row. The kernel counts too, at
    `count_address`. The values of a column stand side by side, as results have them, `stride` values before those of
    the next: an odd number of cache lines, so that a row's values share none of the cache's places.
    """

    def __init__(self, capacity: int, columns: int) -> None:
        self.stride = LINE * (-(-capacity // LINE) | 1)
        self.columns: FloatArray = np.empty((1 + columns, self.stride))[:, :capacity]
        self.data: FloatArray = self.columns.T
        self._count = ctypes.c_longlong()
        self.count_address = ctypes.addressof(self._count)

    @property
    def count(self) -> int:
        """Number of complete rows."""
        return self._count.value

    @count.setter
    def count(self, count: int) -> None:
        self._count.value = count

    @property
    def full(self) -> bool:
        """Whether there is no room for another row."""
        return self.count == len(self.data)

    def append(self, time: float, row: FloatArray) -> None:
        """Add a row; `row` has shape (columns,)."""
        self.data[self.count, 0] = time
        self.data[self.count, 1:] = row
        self.count += 1


@dataclass
class Watch:
    """Rows and ends of one run. `evaluations`: how often its FMUs have stepped, of loops where steps are repeated.

    `stop` is a flag in memory that a thread may set and the kernel reads: not 0, stop. `pause`: the communication point
    at which whoever flies the run gets a look at it, or the first one after that where steps are longer.
    """

    layout: Layout
    schedule: Schedule
    block: Block
    stop: ctypes.c_int = field(default_factory=ctypes.c_int)
    last_row: int = -1
    evaluations: int = 0
    pause: int = sys.maxsize

    def memory(self) -> Any:
        """Return how often the FMUs have stepped; see `Part`."""
        return self.evaluations

    def recall(self, memory: Any) -> None:
        """Count on from there."""
        self.evaluations = memory

    def row(self, point: Point, *, whatever: bool = False) -> None:
        """Record a point if it is to be recorded, `whatever` the schedule says if asked so, and once only."""
        if (whatever or self.schedule.recorded(point.index)) and point.index != self.last_row:
            self.block.append(self.schedule.time(point.index), self.layout.columns.row(point.values))
            self.last_row = point.index

    def write(self, index: int, row: FloatArray) -> None:
        """Record communication point `index`; `row`: its row, time first."""
        count = self.block.count
        self.block.data[count] = row
        self.block.count = count + 1
        self.last_row = index

    def again(self, point: Point) -> None:
        """Record a point once more, in place of its row, which is the last and not yet taken."""
        if self.last_row == point.index and self.block.count:
            self.block.count -= 1
        self.last_row = -1
        self.row(point)

    def ends(self, point: Point) -> bool:
        """Whether a run that stands at a point goes no further."""
        return point.index >= self.schedule.steps or bool(self.stop.value) or self.flag_is_up(point)

    def flag_is_up(self, point: Point) -> bool:
        """Whether the flag that ends the run is up at a point."""
        return self.is_up(point.values)

    def is_up(self, values: FloatArray) -> bool:
        """Whether it is, by the values of all slots."""
        slot = self.layout.stop_slot
        return slot >= 0 and bool(values[slot] > FLAG)


class Clock:
    """Says when it is time for a look."""

    def __init__(self) -> None:
        self._next = time.perf_counter() + LOOK

    @property
    def is_due(self) -> bool:
        """Whether LOOK has passed since the last look."""
        return time.perf_counter() > self._next

    def looked(self) -> None:
        """Begin anew."""
        self._next = time.perf_counter() + LOOK
