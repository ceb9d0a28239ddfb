"""What a master is made of: settings, an algorithm, a control. Layout, point, initialization are the same for all."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

from cosim.errors import StepFailed
from cosim.masters.layout import Layout
from cosim.masters.point import Part, Point
from cosim.masters.watch import Watch
from cosim.slaves.slave import Slave
from cosim.system.wiring import Wiring
from cosim.time import Schedule


@dataclass(frozen=True)
class Deviation:
    """By how much a variable, "plant.x", may be wrong after a step, and how much is allowed."""

    variable: str
    error: float
    allowed: float

    @property
    def size(self) -> float:
        """Of what is allowed, the part that it is wrong by."""
        return self.error / self.allowed


@dataclass(frozen=True)
class Outcome:
    """Where an algorithm came: the point, the largest deviation (None: it has no estimate), how often the FMUs stepped.

    `failure`: why it came nowhere, where a shorter step may; the point is then the one that it began at. `settle` must
    be called once with whether the step counts: where it does not, the FMUs go back to where it began.
    """

    point: Point
    deviation: Deviation | None = None
    evaluations: int = 1
    failure: StepFailed | None = None
    settle: Callable[[bool], None] = lambda counts: None


class Algorithm(Protocol):
    """Goes from one communication point to a later one.

    `records`: it writes the rows of the points that it passes itself, heeds the `Watch` that it was made with, and may
    come less far than asked. Another one goes to `until` and leaves rows to the loop.
    """

    @property
    def records(self) -> bool:
        """Whether it writes rows itself."""
        ...

    def advance(self, point: Point, until: int) -> Outcome:
        """Take the instances, which stand at `point`, towards communication point `until`; raises `StepFailed`."""
        ...


class Control(Part, Protocol):
    """Decides how far an algorithm goes, and whether its step counts; what it has counted is a part of the run."""

    def until(self, point: Point, last: int, *, far: bool) -> int:
        """Return the communication point to go to from here, `last` at most: an event waits there, or the end.

        `far`: as far as nothing is to be decided before.
        """
        ...

    def accepts(self, outcome: Outcome) -> bool:
        """Whether a step counts; one that does not is taken back, and a shorter one taken. Raises `StepFailed`."""
        ...

    def told(self) -> Mapping[str, Any]:
        """Return what run.json says of the steps taken, beyond what the experiment says."""
        ...


@dataclass(frozen=True)
class Flown:
    """Which loop flies a run: its name, and why it is not the kernel ("" if it is)."""

    name: str
    reason: str = ""


class Course(Protocol):
    """A master's settings applied to one wiring and one schedule: all that a flight needs beside instances."""

    @property
    def layout(self) -> Layout:
        """Where every value has its place."""
        ...

    @property
    def schedule(self) -> Schedule:
        """The communication points."""
        ...

    @property
    def order(self) -> Sequence[str]:
        """Instance names in stepping order."""
        ...

    def algorithm(self, slaves: Mapping[str, Slave], watch: Watch) -> tuple[Algorithm, Flown]:
        """Return the algorithm over some instances."""
        ...

    def control(self) -> Control:
        """Return the control of the steps."""
        ...


class Master(Protocol):
    """Settings of a master algorithm, a frozen dataclass."""

    def timed(self, wiring: Wiring) -> Wiring:
        """Return the wiring with the timings that this master flies."""
        ...

    def course(self, wiring: Wiring, schedule: Schedule, record: Sequence[str], stop_when: str = "") -> Course:
        """Apply the settings to a timed wiring; raises `CyclicOrder`, `WiringErrors`, `NotSupported`, `UnknownName`."""
        ...
