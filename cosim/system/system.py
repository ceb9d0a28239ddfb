"""A system and an experiment are data: what flies, how it is wired, how long and with which master."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np

from cosim.errors import UnknownName
from cosim.system.component import Component
from cosim.system.fault import Fault
from cosim.system.reference import name_of, reference_of
from cosim.system.timing import Timing
from cosim.system.value import Value, as_written, plain
from cosim.system.wiring import Wiring
from cosim.time import Seconds, exact_seconds, written
from fmus.description import html
from fmus.description.units import Conversion


class MasterSettings(Protocol):
    """Settings of a master algorithm, a frozen dataclass; `cosim.masters` has what they set."""

    def timed(self, wiring: Wiring) -> Wiring:
        """Return the wiring with the timings that this master flies."""
        ...


@dataclass(frozen=True)
class Connection:
    """A connection between two variables, arrays or elements: "plant.q_BN" -> "controller.q_BN".

    `timing` decides what the target has as input while it steps from t_k to t_k+1: "at_point" the source's value at
    t_k, "after_step" that at t_k+1, "midpoint" the mean of both, "ramp" the line between them, "smooth" the cubic
    through both with the source's slopes. None: after_step for a step mean, at_point otherwise. A target that cannot
    interpolate its inputs is held at the mean of the line or curve.

    `factor`, `offset`: target = factor * source + offset in the variables' own units, between Real variables; where
    neither is given, the target gets what the source is in the target's unit.
    """

    source: str
    target: str
    timing: Timing | None = None
    factor: float | None = None
    offset: float = 0.0

    @property
    def transformation(self) -> Conversion | None:
        """What is made of the source's value, None: what the units of both ends say."""
        if self.factor is None and self.offset == 0.0:
            return None
        return Conversion(1.0 if self.factor is None else self.factor, self.offset)


@dataclass(frozen=True, kw_only=True)
class System:
    """Components (instance name -> FMU reference) and everything between and in them.

    A reference is FILE.fmu, NAME or FILE.py:Class, a path, or a component's class; `cosim.Library` builds what it must.
    A `Component` is a reference with how it flies: its flag goes into `isolated`, its reference stays.
    `parameters`: "plant.J" or "*.J" -> number, nested list or `Value`. `vehicle`: name -> value, set in every component
    that has a parameter of that name; entries of `parameters` win. `held`: input -> value for inputs without a
    connection; with `hold_unconnected` every other one is held at its FMU's start value. `inputs`: input -> `Signal`
    that feeds it, element for element; it wins over `held`. `steps`: instance -> n, it steps every n-th communication
    step. `isolated`: instances that fly in processes of their own; "*": all. `source`: what it was loaded from, for
    run.json.
    """

    name: str
    components: dict[str, Any]
    connections: Sequence[Connection] = ()
    parameters: dict[str, Any] = field(default_factory=dict)
    vehicle: dict[str, Any] = field(default_factory=dict)
    held: dict[str, Any] = field(default_factory=dict)
    inputs: dict[str, Any] = field(default_factory=dict)
    steps: dict[str, int] = field(default_factory=dict)
    hold_unconnected: bool = False
    isolated: Sequence[str] = ()
    source: Mapping[str, Any] = field(default_factory=dict, compare=False)

    def __post_init__(self) -> None:
        """Copy what the caller could change later, make arrays plain, so that equal systems compare equal."""
        parts = {name: given for name, given in self.components.items() if isinstance(given, Component)}
        components = self.components | {name: part.fmu for name, part in parts.items()}
        components = {name: reference_of(given, name) for name, given in components.items()}
        object.__setattr__(self, "components", components)
        object.__setattr__(self, "connections", tuple(self.connections))
        for name in ("parameters", "vehicle", "held"):
            object.__setattr__(self, name, {k: plain(v) for k, v in getattr(self, name).items()})
        for name in ("inputs", "steps"):
            object.__setattr__(self, name, dict(getattr(self, name)))
        apart = [name for name, part in parts.items() if part.isolated]
        object.__setattr__(self, "isolated", tuple(dict.fromkeys((*_names(self.isolated), *apart))))

    def __repr__(self) -> str:
        """Name, instances with their FMUs, how much is between and in them."""
        parts = ", ".join(f"{name} {name_of(reference)}" for name, reference in self.components.items())
        return f"<System {self.name}: {parts}; {', '.join(self._counts())}>"

    def _counts(self) -> list[str]:
        return [html.count(len(what), word) for word, what in self._sizes.items() if what or word != "signal"]

    @property
    def _sizes(self) -> dict[str, Any]:
        sizes = {"connection": self.connections, "parameter": self.parameters, "vehicle parameter": self.vehicle}
        return {**sizes, "held input": self.held, "signal": self.inputs}

    def _repr_html_(self) -> str:
        """Return tables of instances, of connections and of what is set, for a notebook."""
        instances = [
            (name, name_of(reference), str(self.steps.get(name, 1))) for name, reference in self.components.items()
        ]
        connections = [(c.source, c.target, c.timing or "default") for c in self.connections]
        values = [(kind, name, _told(v)) for kind, given in self._given().items() for name, v in given.items()]
        return "".join(
            [
                html.title(f"System {self.name}", ", ".join(self._counts())),
                html.table(("instance", "FMU", "steps"), instances),
                html.table(("from", "to", "timing"), connections),
                html.table(("", "variable", "value"), values),
            ]
        )

    def _given(self) -> dict[str, dict[str, Any]]:
        return {"parameter": self.parameters, "vehicle": self.vehicle, "held": self.held, "signal": self.inputs}


def isolated(system: System) -> frozenset[str]:
    """Return the instances that fly in processes of their own; raises `UnknownName`."""
    names = set(system.isolated)
    for name in sorted(names - system.components.keys() - {"*"}):
        raise UnknownName("component", name, "isolated", list(system.components))
    return frozenset(system.components if "*" in names else names)


def _names(given: str | Sequence[str]) -> tuple[str, ...]:
    """Return names; a text is one."""
    return (given,) if isinstance(given, str) else tuple(given)


def _told(value: Any) -> str:
    """Return a value with its unit; of an array only its size, without a unit in the variable's own."""
    number, unit = (value.value, value.unit) if isinstance(value, Value) else (value, None)
    shape = np.shape(number)
    text = " x ".join(map(str, shape)) if shape else f"{number:.6g}" if isinstance(number, float) else str(number)
    return f"{text} {unit or ''}".strip()


@dataclass(frozen=True)
class At:
    """An event: at a time in s parameters change, At(50.0, {"controller.kp": 30}); values and names as in `System`."""

    time: Seconds
    values: Mapping[str, Any]

    def __post_init__(self) -> None:
        """Copy what the caller could change later, make arrays plain."""
        object.__setattr__(self, "values", {name: plain(value) for name, value in self.values.items()})

    def words(self) -> str:
        """Return all of it: "at 50 s controller.kp = 30"."""
        values = ", ".join(f"{name} = {as_written(value)}" for name, value in self.values.items())
        return f"at {written(exact_seconds(self.time, 'the time of an event'))} {values}"


@dataclass(frozen=True, kw_only=True)
class Experiment:
    """Times in s, the master, and what is recorded: every n-th row of the variables that match `record`.

    A time is a float, or a `Fraction` (of `fractions`) where no decimal is exact: Fraction(1, 30). `master` is the
    settings of a master algorithm; None: those of the default, `Explicit()`.

    The patterns of `record` choose among inputs and outputs ("*", "plant.*", "*.q_BN"); a local variable is recorded
    where a pattern names it in full. The first and the last row are always recorded.

    `tolerance`: the relative tolerance that FMUs are told; None: each its own of its DefaultExperiment.
    `announce_stop_time`: whether they are told the stop time, for an FMU that needs it; some step to it at once then.

    `pending_timeout`: how long a step may go on after fmi2DoStep has returned fmi2Pending, seconds of wall time.

    `isolation_timeout`: how long a call of an isolated FMU may take before its process is ended, s of wall time.

    `stop_when`: a flag of a component, "plant.cage_contact": where it is there, the run ends at the first communication
    point at which the flag is above 0.5. That is a result, no failure; run.json has it as its `event`.

    `events`: tunable parameters that change at given times, each before the step that begins there. A time between two
    communication points divides the step; the points after it stay where they were.

    `faults`: what goes wrong in flight, each from a time on, at which the order of the exchange drops; what a faulty
    connection gives its target is what is recorded of that.
    """

    stop_time: Seconds
    communication_step_size: Seconds
    master: MasterSettings | None = None
    start_time: Seconds = 0.0
    every: int = 1
    record: Sequence[str] = ("*",)
    stop_when: str = ""
    tolerance: float | None = None
    announce_stop_time: bool = False
    pending_timeout: float = 60.0
    events: Sequence[At] = ()
    isolation_timeout: float = 60.0
    faults: Sequence[Fault] = ()

    def __post_init__(self) -> None:
        """Make the patterns a tuple; a text is one pattern. Make events and faults one too."""
        object.__setattr__(self, "events", tuple(self.events))
        object.__setattr__(self, "faults", tuple(self.faults))
        object.__setattr__(self, "record", _names(self.record))
