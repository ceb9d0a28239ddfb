"""Time is counted: every communication point is a whole number of one unit, 1/denominator s; seconds are its quotient.

t_k = (start + k step) / denominator in whole numbers, rounded once to a double, so that a step of 1/30 s is as exact
as one of 1 ms; the h of fmi2DoStep is t_k+1 - t_k in doubles, so that t + h is the next t.
"""

import math
import re
from bisect import bisect_left, bisect_right
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property, lru_cache
from numbers import Real

import numpy as np

from cosim.errors import TimeError
from cosim.quantity import split_quantity

Seconds = float | Fraction
"""A time as a user gives it: a float, or a Fraction where no float is exact."""

NANOSECONDS = 1_000_000_000
LARGEST_DENOMINATOR = NANOSECONDS
LARGEST_GUESS = 100_000
"""The largest denominator that is guessed from a float."""

BY_CHANCE = 1e-4
"""A fraction is what is meant where a number at random has one as simple, and as near, more seldom than this."""

ROUNDINGS = 4
"""How many units in the last place a computed float may be off the number that is meant, as 0.1 + 0.2 is."""

LARGEST_COUNT = 2**53
"""Whole numbers up to it are doubles, so that the quotient of two is rounded once, in Python and in the kernel."""

LARGEST_INTEGER = 2**62
"""What the kernel can count: 64 bits, and a sum of two still fits."""

UNITS = {"s": "1", "ms": "1/1000", "us": "1/1000000", "ns": "1/1000000000", "min": "60", "h": "3600"}
"""Units of time, each in s."""
_FRACTION = re.compile(r"^\s*([-+]?\d+)\s*/\s*(\d+)(.*)$", re.DOTALL)


def exact_seconds(seconds: Seconds, name: str) -> Fraction:
    """Return a time in s as the number that is meant: a fraction like 1/30, or a decimal to the nanosecond.

    A float may be off it by some roundings of its own precision: 0.1 + 0.2 and np.float32(0.1) are decimals.
    Raises `TimeError` if it is not finite or no such number.
    """
    if isinstance(seconds, bool) or not isinstance(seconds, Real) or not math.isfinite(seconds):
        raise TimeError(name, f"{seconds!r}", "it must be a finite number of seconds")
    return _exact(seconds, name)


@lru_cache(typed=True)  # flights of one system have the same times
def _exact(seconds: Seconds, name: str) -> Fraction:
    if isinstance(seconds, Fraction | int):
        exact = Fraction(seconds)
        if exact.denominator > LARGEST_DENOMINATOR:
            raise TimeError(name, f"{exact} s", f"its denominator is above {LARGEST_DENOMINATOR}", _offer(exact))
        return exact
    coarse = isinstance(seconds, np.floating) and seconds.itemsize < 8  # float32 and float16
    given = seconds if coarse else float(seconds)
    value, roundings = Fraction(float(given)), ROUNDINGS * Fraction(float(np.spacing(abs(given))))
    fraction = _fraction(value, roundings)
    if fraction is not None:
        return fraction
    shortest = Fraction(str(given))
    if NANOSECONDS % shortest.denominator == 0:
        return shortest
    whole = _whole_nanoseconds(value)
    if abs(whole - value) <= roundings:
        return whole
    problem = f"it is no whole number of nanoseconds, and no fraction with a denominator up to {LARGEST_GUESS}"
    raise TimeError(name, f"{given} s", problem, _offer(value))


def _fraction(value: Fraction, roundings: Fraction) -> Fraction | None:
    """Return the simplest fraction that is as near to a value as some roundings; None if that may be by chance."""
    simplest = _simplest(abs(value) - roundings, abs(value) + roundings)
    # Of the fractions with denominators up to q, a stretch of length d has some 0.3 q^2 d (3 / pi^2, Farey).
    seldom = 0.3 * simplest.denominator**2 * 2 * roundings <= BY_CHANCE
    return (simplest if value > 0 else -simplest) if seldom and simplest.denominator <= LARGEST_GUESS else None


def _simplest(low: Fraction, high: Fraction) -> Fraction:
    """Return the fraction with the smallest denominator in [low, high]."""
    above, below = math.ceil(low), math.floor(low)
    return Fraction(above) if above <= high else below + 1 / _simplest(1 / (high - below), 1 / (low - below))


def _whole_nanoseconds(value: Fraction) -> Fraction:
    return Fraction(round(value * NANOSECONDS), NANOSECONDS)


def _offer(value: Fraction) -> str:
    """Return the time that would do in place of one: a fraction within half a nanosecond, else whole nanoseconds."""
    nearest = _fraction(value, Fraction(1, 2 * NANOSECONDS)) or _whole_nanoseconds(value)
    nearest = nearest or Fraction(1 if value > 0 else -1, NANOSECONDS)
    return written(nearest)


def written(seconds: Fraction) -> str:
    """Return a time in s as it may be typed: "0.3 s", "1/30 s"."""
    if NANOSECONDS % seconds.denominator:
        return f"{seconds} s"
    return f"{np.format_float_positional(float(seconds), trim='-')} s"


def in_words(seconds: Fraction) -> str:
    """Return a time in s in the unit in which it is a short number: "2 ms", "0.5 ms", "12 us", "1/30 s"."""
    for unit, factor in (("s", 1), ("ms", 1_000), ("us", 1_000_000), ("ns", NANOSECONDS)):
        if abs(seconds) * factor >= (1 if factor == 1 else Fraction(1, 10)) and NANOSECONDS % seconds.denominator == 0:
            return f"{np.format_float_positional(float(seconds * factor), trim='-')} {unit}"
    return f"{seconds} s"


def parse_seconds(text: str, name: str) -> Seconds:
    """Read "1ms", "0.5 s", "2 min", "1/30 s" or "200" (a plain number is seconds); the answer is in s.

    Raises `TimeError` for anything else.
    """
    known = f"write a number and one of {', '.join(UNITS)}"
    fraction = _FRACTION.match(text)
    if fraction is not None:
        number, unit = f"{fraction[1]}/{fraction[2]}", fraction[3].strip()
    else:
        number, unit = split_quantity(text) or ("", "?")
    if (unit or "s") not in UNITS:
        raise TimeError(name, repr(text), known)
    try:
        exact = Fraction(number) * Fraction(UNITS[unit or "s"])
        plain = float(exact)
    except (ValueError, ZeroDivisionError, OverflowError) as error:
        raise TimeError(name, repr(text), "it is no number") from error
    typed = fraction is not None or exact.denominator <= LARGEST_DENOMINATOR  # else of more digits than it means
    return exact if typed and Fraction(repr(plain)) != exact else plain


@dataclass(frozen=True)
class Schedule:
    """The communication points of a run: start, start + step, ..., stop; the last step may be shorter.

    `start`, `stop` and `step` count units of 1/`denominator` s; each `every`-th point is recorded, and the last.
    `events` are counts too, each once, in their order: communication points that are recorded. Where one lies within a
    step, that step is divided there, and the points after it stay where they were.
    """

    start: int
    stop: int
    step: int
    denominator: int
    every: int = 1
    events: tuple[int, ...] = ()

    @classmethod
    def of(
        cls,
        start_time: Seconds,
        stop_time: Seconds,
        communication_step_size: Seconds,
        every: int,
        events: Sequence[Seconds] = (),
    ) -> "Schedule":
        """Count times given in s.

        Raises `TimeError` for what cannot be counted, for a stop before the start, events not between them, and for
        `every` below 1.
        """
        at = sorted({exact_seconds(time, "the time of an event") for time in events})
        start, stop = exact_seconds(start_time, "start_time"), exact_seconds(stop_time, "stop_time")
        step = exact_seconds(communication_step_size, "communication_step_size")
        if step <= 0:
            raise TimeError("communication_step_size", f"{communication_step_size!r} s", "it must be positive")
        if stop <= start:
            raise TimeError("stop_time", f"{stop_time!r} s", f"it must be later than start_time, {start_time!r} s")
        whole = not isinstance(every, bool) and int(every) == every
        if not whole or not 1 <= every <= LARGEST_INTEGER:
            raise TimeError("every", every, f"it must be a whole number of steps, 1 to {LARGEST_INTEGER}")
        for time in at:
            if not start <= time < stop:
                problem = f"it must be from start_time, {written(start)}, on and before stop_time, {written(stop)}"
                raise TimeError("the time of an event", written(time), problem)
        unit = math.lcm(*(time.denominator for time in (start, stop, step, *at)))
        for name, value in (("start_time", start), ("stop_time", stop), ("communication_step_size", step)):
            if abs(value) * unit > LARGEST_COUNT or unit > LARGEST_COUNT:
                problem = f"it is beyond what can be counted in units of 1/{unit} s, {LARGEST_COUNT / unit:.3g} s"
                raise TimeError(name, f"{float(value):g} s", problem)
        finest = max(math.ulp(float(start)), math.ulp(float(stop)))
        if step < finest:
            value = f"{float(step):g} s"
            problem = f"a double at {float(stop):.12g} s tells apart no steps below {finest:.3g} s"
            raise TimeError("communication_step_size", value, problem)
        counts = tuple(int(time * unit) for time in at)
        return cls(int(start * unit), int(stop * unit), int(step * unit), unit, int(every), counts)

    @cached_property
    def steps(self) -> int:
        """Number of communication steps."""
        return -((self.start - self.stop) // self.step) + len(self.dividing)

    @cached_property
    def dividing(self) -> tuple[int, ...]:
        """The events that lie within steps, counts."""
        return tuple(event for event in self.events if (event - self.start) % self.step)

    @cached_property
    def divided_at(self) -> tuple[int, ...]:
        """The communication points that these are."""
        return tuple((event - self.start) // self.step + 1 + i for i, event in enumerate(self.dividing))

    @cached_property
    def event_points(self) -> tuple[int, ...]:
        """The communication points of all events, in their order."""
        return tuple((e - self.start - 1) // self.step + 1 + bisect_left(self.dividing, e) for e in self.events)

    @cached_property
    def points_of_events(self) -> Mapping[Fraction, int]:
        """The same by their times, s."""
        times = (Fraction(event, self.denominator) for event in self.events)
        return dict(zip(times, self.event_points, strict=True))

    def divided(self, n: int) -> "Schedule":
        """Return the schedule in steps of 1/n, the same times recorded; raises `TimeError` if it cannot be counted."""
        unit = n // math.gcd(n, self.step)
        start, stop, denominator = self.start * unit, self.stop * unit, self.denominator * unit
        step = self.step * unit // n
        finest = max(math.ulp(start / denominator), math.ulp(stop / denominator))
        if max(abs(start), abs(stop), denominator) > LARGEST_COUNT or step / denominator < finest:
            value = f"{step / denominator:.3g} s"
            raise TimeError("least_step", value, f"times up to {self.time(self.steps):.12g} s cannot be counted in it")
        return Schedule(start, stop, step, denominator, self.every * n, tuple(event * unit for event in self.events))

    def count(self, k: int) -> int:
        """Return the communication point k = 0 ... steps in units of 1/denominator s."""
        if self.dividing:
            i = bisect_left(self.divided_at, k)
            if i < len(self.divided_at) and self.divided_at[i] == k:
                return self.dividing[i]
            k -= i
        return min(self.start + k * self.step, self.stop)

    def time(self, k: int) -> float:
        """Return the communication point k in s, rounded once."""
        return self.count(k) / self.denominator

    def reached(self, seconds: Fraction) -> int:
        """Return the first communication point that is not before a time, s; beyond the stop `steps` + 1."""
        return bisect_left(range(self.steps + 1), seconds * self.denominator, key=self.count)

    def recorded(self, k: int) -> bool:
        """Whether the row of point k is recorded: each `every`-th, those of events, and the last."""
        if k == self.steps or k in self.event_points:
            return True
        return (k - bisect_left(self.divided_at, k)) % self.every == 0

    def next_recorded(self, k: int) -> int:
        """Return the first point after k whose row is recorded; k is before the last."""
        if self.every == 1:
            return k + 1
        on_grid = k - bisect_right(self.divided_at, k)  # the last point of the undivided steps up to k
        found = (on_grid // self.every + 1) * self.every
        for divided in self.divided_at:
            found += divided <= found
        event = bisect_right(self.event_points, k)
        return min(found, self.steps, *self.event_points[event : event + 1])

    @property
    def step_size(self) -> Fraction:
        """The communication step, s."""
        return Fraction(self.step, self.denominator)
