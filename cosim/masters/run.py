"""The one loop of every run: control, algorithm, rows, looks. It knows no algorithm."""

from collections.abc import Generator

from cosim.masters.master import Algorithm, Control
from cosim.masters.point import Point
from cosim.masters.watch import Clock, Watch


def run(algorithm: Algorithm, control: Control, point: Point, watch: Watch) -> Generator[Point]:
    """Run on from a point until its end, the flag or the wish to stop; raises `StepFailed`, `ValueRefused`.

    Rows go to the watch's block. The generator yields the point reached whenever the caller may look: the first row is
    there, the block is full (the caller must empty it), about 0.1 s have passed, or the run ends. However it ends, the
    row of the last communication point reached is in the block.
    """
    watch.row(point)
    clock = Clock()
    try:
        yield point
        while not watch.ends(point):
            if watch.block.full or clock.is_due:
                yield point
                clock.looked()
            outcome = algorithm.advance(point, control.until(point, far=algorithm.records))
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
    finally:
        watch.row(point, whatever=True)
    yield point
