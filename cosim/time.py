"""Time is counted: every communication point is a whole number of one unit, 1/denominator s; seconds are its quotient.

t_k = (start + k step) / denominator in whole numbers, rounded once to a double, so that a step of 1/30 s is as exact
as one of 1 ms; the h of fmi2DoStep is t_k+1 - t_k in doubles, so that t + h is the next t.
"""

import math
import re
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property

from cosim.errors import TimeError
from cosim.quantity import split_quantity

Seconds = float | Fraction
"""A time as a user gives it: a float, or a Fraction where no float is exact."""

NANOSECONDS = 1_000_000_000
LARGEST_DENOMINATOR = NANOSECONDS
LARGEST_GUESS = 100_000
"""The largest denominator that is guessed from a float: a float near 1 s is one of its fractions by chance in 1e7."""

ROUNDINGS = 4
"""How many units in the last place a computed float may be off the decimal that is meant, as 0.1 + 0.2 is."""

LARGEST_COUNT = 2**53
"""Whole numbers up to it are doubles, so that the quotient of two is rounded once, in Python and in the kernel."""

LARGEST_INTEGER = 2**62
"""What the kernel can count: 64 bits, and a sum of two still fits."""

_UNITS = {"s": "1", "ms": "1/1000", "us": "1/1000000", "ns": "1/1000000000", "min": "60", "h": "3600"}
_FRACTION = re.compile(r"^\s*([-+]?\d+)\s*/\s*(\d+)(.*)$", re.DOTALL)


def exact_seconds(seconds: Seconds, name: str) -> Fraction:
    """Return a time in s as the fraction that is meant: decimals to the nanosecond, or a fraction like 1/30.

    Raises `TimeError` if it is not finite or no such number.
    """
    if isinstance(seconds, bool) or not math.isfinite(seconds):
        raise TimeError(name, f"{seconds!r}", "it must be a finite number of seconds")
    if isinstance(seconds, Fraction | int):
        exact = Fraction(seconds)
        if exact.denominator > LARGEST_DENOMINATOR:
            raise TimeError(name, f"{exact} s", f"its denominator is above {LARGEST_DENOMINATOR}")
        return exact
    exact = Fraction(repr(float(seconds)))
    if NANOSECONDS % exact.denominator == 0:
        return exact
    guess = Fraction(float(seconds)).limit_denominator(LARGEST_GUESS)
    if float(guess) == seconds:
        return guess
    nearest = Fraction(round(exact * NANOSECONDS), NANOSECONDS)
    if abs(float(nearest) - seconds) <= ROUNDINGS * math.ulp(seconds):
        return nearest
    problem = f"it is no whole number of nanoseconds, and no fraction with a denominator up to {LARGEST_GUESS}"
    raise TimeError(name, f"{seconds!r} s", problem)


def parse_seconds(text: str, name: str) -> Seconds:
    """Read "1ms", "0.5 s", "2 min", "1/30 s" or "200" (a plain number is seconds); the answer is in s.

    Raises `TimeError` for anything else.
    """
    known = f"write a number and one of {', '.join(_UNITS)}"
    fraction = _FRACTION.match(text)
    if fraction is not None:
        number, unit = f"{fraction[1]}/{fraction[2]}", fraction[3].strip()
    else:
        number, unit = split_quantity(text) or ("", "?")
    if (unit or "s") not in _UNITS:
        raise TimeError(name, repr(text), known)
    try:
        exact = Fraction(number) * Fraction(_UNITS[unit or "s"])
        plain = float(exact)
    except (ValueError, ZeroDivisionError, OverflowError) as error:
        raise TimeError(name, repr(text), "it is no number") from error
    return plain if Fraction(repr(plain)) == exact else exact


@dataclass(frozen=True)
class Schedule:
    """The communication points of a run: start, start + step, ..., stop; the last step may be shorter.

    `start`, `stop` and `step` count units of 1/`denominator` s; each `every`-th point is recorded, and the last.
    """

    start: int
    stop: int
    step: int
    denominator: int
    every: int = 1

    @classmethod
    def of(cls, start_time: Seconds, stop_time: Seconds, communication_step_size: Seconds, every: int) -> "Schedule":
        """Count times given in s.

        Raises `TimeError` for what cannot be counted, for a stop before the start, and for `every` below 1.
        """
        start, stop = exact_seconds(start_time, "start_time"), exact_seconds(stop_time, "stop_time")
        step = exact_seconds(communication_step_size, "communication_step_size")
        if step <= 0:
            raise TimeError("communication_step_size", f"{communication_step_size!r} s", "it must be positive")
        if stop <= start:
            raise TimeError("stop_time", f"{stop_time!r} s", f"it must be later than start_time, {start_time!r} s")
        whole = not isinstance(every, bool) and int(every) == every
        if not whole or not 1 <= every <= LARGEST_INTEGER:
            raise TimeError("every", every, f"it must be a whole number of steps, 1 to {LARGEST_INTEGER}")
        unit = math.lcm(start.denominator, stop.denominator, step.denominator)
        for name, value in (("start_time", start), ("stop_time", stop), ("communication_step_size", step)):
            if abs(value) * unit > LARGEST_COUNT or unit > LARGEST_COUNT:
                problem = f"it is beyond what can be counted in units of 1/{unit} s, {LARGEST_COUNT / unit:.3g} s"
                raise TimeError(name, f"{float(value):g} s", problem)
        finest = max(math.ulp(float(start)), math.ulp(float(stop)))
        if step < finest:
            value = f"{float(step):g} s"
            problem = f"a double at {float(stop):.12g} s tells apart no steps below {finest:.3g} s"
            raise TimeError("communication_step_size", value, problem)
        return cls(int(start * unit), int(stop * unit), int(step * unit), unit, int(every))

    @cached_property
    def steps(self) -> int:
        """Number of communication steps."""
        return -((self.start - self.stop) // self.step)

    def count(self, k: int) -> int:
        """Return the communication point k = 0 ... steps in units of 1/denominator s."""
        return min(self.start + k * self.step, self.stop)

    def time(self, k: int) -> float:
        """Return the communication point k in s, rounded once."""
        return self.count(k) / self.denominator

    def recorded(self, k: int) -> bool:
        """Whether the row of point k is recorded: each `every`-th, and the last."""
        return k % self.every == 0 or k == self.steps

    @property
    def step_size(self) -> Fraction:
        """The communication step, s."""
        return Fraction(self.step, self.denominator)
