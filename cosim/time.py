"""Time is counted in integer nanoseconds; seconds exist only in the call of fmi2DoStep and in the recorded rows."""

import math
import re
from dataclasses import dataclass
from decimal import Decimal

from cosim.errors import TimeError

NANOSECONDS = 1_000_000_000
LARGEST = 2**62  # ns: the kernel counts in 64 bits, and a sum of two still fits
_UNITS = {"": "1", "s": "1", "ms": "1e-3", "us": "1e-6", "ns": "1e-9", "min": "60", "h": "3600"}
_DURATION = re.compile(r"^\s*([-+]?[0-9.]+(?:[eE][-+]?\d+)?)\s*([a-z]*)\s*$")


def instant_ns(seconds: float, name: str) -> int:
    """Return a point of time in ns.

    Raises `TimeError` if it is not finite or no whole nanosecond.
    """
    if isinstance(seconds, bool) or not math.isfinite(seconds):
        raise TimeError(name, seconds, "it must be a finite number of seconds")
    ns = Decimal(repr(float(seconds))) * NANOSECONDS
    if ns != ns.to_integral_value():
        raise TimeError(name, f"{seconds!r} s", "it is no whole number of nanoseconds")
    if abs(ns) > LARGEST:
        raise TimeError(name, f"{seconds!r} s", f"it is beyond {LARGEST / NANOSECONDS:.3g} s")
    return int(ns)


def to_ns(seconds: float, name: str) -> int:
    """Return a duration in ns.

    Raises `TimeError` if it is not positive, not finite or no whole nanosecond.
    """
    ns = instant_ns(seconds, name)
    if ns <= 0:
        raise TimeError(name, f"{seconds!r} s", "it must be positive")
    return ns


def to_seconds(ns: int) -> float:
    """Return ns as s: the one expression for it, in Python and in the kernel."""
    return ns / 1e9


def parse_seconds(text: str, name: str) -> float:
    """Read "1ms", "0.5 s", "2 min" or "200" (a plain number is seconds); the answer is in s.

    Raises `TimeError` for anything else.
    """
    match = _DURATION.match(text)
    if match is None or match[2] not in _UNITS:
        raise TimeError(name, repr(text), f"write a number and one of {', '.join(u for u in _UNITS if u)}")
    try:
        return float(Decimal(match[1]) * Decimal(_UNITS[match[2]]))
    except ArithmeticError as error:
        raise TimeError(name, repr(text), "it is no number") from error


@dataclass(frozen=True)
class Schedule:
    """The communication points of a run: start, start + step, ... , stop, all in ns; the last step may be shorter."""

    start: int
    stop: int
    step: int
    every: int = 1

    @classmethod
    def of(cls, start_time: float, stop_time: float, communication_step_size: float, every: int) -> "Schedule":
        """Count times given in s.

        Raises `TimeError` for what cannot be counted, for a stop before the start, and for `every` below 1.
        """
        start = instant_ns(start_time, "start_time")
        stop = instant_ns(stop_time, "stop_time")
        if stop <= start:
            raise TimeError("stop_time", f"{stop_time!r} s", f"it must be later than start_time, {start_time!r} s")
        if isinstance(every, bool) or int(every) != every or every < 1:
            raise TimeError("every", every, "it must be a whole number of steps, 1 or more")
        return cls(start, stop, to_ns(communication_step_size, "communication_step_size"), int(every))

    @property
    def steps(self) -> int:
        """Number of communication steps."""
        return -((self.start - self.stop) // self.step)

    def point(self, k: int) -> int:
        """Return the communication point k in ns, k = 0 ... steps."""
        return min(self.start + k * self.step, self.stop)

    def recorded(self, k: int) -> bool:
        """Whether the row of point k is recorded: each `every`-th, and the last."""
        return k % self.every == 0 or k == self.steps
