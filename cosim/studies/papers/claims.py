"""A paper's claims as functions of runs: the verdict follows from measured figures by a stated criterion.

A claim is split into parts that are true or false of the runs (an axis, a threshold). All true: reproduced. None:
not reproduced. Else: partly, and the parts that fail are named. Where the paper leaves something open, the claim is
judged in each reading, the most literal one first: reproduced where it is in all of them, "in one reading" where it is
in some, which are named, else by all parts together. Nothing here is written down as a verdict.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any, Literal

import numpy as np

from cosim.arrays import BoolArray
from cosim.errors import UnknownName
from cosim.results.result import Result

Outcome = Literal["reproduced", "in one reading", "partly", "not reproduced", "not judged"]
AXES = ("roll", "pitch", "yaw")


@dataclass(frozen=True)
class Measured:
    """What runs show: the figures as text, and each part of the claim -> whether it holds."""

    text: str
    holds: Mapping[str, bool]


Readings = Mapping[str, Measured]
"""What runs show in each reading of a claim, by the reading's name; "" where there is but one."""
Measure = Callable[[Mapping[str, Result]], Measured | Readings]
"""A function of the runs by experiment name."""


@dataclass(frozen=True, kw_only=True)
class Claim:
    """One sentence of a paper, the number it gives, the experiments it takes and the criterion that decides it.

    `runs` are experiments by name; every one has to reach `until` (s; of each run, where they differ) or the event that
    ends it. `criterion` says what `measure` tests, in words; `depends` what it depends on that the paper does not say,
    and was chosen: values, cases, thresholds. beyond: no sentence of the paper, but what a reader would ask next.
    alone: where each reading has runs of its own, the claim in that reading only, which a single run may decide.
    """

    paper: str
    text: str
    paper_number: str
    criterion: str
    runs: Sequence[str]
    until: float | Mapping[str, float]
    measure: Measure
    depends: str = ""
    beyond: bool = False
    alone: Sequence["Claim"] = ()

    def judge(self, runs: Mapping[str, Result]) -> "Verdict":
        """Measure and judge; a claim whose runs are missing or too short is "not judged" and says why."""
        lacking = self.lacking(runs)
        if lacking:
            return self._verdict({"": Measured(lacking, {})})
        try:
            measured = self.measure(runs)
        except UnknownName as error:
            return self._verdict({"": Measured(f"a variable is missing: {error}", {})})
        return self._verdict({"": measured} if isinstance(measured, Measured) else measured)

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

    def _verdict(self, readings: Readings) -> "Verdict":
        named = {name: found.text for name, found in readings.items()}
        return Verdict(
            paper=self.paper,
            claim=self.text,
            said=self.paper_number,
            measured="; ".join(f"{name}: {text}" if name else text for name, text in named.items()),
            verdict=decide({name: found.holds for name, found in readings.items()}),
            criterion=self.criterion,
            depends=self.depends,
            beyond=self.beyond,
            readings={n: {part: bool(good) for part, good in found.holds.items()} for n, found in readings.items()},
        )


@dataclass(frozen=True)
class Verdict:
    """A row of the claims table; `readings`: reading -> part of the claim -> whether it holds."""

    paper: str
    claim: str
    said: str
    measured: str
    verdict: Outcome
    criterion: str = ""
    depends: str = ""
    beyond: bool = False
    readings: Mapping[str, Mapping[str, bool]] = field(default_factory=dict)

    def row(self) -> dict[str, Any]:
        """Return all of it as plain data, for claims.json."""
        return asdict(self) | {"word": self.word, "failing": self.failing}

    @property
    def holds(self) -> dict[str, bool]:
        """All parts, of several readings as "reading: part"."""
        return {
            f"{name}: {part}" if name else part: good
            for name, holds in self.readings.items()
            for part, good in holds.items()
        }

    @property
    def word(self) -> str:
        """The verdict; with the readings in which the claim is reproduced, where that is said of some."""
        if self.verdict != "in one reading":
            return self.verdict
        held = [name for name, holds in self.readings.items() if all(holds.values())]
        return f"in one reading ({held[0]})" if len(held) == 1 else f"in {len(held)} readings ({', '.join(held)})"

    @property
    def failing(self) -> str:
        """The parts that fail, of every reading; "" if all hold."""
        texts: list[str] = []
        for name, holds in self.readings.items():
            failed = [part for part, good in holds.items() if not good]
            what = "all of it" if failed and len(failed) == len(holds) > 1 else ", ".join(failed)
            texts += [f"{name}: {what}" if name else what] if failed else []
        return "; ".join(texts)


def decide(readings: Mapping[str, Mapping[str, bool]]) -> Outcome:
    """Return the verdict of the parts of a claim in all of its readings."""
    parts = [good for holds in readings.values() for good in holds.values()]
    if not parts:
        return "not judged"
    if all(parts):
        return "reproduced"
    if len(readings) > 1 and any(holds and all(holds.values()) for holds in readings.values()):
        return "in one reading"
    return "partly" if any(parts) else "not reproduced"


def in_all_readings(claims: Sequence[Claim]) -> Claim:
    """Return the claim that is judged in all readings of claims, each of which measures one reading with its runs.

    Words and criterion are those of the first.
    """

    def measure(runs: Mapping[str, Result]) -> Readings:
        found: dict[str, Measured] = {}
        for claim in claims:
            measured = claim.measure(runs)
            found |= {"": measured} if isinstance(measured, Measured) else measured
        return found

    runs = tuple(dict.fromkeys(name for claim in claims for name in claim.runs))
    return replace(claims[0], runs=runs, measure=measure, alone=tuple(claims))


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
