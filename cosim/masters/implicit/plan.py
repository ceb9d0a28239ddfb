"""What the iterated master does in a step, as plain numbers: its stages, and of each loop the unknowns.

The unknowns of a loop are the values at the end of the step of the outputs that are cut (cut.py), and with smooth
inputs their slopes. Between steps a loop remembers (`Memory`) what it has learned of itself.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cosim.arrays import BoolArray, FloatArray, IntArray
from cosim.masters.implicit import sensitivity
from cosim.masters.implicit.cut import Stage
from cosim.masters.implicit.sensitivity import Member
from cosim.masters.layout import Layout
from cosim.masters.turns import Turns
from cosim.system.wiring import Wiring


@dataclass(frozen=True)
class Loop:
    """Components, by the places of their turns, that are repeated until their unknowns agree; arrays of shape (n,).

    `slots`: of the unknowns, values first. `value`: for each the place of its value among them; `slope`: which are
    slopes. `nominal`: of the values. `partner`: for each value the place of its slope among the unknowns, -1: none.
    `memory`: its part of `Point.memory`. `names`: of the outputs. `members`: for the Jacobian, none where it is made
    by differences.
    """

    turns: tuple[int, ...]
    slots: IntArray
    value: IntArray
    slope: BoolArray
    nominal: FloatArray
    partner: IntArray
    memory: slice
    names: tuple[str, ...]
    members: tuple[Member, ...]

    @property
    def size(self) -> int:
        """How many unknowns there are."""
        return len(self.slots)


@dataclass(frozen=True)
class Memory:
    """What a loop has learned, views of a part of `Point.memory`; `step` of the last step, s, 0: there was none.

    `before`: the unknowns at its start, shape (n,). `jacobian`: of the residual, shape (n, n); `known`: whether it is.
    """

    array: FloatArray
    size: int

    @staticmethod
    def length(n: int) -> int:
        """Return how many numbers n unknowns need."""
        return 2 + n + n * n

    @property
    def step(self) -> float:
        """Length of the last step, s; 0: there was none."""
        return float(self.array[0])

    @property
    def known(self) -> bool:
        """Whether the Jacobian is known."""
        return bool(self.array[1])

    @property
    def before(self) -> FloatArray:
        """The unknowns at the start of the last step."""
        return self.array[2 : 2 + self.size]

    @property
    def jacobian(self) -> FloatArray:
        """The Jacobian of the residual."""
        return self.array[2 + self.size :].reshape(self.size, self.size)

    def learn(self, step: float, before: FloatArray, jacobian: FloatArray) -> None:
        """Keep what a step has shown."""
        self.array[:2] = step, 1.0
        self.before[:] = before
        self.jacobian[:] = jacobian


@dataclass(frozen=True)
class Plan:
    """The stages of a step: turns that are taken once, and loops, in their order; `memory`: how long it is."""

    turns: Turns
    stages: tuple[int | Loop, ...]
    memory: int

    @property
    def loops(self) -> tuple[Loop, ...]:
        """The stages that are repeated."""
        return tuple(stage for stage in self.stages if isinstance(stage, Loop))

    @classmethod
    def of(cls, wiring: Wiring, turns: Turns, stages: Sequence[Stage]) -> "Plan":
        """Number the members and unknowns of the stages; the turns are in their order."""
        found: list[int | Loop] = []
        place, memory = 0, 0
        for stage in stages:
            members = tuple(range(place, place + len(stage.members)))
            place += len(members)
            if not stage.cut:
                found += members
                continue
            loop = _loop(wiring, turns.layout, members, stage, memory)
            memory = loop.memory.stop
            found.append(loop)
        return cls(turns, tuple(found), memory)


def _loop(wiring: Wiring, layout: Layout, members: tuple[int, ...], stage: Stage, first: int) -> Loop:
    values = [layout.slots[port] for port in stage.cut]
    sloping = [port for port in stage.cut if (port, 1) in layout.derivative_slots]
    n = len(values) + len(sloping)
    nominal = [abs(wiring.variable(port).nominal) or 1.0 for port in (*stage.cut, *sloping)]
    partner = [len(values) + sloping.index(port) if port in sloping else -1 for port in stage.cut]
    return Loop(
        turns=members,
        slots=np.array([*values, *(layout.derivative_slots[port, 1] for port in sloping)], dtype=np.int64),
        value=np.array([*range(len(values)), *(stage.cut.index(port) for port in sloping)], dtype=np.int64),
        slope=np.array([False] * len(values) + [True] * len(sloping), dtype=np.bool_),
        nominal=np.array(nominal, dtype=np.float64),
        partner=np.array(partner, dtype=np.int64),
        memory=slice(first, first + Memory.length(n)),
        names=tuple(map(str, (*stage.cut, *sloping))),
        members=sensitivity.members(wiring, layout, stage.members),
    )
