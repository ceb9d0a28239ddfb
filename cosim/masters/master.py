"""What every master is, and the block of rows that it fills."""

from collections.abc import Callable, Generator, Mapping, Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from cosim.masters.plan import Plan
from cosim.slaves.slave import Slave
from cosim.system.wiring import Wiring
from cosim.time import Schedule

FloatArray = NDArray[np.float64]


class Block:
    """Preallocated rows: `data` has shape (capacity, 1 + columns), time in s first; the first `count` rows are valid.

    A row counts only once it is complete, so that an interrupted step leaves no half row.
    """

    def __init__(self, capacity: int, columns: int) -> None:
        self.data: FloatArray = np.empty((capacity, 1 + columns))
        self.count = 0

    @property
    def full(self) -> bool:
        """Whether there is no room for another row."""
        return self.count == len(self.data)

    def append(self, time: float, row: FloatArray) -> None:
        """Add a row; `row` has shape (columns,)."""
        self.data[self.count, 0] = time
        self.data[self.count, 1:] = row
        self.count += 1


class Master(Protocol):
    """A master algorithm: settings, and two methods. Initialization is the same for all (initialization.py)."""

    def plan(self, wiring: Wiring, schedule: Schedule, record: Sequence[str], stop_when: str = "") -> Plan:
        """Turn a checked wiring into plain data; raises `CyclicOrder`, `NotSupported`, `UnknownName`."""
        ...

    def steps(
        self, plan: Plan, slaves: Mapping[str, Slave], values: FloatArray, block: Block, stop: Callable[[], bool]
    ) -> Generator[int]:
        """Run from the initialized slaves to the stop time.

        `values` are those of the plan's slots at the start. Rows go to `block`; the generator yields the number of
        finished steps whenever the caller may look: the block is full (the caller must empty it), about 0.1 s have
        passed, or the run ends. `stop` is asked between steps; the run ends early where it answers True, and where the
        plan's flag is up (`Plan.ends`). However it ends, the row of the last communication point reached is in the
        block.
        """
        ...
