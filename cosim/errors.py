"""What can go wrong between a system on paper and its last row: one class per kind, text made from its fields."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from fmus.description.errors import FmuError, SimulationError, UnknownName

__all__ = [
    "FmuError",
    "SimulationError",
    "UnknownName",
]


@dataclass(eq=False)
class TimeError(SimulationError):
    """A time that the master cannot count: not positive, not finite, no number of nanoseconds and no fraction."""

    name: str
    value: object
    problem: str
    nearest: str | None = None

    def __str__(self) -> str:
        """Name, value, problem, the nearest that would do, what is allowed."""
        advice = "Times are whole nanoseconds or fractions: 0.001, Fraction(1, 30), on the command line 1/30."
        nearest = f" The nearest that would do is {self.nearest}." if self.nearest is not None else ""
        return f"{self.name} is {self.value}: {self.problem}.{nearest} {advice}"


@dataclass(eq=False)
class ParameterError(SimulationError):
    """A value that cannot be set: unknown, wrong type or size, not finite, not settable."""

    name: str
    problem: str

    def __str__(self) -> str:
        """Parameter and problem."""
        return f"parameter {self.name}: {self.problem}"


@dataclass(eq=False)
class SignalError(SimulationError):
    """A time series that cannot feed an input: unreadable, not increasing, not finite, too short, of another width."""

    signal: str
    problem: str
    advice: str = ""

    def __str__(self) -> str:
        """Signal, problem, advice."""
        return f"signal {self.signal}: {self.problem}. {self.advice}".rstrip()


@dataclass(eq=False)
class EventError(SimulationError):
    """A change in flight that cannot be: of what is fixed, unknown, of another size, at a time at which it cannot be.

    `component`: the FMU that refused it in a run.
    """

    time: str
    problem: str
    advice: str = ""
    component: str | None = None

    def __str__(self) -> str:
        """Time, problem, advice."""
        return f"event at {self.time}: {self.problem}. {self.advice}".rstrip()


@dataclass(eq=False)
class CyclicOrder(SimulationError):
    """Components that each have to step before the other; `connections` reads "a.x -> b.u (after_step)"."""

    connections: Sequence[str]

    def __str__(self) -> str:
        """Name the cycle, and what breaks it."""
        return (
            "every component of this cycle would have to step before the next: "
            + "; ".join(self.connections)
            + '. Give one of these connections timing="at_point".'
        )


@dataclass(eq=False)
class AlgebraicLoop(SimulationError):
    """An algebraic loop over FMUs that could not be solved; `path` runs against the signal, first = last.

    `time`: of the communication point in a run, s. `component`: the FMU that failed in it, if one did.
    """

    path: Sequence[str]
    problem: str
    advice: str = "Give one of these outputs a state, or hold one input."
    time: float | None = None
    component: str | None = None

    def __str__(self) -> str:
        """Print the loop variable by variable, where and why it was not solved, the way out."""
        where = f" at communication point {self.time:.12g} s" if self.time is not None else ""
        return f"{' <- '.join(self.path)}: {self.problem}{where}. {self.advice}"


_STATUS = {2: "Discard", 3: "Error", 4: "Fatal", 5: "Pending"}


def status_name(status: int, prefix: str = "fmi2") -> str:
    """Return the name of an FMI status that ends a call; `prefix`: of the version of FMI."""
    return f"{prefix}{_STATUS[status]}" if status in _STATUS else f"the illegal status {status}"


@dataclass(eq=False)
class CallFailed(SimulationError):
    """An FMI function that did not return fmi2OK or fmi2Warning; raised by slaves, dressed by masters."""

    component: str
    function: str
    status: str
    messages: Sequence[str] = ()
    last_successful_time: float | None = None
    terminated: bool = False
    waited: float | None = None
    """How long was waited for a step that stayed in fmi2Pending, s."""
    lost: str = ""
    """How the process of an isolated FMU was lost in the call, in words."""

    @property
    def what(self) -> str:
        """Function and status, or how the process was lost in it."""
        return f"in {self.function} {self.lost}" if self.lost else f"{self.function} returned {self.status}"

    @property
    def in_step(self) -> bool:
        """Whether the call was the step itself, whatever version of FMI names it."""
        return self.function.endswith("DoStep")

    def __str__(self) -> str:
        """Component, function, status, the FMU's own words."""
        return f"{self.component}: {self.what}{quoted(self.messages)}"


@dataclass(eq=False)
class InitializationFailed(SimulationError):
    """An FMU that refused its parameters, inputs or initialization."""

    component: str
    problem: str
    messages: Sequence[str] = ()

    def __str__(self) -> str:
        """Component, problem, the FMU's own words."""
        return f"{self.component} cannot be initialized: {self.problem}{quoted(self.messages)}"


@dataclass(eq=False)
class StepFailed(SimulationError):
    """A communication step that ended the run; `time` and `step` in s, `variable` where a value is to blame."""

    component: str
    status: str
    time: float
    step: float
    last_successful_time: float | None = None
    messages: Sequence[str] = ()
    variable: str | None = None
    value: float | None = None
    terminated: bool = False
    """Whether the FMU asked for the end of the run (fmi2Discard with fmi2Terminated), which is no failure."""
    culprits: Sequence[str] = ()
    """Who made the value grow, in words, where it is another than `component`."""
    waited: float | None = None
    """How long was waited for a step that stayed in fmi2Pending, s."""
    lost: str = ""
    """How the process of an isolated FMU was lost, and in which call, in words."""
    remedy: str = ""
    """Which exchange diverged and at which step the same flight passes, in words, where trials tell."""

    @property
    def is_final(self) -> bool:
        """Whether the FMU takes no other step after this one, not even from an earlier state."""
        return bool(self.lost) or self.status.endswith(("Fatal", "Pending"))

    @property
    def grown(self) -> bool:
        """Whether a value that is not finite is what failed."""
        return self.variable is not None or any("is not finite" in line for line in self.messages)

    def __str__(self) -> str:
        """Component, status, time and step, the value or the FMU's own words, what may help."""
        where = f"communication point {self.time:.12g} s, step {self.step:.12g} s"
        advice = self.culprits or [self.remedy or "Where a loop diverges, a shorter step may help."]
        words = quoted([*self.messages, *(advice if self.grown else [])])
        if self.variable is not None:
            return f"{self.component}.{self.variable} became {self.value} in the step from {where}{words}"
        if self.waited is not None:
            return (
                f"{self.component} was still in its step (fmi2DoStep returned fmi2Pending) after {self.waited:.12g} s "
                f"of waiting, at {where}; it was told to cancel it (fmi2CancelStep). Give it more time: "
                f"pending_timeout=..., --pending-timeout SECONDS{words}"
            )
        if self.lost:
            return f"{self.component} was lost at {where}: {self.lost}{words}"
        last = self.last_successful_time
        reached = f" (last successful time {last:.12g} s)" if last is not None else ""
        return f"{self.component} returned {self.status} at {where}{reached}{words}"


@dataclass(eq=False)
class NotConverged(StepFailed):
    """An iterated step whose values do not come to agree; `component` is the one of the value that is furthest off.

    `loop`: the outputs that are sought. `variable`, `change`: which of them still changes most, and by how much of its
    size; `tolerance`: how much is allowed. `halvings`: how often the step was halved; `why`: what kept it from more.
    """

    loop: Sequence[str] = ()
    change: float = math.inf
    tolerance: float = 0.0
    halvings: int = 0
    why: str = ""

    @property
    def grown(self) -> bool:
        """Whether a value that is not finite is what failed: then nothing was left to agree upon."""
        return False

    def __str__(self) -> str:
        """Where, what, both numbers, what may help."""
        where = f"the step from {self.time:.12g} s, {self.step:.3g} s long"
        halved = f"halved {self.halvings} times" if self.halvings else "not halved"
        also = f" ({self.why})" if self.why else ""
        return (
            f"{where}, does not converge: {self.component}.{self.variable} still changes by {self.change:.3g} of "
            f"its size, allowed are {self.tolerance:.3g}; it was {halved}{also}. Sought were {', '.join(self.loop)}. "
            "Choose a shorter step or a larger tolerance; a law that switches within the step may have no solution: "
            "master=Explicit()."
        )


@dataclass(eq=False)
class ToleranceMissed(StepFailed):
    """A step that cannot be made shorter, after which an output may be wrong by `error`, by more than is `allowed`."""

    error: float = math.inf
    allowed: float = 0.0

    @property
    def grown(self) -> bool:
        """Whether a value that is not finite is what failed."""
        return False

    def __str__(self) -> str:
        """Where, what, both numbers, what may help."""
        name = f"{self.component}.{self.variable}"
        return (
            f"the step from {self.time:.12g} s, {self.step:.3g} s long, the least that is allowed: {name} may be wrong "
            f"by {self.error:.3g} after it, allowed are {self.allowed:.3g}. Choose a larger tolerance (of this output "
            f'alone: tolerances={{"{name}": ...}}) or a smaller least_step; where a law switches, master=Iterated() '
            "goes on."
        )


@dataclass(eq=False)
class ValueRefused(SimulationError):
    """A value that an input of another type cannot take; `target`, `source` as "a.x", `time` in s."""

    target: str
    source: str
    value: float
    allowed: Sequence[int]
    time: float

    def __str__(self) -> str:
        """Both ends, the value, what is allowed."""
        there = ", ".join(map(str, self.allowed))
        what = f"{self.value:g} from {self.source} at {self.time:.12g} s"
        return f"{self.target} cannot take {what}: its values are {there}."


@dataclass(eq=False)
class NotSupported(SimulationError):
    """Something that this master cannot do, asked for by name."""

    what: str
    advice: str

    def __str__(self) -> str:
        """Say what, and what to do instead."""
        return f"{self.what}. {self.advice}"


@dataclass(eq=False)
class ResultExists(SimulationError):
    """A folder that already holds a result.

    `story`: how its run ended, where it did not finish; `checkpoint`: whether it has one.
    """

    path: Path
    story: str = ""
    checkpoint: bool = False

    def __str__(self) -> str:
        """Folder, how its run ended, and the ways out."""
        what = f"what is left of a run that {self.story}" if self.story else "a result"
        return (
            f"{near(self.path)} already holds {what}. Write elsewhere (out=..., --out DIR), or replace it "
            "(overwrite=True, --force)." + f" To go on with it: adcs run --resume {near(self.path)}" * self.checkpoint
        )


@dataclass(eq=False)
class ResultBusy(SimulationError):
    """A folder that another run is writing into; `owner` says which."""

    path: Path
    owner: str

    def __str__(self) -> str:
        """Folder, the other run, both ways out."""
        return (
            f"{near(self.path)} is being written by {self.owner}. Wait for it, or write elsewhere (out=..., --out DIR)."
        )


@dataclass(eq=False)
class ResultUnwritable(SimulationError):
    """A folder or file that takes no rows: no permission, no room, no folder."""

    path: Path
    problem: str

    def __str__(self) -> str:
        """File, problem, the way out."""
        return f"{near(self.path)} cannot be written: {self.problem}. Choose another folder (out=..., --out DIR)."


@dataclass(eq=False)
class ResultUnreadable(SimulationError):
    """A folder or file that holds no readable result."""

    path: Path
    problem: str

    def __str__(self) -> str:
        """Folder and problem."""
        return f"{near(self.path)}: {self.problem}"


@dataclass(eq=False)
class WiringError(SimulationError):
    """One mistake in a system: what is wrong, and what to do about it."""

    problem: str
    advice: str = ""
    ports: Sequence[str] = field(default=())

    def __str__(self) -> str:
        """Problem and advice."""
        return f"{self.problem}. {self.advice}".rstrip() if self.advice else f"{self.problem}."


@dataclass(eq=False)
class WiringErrors(SimulationError):
    """All mistakes of a system, found before its first step."""

    system: str
    mistakes: Sequence[SimulationError]

    def __str__(self) -> str:
        """One line per mistake."""
        count = len(self.mistakes)
        head = f'system "{self.system}" has {count} mistake{"s" if count > 1 else ""}:'
        return "\n".join([head, *(f"  {type(m).__name__}: {m}" for m in self.mistakes)])


def quoted(messages: Sequence[str]) -> str:
    """Return an FMU's log lines as the tail of a message."""
    return "".join(f"\n    {line}" for line in messages)


def near(path: Path) -> Path:
    """Return a path as one writes it from here: relative where it is below the working folder."""
    try:
        here = Path.cwd()
    except OSError:  # it has been deleted
        return path
    return path.relative_to(here) if path.is_relative_to(here) else path
