"""What would help a flight that diverged: the same flight at shorter steps, up to a little past where it failed.

A step passes if the flight comes past that time, and is in size what it is at half that step (a flight that diverges
may be finite yet). Where none passes and all fail at one time, the exchange is not the reason.
"""

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction

from cosim.errors import SimulationError, StepFailed
from cosim.masters.error_controlled import ErrorControlled
from cosim.masters.exchange import name_of
from cosim.masters.explicit import Explicit
from cosim.masters.iterated import Iterated
from cosim.results.result import Result
from cosim.results.sizes import sizes, unlike
from cosim.system.system import Experiment, MasterSettings
from cosim.time import exact_seconds, in_words

PAST = Fraction(1, 10)
"""How much longer than the flight that failed a trial goes on, of its length."""

STEPS_PAST = 10
"""Steps that it goes on at least."""

WALL_TIME = 5.0
"""Seconds of wall time that all trials may take."""

ROWS = 100
"""Rows of a trial, about."""

HALVINGS = 3
ITERATED = "--master iterated (master=Iterated())"

SAME_TIME = 0.05
"""Failures whose times differ by no more than this part are one and the same."""


Look = Callable[[float, float], None]
Fly = Callable[[Experiment, Look], Result]
"""Flies an experiment in memory; the second argument is called some times a second."""


@dataclass(frozen=True)
class Attempt:
    """A trial: whether it came to its end, the time reached, s, and the largest size of every number recorded."""

    passed: bool
    reached: float
    sizes: Mapping[str, float] = field(default_factory=dict[str, float])


class _OutOfTime(Exception):
    """The trials have taken their time."""


def advise(failure: StepFailed, experiment: Experiment, master: MasterSettings, fly: Fly) -> None:
    """Say in a failure which exchange diverged and which step passes, where trials tell.

    Nothing is said where a unit is to blame, or where no trial can be flown.
    """
    if failure.grown and not failure.culprits and not isinstance(master, ErrorControlled):  # whose steps are its own
        start = exact_seconds(experiment.start_time, "start_time")
        stop = exact_seconds(experiment.stop_time, "stop_time")
        step = exact_seconds(experiment.communication_step_size, "communication_step_size")
        end = horizon(failure, start, stop, step)
        short = replace(experiment, stop_time=end, record=("*",))
        deadline = time.monotonic() + WALL_TIME
        own = isinstance(master, Explicit | Iterated)
        same = replace(master, kernel="auto") if own else master  # the same bits, sooner

        def attempt(at: Fraction, other: MasterSettings | None = None) -> Attempt | None:
            every = max(1, int((end - start) / at / ROWS))
            trial = replace(short, communication_step_size=at, every=every, master=other or same)
            return _attempt(trial, fly, deadline)

        def iterated() -> bool:
            """Whether the iterated master passes at the step that failed."""
            if not isinstance(master, Explicit):
                return False
            whole, half = attempt(step, Iterated()), attempt(step / 2, Iterated())
            if whole is None or half is None or not (whole.passed and half.passed):
                return False
            return not unlike(whole.sizes, half.sizes)

        failure.remedy = find(name_of(master), start, step, attempt, iterated)


def _attempt(experiment: Experiment, fly: Fly, deadline: float) -> Attempt | None:
    """Fly once; None where that cannot be, was interrupted, or takes too long."""

    def look(_now: float, _stop: float) -> None:
        if time.monotonic() > deadline:
            raise _OutOfTime

    try:
        result = fly(experiment, look)
    except SimulationError as error:
        reached = None if error.result is None else error.result.info["reached_time"]
        return None if reached is None else Attempt(False, reached)
    except (_OutOfTime, KeyboardInterrupt):
        return None
    if result.info["status"] != "finished":
        return None
    return Attempt(True, result.info["reached_time"], sizes(result))


def horizon(failure: StepFailed, start: Fraction, stop: Fraction, step: Fraction) -> Fraction:
    """Return the stop time of the trials, s: a little past the failure, in whole steps, or the flight's own."""
    flown = round((Fraction(failure.time) - start) / step) + 1
    past = max(int(PAST * flown), STEPS_PAST)
    return min(start + (flown + past) * step, stop)


def find(
    exchange: str,
    start: Fraction,
    step: Fraction,
    attempt: Callable[[Fraction], Attempt | None],
    iterated: Callable[[], bool],
) -> str:
    """Return in words what diverged at a step, s, and which step passes; "" where the trials tell nothing.

    `attempt` flies at a step; None: it could not, or has no time left. `iterated`: whether the iterated master passes.
    `start`: of the flight, s.
    """
    tried: dict[Fraction, Attempt] = {}
    for n in range(1, HALVINGS + 2):  # the last one only judges the one before
        here, before = step / 2**n, step / 2 ** (n - 1)
        made = attempt(here)
        if made is None:
            break
        if before in tried and tried[before].passed and made.passed and not unlike(tried[before].sizes, made.sizes):
            ways = f"--step {in_words(before).replace(' ', '')} (communication_step_size={_argument(before)})"
            return (
                f"{exchange} diverged at steps of {in_words(step)}; at {in_words(before)} the same flight passes "
                f"t = {tried[before].reached:.6g} s: {ways}{f', or {ITERATED}' if iterated() else ''}."
            )
        tried[here] = made
    if len(tried) < HALVINGS or any(made.passed for made in tried.values()):
        return ""
    times = [made.reached for made in tried.values()]
    steps = _listed([in_words(step) for step in tried])
    told = f"at steps of {steps} the same flight fails too, at {_listed([f'{t:.4g}' for t in times])} s"
    if max(times) - min(times) <= SAME_TIME * (max(times) - start):
        return f"{told}: the exchange is not the reason."
    passes = f"; {ITERATED} passes at {in_words(step)}" if iterated() else ""
    return f"{told}: {exchange} may need a shorter step still{passes}."


def _listed(texts: Sequence[str]) -> str:
    return f"{', '.join(texts[:-1])} and {texts[-1]}"


def _argument(step: Fraction) -> str:
    plain = float(step)
    return repr(plain) if Fraction(repr(plain)) == step else f"Fraction({step.numerator}, {step.denominator})"
