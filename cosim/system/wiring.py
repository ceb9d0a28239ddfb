"""A checked system in scalars: what the graph, the plan and the masters work on."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NamedTuple

from cosim.system.signal import Signal
from fmus.description.description import ModelDescription, Scalar, ScalarVariable
from fmus.description.units import IDENTITY, Conversion


class Faulty(NamedTuple):
    """Which kinds of faults act on a scalar connection in a flight, and the longest delay among them, steps."""

    kinds: frozenset[str]
    longest: int


class Port(NamedTuple):
    """One scalar variable of one component."""

    component: str
    variable: str

    def __str__(self) -> str:
        """Write "plant.q_BN[1]"."""
        return f"{self.component}.{self.variable}"


@dataclass(frozen=True)
class Link:
    """One scalar connection: target = factor * source + offset, carried over a step as `timing` says (timing.py).

    `order`: up to which order an extrapolated one follows its source's derivatives. `asked`: what was asked for, where
    the two FMUs can only do less.
    """

    source: Port
    target: Port
    timing: str = "at_point"
    conversion: Conversion = IDENTITY
    step_mean: bool = False
    order: int = 0
    asked: str = ""
    fed: bool = False
    """Whether its source is a signal (feeds.py)."""
    allowed: tuple[int, ...] | None = None
    """The values that the target can take, where the source, of another type, may have others; None: all."""

    @property
    def from_start(self) -> bool:
        """Whether the source's values at the start of the step are all it needs, so that the target may step first."""
        return self.timing in ("at_point", "extrapolated", "extrapolated_mean")

    @property
    def ends_fresh(self) -> bool:
        """Whether the target's input stands at the source's value when the step ends."""
        return self.timing in ("after_step", "ramp", "smooth") or (self.timing == "signal" and self.order > 1)

    @property
    def slopes(self) -> int:
        """Up to which order it needs derivatives of its source."""
        return 1 if self.timing in ("smooth", "mean", "signal") else self.order

    def __str__(self) -> str:
        """Write "a.y -> b.u (after_step)"."""
        return f"{self.source} -> {self.target} ({self.timing})"


@dataclass(frozen=True)
class Channel:
    """One element of a signal and the input that it feeds, by a polynomial of a `degree`."""

    target: Port
    signal: Signal
    element: int
    degree: int


@dataclass(frozen=True)
class Feed:
    """The signals that feed one component."""

    component: str
    channels: tuple[Channel, ...]

    @property
    def name(self) -> str:
        """Of the instance that it is, which no FMU's can be."""
        return f"{self.component} (signals)"


@dataclass(frozen=True)
class Wiring:
    """A system without mistakes. `settings` and `held`: in the variables' own units. `periods`: of every component.

    `feeds`: the signals, by the names of the instances that they are; these are among `descriptions` too. `resolved`:
    what each entry of the system has come to, for a flight that changes some of them (parameters.py). `refreshed`:
    whether outputs that follow inputs directly are evaluated again at points; the plain exchange does without.
    `faulty`: targets of connections on which faults act in a flight; `freezing`: components that freeze in it.
    """

    descriptions: Mapping[str, ModelDescription]
    links: tuple[Link, ...] = ()
    settings: Mapping[Port, Scalar] = field(default_factory=dict)
    held: Mapping[Port, Scalar] = field(default_factory=dict)
    periods: Mapping[str, int] = field(default_factory=dict)
    system: str = ""
    feeds: Mapping[str, Feed] = field(default_factory=dict[str, Feed])
    refreshed: bool = True
    resolved: Mapping[Any, Mapping[Port, Scalar]] = field(default_factory=dict, compare=False, repr=False)
    faulty: Mapping[Port, Faulty] = field(default_factory=dict[Port, Faulty])
    freezing: frozenset[str] = frozenset()

    @property
    def fmus(self) -> Mapping[str, ModelDescription]:
        """The descriptions of the FMUs."""
        return {name: d for name, d in self.descriptions.items() if name not in self.feeds}

    @property
    def components(self) -> tuple[str, ...]:
        """Instance names in the order of declaration."""
        return tuple(self.descriptions)

    def variable(self, port: Port) -> ScalarVariable:
        """Return what the description of its FMU says of a variable."""
        return self.descriptions[port.component].variables[port.variable]

    @cached_property
    def _sources(self) -> frozenset[Port]:
        return frozenset(link.source for link in self.links)

    def must_be_finite(self, port: Port) -> bool:
        """Whether a value that is not finite ends a run: where it is passed on, and in every FMU of ours."""
        return self.variable(port).type == "Real" and (
            self.descriptions[port.component].refresh or port in self._sources
        )

    def period(self, component: str) -> int:
        """Return how many communication steps a component takes in one of its own."""
        return self.periods.get(component, 1)

    def into(self, component: str) -> list[Link]:
        """Return the links that end at a component."""
        return [link for link in self.links if link.target.component == component]
