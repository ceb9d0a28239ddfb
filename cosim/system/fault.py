"""A fault is data: what goes wrong, where, from when until when.

With y what the target of a connection is given without a fault, in its own unit:

    bias           y + value                            stuck      value
    scale          value y                              dropout    what it was given last
    noise          y + value z, z standard normal       delay      y, value steps of its source ago
    quantisation   value round(y / value)               parameter  a tunable parameter has a value
                                                        freeze     a component takes no steps, its clock stands

Several on one connection act in the order of their names in `ORDER`, whatever their order in the experiment.
"""

from collections.abc import Mapping
from dataclasses import KW_ONLY, dataclass, replace
from fractions import Fraction
from typing import Any, Literal

from cosim.errors import SimulationError, UnknownName
from cosim.system.value import as_written, plain
from cosim.time import Seconds, exact_seconds, written

Kind = Literal["bias", "scale", "stuck", "dropout", "delay", "noise", "quantisation", "parameter", "freeze"]

QUANTITIES: dict[Kind, str] = {
    "bias": "value",
    "scale": "factor",
    "stuck": "value",
    "dropout": "",
    "delay": "steps",
    "noise": "sigma",
    "quantisation": "step",
    "parameter": "value",
    "freeze": "",
}
"""What `Fault.value` is called, by kind; "": there is none."""

ORDER = ("scale", "bias", "noise", "quantisation", "delay", "stuck", "dropout")
"""Of the faults of one connection; stuck and dropout hold what is given whatever comes before."""

JUMPING = ("noise", "quantisation", "delay")
"""Kinds after which a connection moves in steps, at each end of a step another value."""


@dataclass(eq=False)
class FaultError(SimulationError):
    """A fault that cannot be: of what is unknown or fixed, of a wrong value, at a wrong time, against another one."""

    fault: str
    problem: str
    advice: str = ""

    def __str__(self) -> str:
        """Fault, problem, advice."""
        return f"fault {self.fault}: {self.problem}. {self.advice}".rstrip()


@dataclass(frozen=True)
class Passing:
    """What changes of a connection with faults: its settings, and the value at which it is stuck, in the target's unit.

    Settings, in that unit: scale (1: none), bias, sigma and seed of the noise, quantum, steps of the delay, hold (1: it
    is held); 0: none.
    """

    settings: Mapping[str, float]
    stuck: float | None = None


@dataclass(frozen=True)
class Fault:
    """A fault: Fault("scale", "plant.tau_B", 0.5, start=50.0), Fault("bias", "gyro.omega_BN_B", "1 deg/h", start=9.0).

    `on`: a connection, "wheels.tau_B -> plant.tau_B", by its target alone, or by its source alone (every connection
    from there); arrays whole or elements, "plant.tau_B[2]". Of kind "parameter" a parameter, of "freeze" an instance.
    `value`: a number, one for each element, with a unit as `Value` or text; of noise the standard deviation. `start`,
    `until` in s; None: to the end. `seed`: of noise, whose numbers follow from seed, target and time alone.
    """

    kind: Kind
    on: str
    value: Any = None
    _: KW_ONLY
    start: Seconds
    until: Seconds | None = None
    seed: int = 0

    def __post_init__(self) -> None:
        """Copy what the caller could change later; raises `UnknownName` for a kind that there is not."""
        if self.kind not in QUANTITIES:
            raise UnknownName("kind", str(self.kind), f"the fault of {self.on}", list(QUANTITIES))
        object.__setattr__(self, "value", plain(self.value))

    def words(self) -> str:
        """Return all of it: "scale of plant.tau_B, factor 0.5, from 50 s to 80 s"."""
        quantity = QUANTITIES[self.kind]
        parts = [f"{self.kind} of {self.on}", *([f"{quantity} {as_written(self.value)}"] if quantity else [])]
        end = f" to {written(self.ends)}" if self.ends is not None else ""
        return ", ".join([*parts, f"from {written(self.begins)}{end}"])

    def __str__(self) -> str:
        """Kind, place and begin: "scale of plant.tau_B from 50 s"."""
        return f"{self.kind} of {self.on} from {written(self.begins)}"

    @property
    def begins(self) -> Fraction:
        """When it begins, s; raises `TimeError`."""
        return exact_seconds(self.start, f"the start of {self.kind} of {self.on}")

    @property
    def ends(self) -> Fraction | None:
        """When it ends, s, None: not before the flight; raises `TimeError`."""
        return None if self.until is None else exact_seconds(self.until, f"the end of {self.kind} of {self.on}")

    def meets(self, other: "Fault") -> bool:
        """Whether there is a time at which both are there."""
        return (other.ends is None or self.begins < other.ends) and (self.ends is None or other.begins < self.ends)

    def within(self, stop: Fraction) -> "Fault":
        """Return the fault in a flight that ends earlier, at a time in s."""
        return self if self.ends is None or self.ends <= stop else replace(self, until=None)

    def told(self) -> dict[str, Any]:
        """Return what run.json says of it."""
        quantity = {QUANTITIES[self.kind]: as_written(self.value)} if QUANTITIES[self.kind] else {}
        seed = {"seed": self.seed} if self.kind == "noise" else {}
        times = {"from": float(self.begins), "until": None if self.ends is None else float(self.ends)}
        return {"kind": self.kind, "on": self.on, **quantity, **seed, **times, "words": self.words()}
