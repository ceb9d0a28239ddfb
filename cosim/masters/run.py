"""The one loop of every run: control, algorithm, what happens between steps, rows, looks. It knows no algorithm."""

from collections.abc import Generator
from typing import Protocol

from cosim.masters.master import Algorithm, Control
from cosim.masters.point import Point
from cosim.masters.watch import Clock, Watch


class Interludes(Protocol):
    """What happens to a run between two steps, each at a communication point (events.py)."""

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


NOTHING = Nothing()


def run(
    algorithm: Algorithm, control: Control, point: Point, watch: Watch, interludes: Interludes = NOTHING
) -> Generator[Point]:
    """Run on from a point until its end, the flag or the wish to stop; raises `StepFailed`, `ValueRefused`.

    Rows go to the watch's block. The generator yields the point reached whenever the caller may look: the first row is
    there, the block is full (the caller must empty it), about 0.1 s have passed, or the run ends. However it ends, the
    row of the last communication point reached is in the block; where something happens it shows what then holds.
    """
    if interludes.due(point):
        point = interludes.apply(point)
    watch.row(point)
    clock = Clock()
    try:
        yield point
        while not watch.ends(point):
            if watch.block.full or clock.is_due:
                yield point
                clock.looked()
            last = interludes.last(watch.schedule.steps)
            outcome = algorithm.advance(point, control.until(point, last, far=algorithm.records))
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
