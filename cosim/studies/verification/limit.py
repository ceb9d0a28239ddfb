"""The largest step at which an exchange flies a system: doubled until it diverges, then bisected to two digits."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction

from cosim.studies.verification.trial import OutOfTime, Trial
from cosim.time import in_words

DIGITS = 2
"""To how many decimal digits the step is searched."""

FEWEST = 10
"""Steps of the shortest flight that is tried: fewer say nothing of a loop."""

INTERRUPTED = "the search was interrupted"


@dataclass(frozen=True)
class Limit:
    """`flies`: the largest step, s, that flew; `fails`: the least that did not, and `how`; None: none was found.

    `remark`: why the search ended before the two were neighbours of two digits.
    """

    flies: Fraction | None
    fails: Fraction | None
    how: str
    remark: str
    trials: int


class _Search:
    """The bracket of the search: the largest step that flies and the least that does not."""

    def __init__(self, attempt: Callable[[Fraction], Trial], flies: Fraction, failed: Trial | None) -> None:
        self._attempt, self.flies = attempt, flies
        self.fails = None if failed is None else failed.step
        self.how = "" if failed is None else failed.ended
        self.refusal, self.trials = "", 0

    def flew(self, step: Fraction) -> bool | None:
        """Try a step; None where the flight was refused before it began, which says nothing of the exchange."""
        trial = self._attempt(step)
        self.trials += 1
        if trial.interrupted:
            raise KeyboardInterrupt
        if trial.result is None:
            self.refusal = self.refusal or f"steps of {in_words(step)} are refused: {trial.ended}"
            return None
        if trial.finished:
            self.flies = step
        else:
            self.fails, self.how = step, trial.ended
        return trial.finished

    def double(self, longest: Fraction) -> None:
        """Double what flies until a flight diverges."""
        step = 2 * self.flies
        while self.fails is None and step <= longest:
            self.flew(step)
            step *= 2

    def bisect(self) -> None:
        """Halve the bracket until no step of two digits lies in it, or one there is refused."""
        while self.fails is not None:
            middle = rounded((self.flies + self.fails) / 2)
            if not self.flies < middle < self.fails or self.flew(middle) is None:
                return


def largest_step(
    attempt: Callable[[Fraction], Trial], flies: Fraction, failed: Trial | None, longest: Fraction
) -> Limit:
    """Search the largest step, s, that flies, from one that does and, where there is one, a flight that did not.

    `attempt` flies at a step, and raises `OutOfTime` to end the search.
    """
    search, remark = _Search(attempt, flies, failed), ""
    try:
        search.double(longest)
        search.bisect()
    except OutOfTime:
        remark = "the search ran out of its time"
    except KeyboardInterrupt:
        remark = INTERRUPTED
    if not remark and search.fails is None:
        remark = search.refusal or f"none diverges up to {in_words(longest)}, {FEWEST} steps of the flight"
    return Limit(search.flies, search.fails, search.how, remark or search.refusal, search.trials)


def rounded(step: Fraction) -> Fraction:
    """Return a step, s, rounded to DIGITS decimal digits."""
    unit = Fraction(10) ** (math.floor(math.log10(step)) - DIGITS + 1)
    return round(step / unit) * unit
