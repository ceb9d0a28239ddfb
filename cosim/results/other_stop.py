"""Whether a run that goes on from a checkpoint may end at another time than it was begun with.

It may where every step up to the checkpoint is, to the bit, what it would have been with that stop time from the start
on. A stop time decides the last step, where it is no multiple of the step; that of slow components, which take several
at once; the last steps of the error-controlled master before it, and in which parts of a step it counts; and which
samples of a signal lie at communication points.
"""

from fractions import Fraction

import numpy as np

from cosim.masters.error_controlled import ErrorControlledCourse
from cosim.masters.master import Course
from cosim.system import feeds
from cosim.system.wiring import Wiring
from cosim.time import Schedule


def why_not(old: Course, new: Course, wiring: Wiring, own: tuple[Schedule, Schedule], k: int) -> str:
    """Return why a run of a course cannot go on from its point `k` as one of a new course; "" if it can.

    `own`: the experiment's schedules, with the old stop time and with the new one.
    """
    a, b = old.schedule, new.schedule
    if a.step_size != b.step_size:
        return f"steps would be counted in {b.step_size} s, they were in {a.step_size} s"
    time = Fraction(a.count(k), a.denominator)
    if k > b.steps or Fraction(b.count(k), b.denominator) != time:
        return f"the step before {float(time):.12g} s was shortened to end there"
    for name in wiring.fmus:
        n = wiring.period(name)
        if k % n and not (_whole(a, k - k % n + n) and _whole(b, k - k % n + n)):
            return f"{name} takes {n} steps at once, and is within its last, which the stop time shortens"
    if isinstance(new, ErrorControlledCourse):
        for schedule in (a, b):
            last = schedule.steps - schedule.steps % schedule.every
            if last < k and _end(schedule) % (schedule.step_size * schedule.every):
                return f"the steps from {schedule.time(last):.12g} s on were chosen to end at the stop time"
    for feed in wiring.feeds.values():
        for (knots, before), (others, after) in zip(*(feeds.pieces(feed, s) for s in own), strict=True):
            i = int(np.searchsorted(knots, float(time)))
            if knots[: i + 1].tobytes() != others[: i + 1].tobytes() or before[:i].tobytes() != after[:i].tobytes():
                return f"a sample of a signal of {feed.component} lies at another communication point"
    return ""


def _end(schedule: Schedule) -> Fraction:
    """Return how long the run is, s."""
    return Fraction(schedule.stop - schedule.start, schedule.denominator)


def _whole(schedule: Schedule, k: int) -> bool:
    """Whether point k is there, and not brought forward by the stop time."""
    return k <= schedule.steps and (k < schedule.steps or not _end(schedule) % schedule.step_size)
