"""A flight whose end is a result too: whatever ends it, with what it cost."""

import time
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from fractions import Fraction
from typing import Any

from cosim.errors import SimulationError, WiringErrors
from cosim.flights import Prepared, Progress
from cosim.masters.explicit import Explicit
from cosim.results.result import Result
from cosim.system.system import Experiment


class OutOfTime(Exception):
    """A flight that took longer than it may."""


@dataclass(frozen=True)
class Trial:
    """A flight at a communication step, s. `finished`: it came to its end, at the stop time or by an event.

    `ended`: how, in words. `wall` and `cpu`: seconds, of the loop and of this process in all. `evaluations`: how often
    loops were stepped in a communication step, on average; 1 where steps are not repeated. `result`: None where the
    flight could not begin; `failure` says why then.
    """

    step: Fraction
    finished: bool
    ended: str
    reached: float | None
    wall: float
    cpu: float
    evaluations: float
    result: Result | None = field(repr=False, compare=False)
    failure: SimulationError | None = field(repr=False, compare=False, default=None)

    @property
    def interrupted(self) -> bool:
        """Whether the user ended it."""
        return self.result is not None and self.result.info["status"] == "interrupted"


def fly(
    prepared: Prepared,
    experiment: Experiment,
    step: Fraction,
    parameters: Mapping[str, Any] | None = None,
    progress: Progress | None = None,
    deadline: float | None = None,
) -> Trial:
    """Fly an experiment at a step, in memory. Raises `OutOfTime` once `time.monotonic()` is past the deadline."""

    def look(now: float, stop: float) -> None:
        if deadline is not None and time.monotonic() > deadline:
            raise OutOfTime
        if progress is not None:
            progress(now, stop)

    began = time.process_time()
    failure: SimulationError | None = None
    try:
        result = prepared.fly(
            replace(experiment, communication_step_size=step), parameters=parameters, progress=look, advise=False
        )
    except SimulationError as error:
        failure, result = error, error.result
    cpu = time.process_time() - began
    if result is None:
        return Trial(step, False, _ended(failure, {}), None, 0.0, cpu, 1.0, None, failure)
    info = result.info
    return Trial(
        step, info["status"] == "finished", _ended(failure, info), info["reached_time"],
        info["wall_time"]["loop"], cpu, _evaluations(info, step), result, failure,
    )  # fmt: skip


def _evaluations(info: Mapping[str, Any], step: Fraction) -> float:
    """Return the evaluations a step of a flight that repeats its steps, else 1."""
    if info["master"]["name"] == Explicit.__name__ or info["reached_time"] is None:
        return 1.0
    steps = (info["reached_time"] - info["start_time"]) / step
    return info["loop"]["evaluations"] / steps if steps else 1.0


def _ended(failure: SimulationError | None, info: Mapping[str, Any]) -> str:
    """Return how a flight ended, in a line."""
    if failure is not None:
        lines = str(failure).splitlines()
        whole = isinstance(failure, WiringErrors)  # whose first line only counts them
        told = " ".join(map(str.strip, lines)) if whole else lines[0].partition(". ")[0]
        return f"{type(failure).__name__}: {told}"
    if event := info.get("event"):
        return f"ended by {event['variable']} at {event['time']:g} s"
    return str(info["status"])
