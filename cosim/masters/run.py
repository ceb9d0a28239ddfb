"""The one loop of every run: control, algorithm, what happens between steps, rows, looks. It knows no algorithm."""

from collections.abc import Generator
from typing import Any, Protocol

from cosim.masters.master import Algorithm, Control
from cosim.masters.point import Part, Point
from cosim.masters.watch import Clock, Watch


class Interludes(Part, Protocol):
    """What happens to a run between two steps, each at a communication point (events.py).

    It is a part of the run that remembers what has happened; faults remember what they are made of besides.
    """

    def last(self, end: int) -> int:
        """Return the communication point that may be gone to: where the next one waits, else the end."""
        ...

    def due(self, point: Point) -> bool:
        """Whether one waits at a point."""
        ...

    def apply(self, point: Point) -> Point:
        """Let it happen, and return the point as it is then."""
        ...


class Nothing:
    """No interlude."""

    def last(self, end: int) -> int:
        """Return the end."""
        return end

    def due(self, point: Point) -> bool:
        """Whether one waits: never."""
        return False

    def apply(self, point: Point) -> Point:
        """Return the point as it is."""
        return point

    def memory(self) -> Any:
        """Return nothing."""
        return None

    def recall(self, memory: Any) -> None:
        """Remember nothing."""


NOTHING = Nothing()


def run(
    algorithm: Algorithm, control: Control, point: Point, watch: Watch, interludes: Interludes = NOTHING
) -> Generator[Point]:
    """Run on from a point until its end, the flag or the wish to stop; raises `StepFailed`, `ValueRefused`.

    Rows go to the watch's block. The generator yields the point reached whenever the caller may look: the first row is
    there, the block is full (the caller must empty it), about 0.1 s have passed, the watch's pause is reached, or the
    run ends. However it ends, the row of the last communication point reached is in the block; where something happens
    it shows what then holds. Between two steps the instances stand at the point.
    """
    if interludes.due(point):
        point = interludes.apply(point)
    watch.row(point)
    clock = Clock()
    try:
        yield point
        while not watch.ends(point):
            if watch.block.full or clock.is_due or point.index >= watch.pause:
                yield point
                clock.looked()
            last = interludes.last(watch.schedule.steps)
            until = control.until(point, last, far=algorithm.records)
            if algorithm.records:  # it takes many steps; how long one is must not depend on who looks
                until = min(until, max(watch.pause, point.index + 1))
            outcome = algorithm.advance(point, until)
            watch.evaluations += outcome.evaluations
            counts = False
            try:
                counts = control.accepts(outcome)
            finally:
                outcome.settle(counts)
            if counts:
                point = outcome.point
                if not algorithm.records:
                    watch.row(point)
                if interludes.due(point) and not watch.flag_is_up(point):
                    point = interludes.apply(point)
                    watch.again(point)
    finally:
        watch.row(point, whatever=True)
    yield point
