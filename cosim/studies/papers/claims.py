"""A paper's claims as functions of runs: the verdict follows from measured figures by a stated criterion.

A claim is split into parts that are true or false of the runs (an axis, a threshold). All true: reproduced. None:
not reproduced. Else: partly. Nothing here is written down as a verdict.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from cosim.arrays import BoolArray
from cosim.errors import UnknownName
from cosim.results.result import Result

Outcome = Literal["reproduced", "partly", "not reproduced", "not judged"]
AXES = ("roll", "pitch", "yaw")


@dataclass(frozen=True)
class Measured:
    """What runs show: the figures as text, and each part of the claim -> whether it holds."""

    text: str
    holds: Mapping[str, bool]


Measure = Callable[[Mapping[str, Result]], Measured]
"""A function of the runs by experiment name."""


@dataclass(frozen=True, kw_only=True)
class Claim:
    """One sentence of a paper, the number it gives, the experiments it takes and the criterion that decides it.

    `runs` are experiments by name; every one has to reach `until` (s; of each run, where they differ) or the event that
    ends it. `criterion` says what `measure` tests, in words.
    """

    paper: str
    text: str
    paper_number: str
    criterion: str
    runs: Sequence[str]
    until: float | Mapping[str, float]
    measure: Measure

    def judge(self, runs: Mapping[str, Result]) -> "Verdict":
        """Measure and judge; a claim whose runs are missing or too short is "not judged" and says why."""
        lacking = self.lacking(runs)
        if lacking:
            return self._verdict(lacking, "not judged")
        try:
            measured = self.measure(runs)
        except UnknownName as error:
            return self._verdict(f"a variable is missing: {error}", "not judged")
        return self._verdict(measured.text, decide(measured.holds), measured.holds)

    def lacking(self, runs: Mapping[str, Result]) -> str:
        """Return what is missing for a judgement, "" if nothing."""
        absent = [name for name in self.runs if name not in runs]
        if absent:
            return "needs " + ", ".join(absent)
        for name in self.runs:
            time = runs[name].time
            if runs[name].info.get("event"):
                continue  # it ended where it was to end
            until = self.until[name] if isinstance(self.until, Mapping) else self.until
            if not len(time) or time[-1] < until - 1e-9:
                end = f"{time[-1]:g} s" if len(time) else "no row"
                return f"needs {until:g} s of {name}, it has {end}"
        return ""

    def _verdict(self, measured: str, verdict: Outcome, holds: Mapping[str, bool] | None = None) -> "Verdict":
        return Verdict(self.paper, self.text, self.paper_number, measured, verdict, self.criterion, holds or {})


@dataclass(frozen=True)
class Verdict:
    """A row of the claims table; `holds` shows which part of the claim failed."""

    paper: str
    claim: str
    said: str
    measured: str
    verdict: Outcome
    criterion: str = ""
    holds: Mapping[str, bool] | None = None


def decide(holds: Mapping[str, bool]) -> Outcome:
    """Return the verdict of the parts of a claim."""
    if not holds:
        return "not judged"
    return "reproduced" if all(holds.values()) else "partly" if any(holds.values()) else "not reproduced"


def judge(claims: Iterable[Claim], runs: Mapping[str, Result]) -> list[Verdict]:
    """Return the verdict of every claim."""
    return [claim.judge(runs) for claim in claims]


def per_axis(values: Iterable[float], holds: Callable[[float], bool], what: str = "") -> dict[str, bool]:
    """Return {"roll": holds(roll), ...} of three values; `what` makes the parts of one claim distinct."""
    return {f"{what} {axis}".strip(): bool(holds(value)) for axis, value in zip(AXES, values, strict=True)}


def format_all(values: Iterable[float], digits: int = 3) -> str:
    """Return figures as "0.0025 / 0.0025 / 0.0025"."""
    return " / ".join(f"{value:.{digits}g}" for value in values)


def window(run: Result, begin: float, end: float = np.inf) -> BoolArray:
    """Return which rows lie in [begin, end] s."""
    return (run.time >= begin - 1e-9) & (run.time <= end + 1e-9)
