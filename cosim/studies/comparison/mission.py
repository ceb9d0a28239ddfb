"""What every flight of the table is asked to do: one slew, one disturbance, from one start, judged by one threshold.

The slew is that of the component Slew, the disturbance that of HarmonicTorque, or another component's; both are set by
parameters of these names.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from cosim.arrays import FloatArray
from cosim.errors import ParameterError, UnknownName
from cosim.system import Value
from cosim.system.reference import Reference, name_of
from cosim.time import Seconds

STEP = 1e-3  # s
TORQUE_LIMIT = 1.0  # N m: of wheels for a vehicle that comes without a cluster, and what a controller is told of it

SLEW: Mapping[str, Any] = {  # about a skew axis, so that all axes couple; the largest vehicle needs 0.06 N m an axis
    "axis": [1.0, 1.0, 1.0],
    "angle": Value(10.0, "deg"),
    "max_rate": Value(0.15, "deg/s"),
    "max_acceleration": Value(0.01, "deg/s2"),
    "start_time": Value(10.0, "s"),
    "smooth": 1.0,
    "q_start": [1.0, 0.0, 0.0, 0.0],
}
DISTURBANCE: Mapping[str, Any] = {
    "bias": Value([1e-3, 0.0, 1e-3], "N.m"),
    "sine": Value([0.0, 1e-3, 1e-3], "N.m"),
    "cosine": Value([1e-3, 1e-3, 0.0], "N.m"),
    "frequency": Value(0.0011, "rad/s"),
}
UNITS: Mapping[str, str] = {
    "angle": "rad",
    "max_rate": "rad/s",
    "max_acceleration": "rad/s2",
    "start_time": "s",
    **dict.fromkeys(("bias", "sine", "cosine"), "N.m"),
    "frequency": "rad/s",
}
"""Of a value that says none."""


@dataclass(frozen=True)
class Mission:
    """A slew, a disturbance and how they are judged; what is not given is that of the papers' table.

    `slew`, `disturbance`: parameter -> value, of Slew and of HarmonicTorque or of `environment`, which is any
    component that shows tau_dist_B. `start_error`: rotation vector from reference to body at the start, deg, at rest.
    `threshold`: deg, of every component; `steady`: s, at the end, the window of the steady error, an eighth of the
    flight if it is None. The axis of the slew
    may have any length. Raises `UnknownName`, `ParameterError`.
    """

    slew: Mapping[str, Any] = field(default_factory=dict)
    disturbance: Mapping[str, Any] = field(default_factory=dict)
    environment: Reference = "HarmonicTorque"
    start_error: tuple[float, float, float] = (0.2, 0.15, -0.2)  # within PPATC's bounds
    stop: Seconds = 400.0
    step: Seconds = STEP
    every: int = 10
    threshold: float = 0.01
    steady: float | None = None

    def __post_init__(self) -> None:
        """Complete slew and disturbance, normalise the axis."""
        _known("slew", self.slew, SLEW)
        slew = {**SLEW, **self.slew}
        axis = np.asarray(getattr(slew["axis"], "value", slew["axis"]), dtype=float)
        if axis.shape != (3,) or not np.linalg.norm(axis) > 0:
            raise ParameterError(
                "axis of the slew", f"it is {axis.tolist()}, needed are three numbers that are not all 0"
            )
        object.__setattr__(self, "slew", {**slew, "axis": (axis / np.linalg.norm(axis)).tolist()})
        if self.environment == "HarmonicTorque":
            _known("disturbance", self.disturbance, DISTURBANCE)
            object.__setattr__(self, "disturbance", {**DISTURBANCE, **self.disturbance})

    @property
    def parameters(self) -> dict[str, Any]:
        """The parameters of guidance and environment, by instance."""
        return {
            **{f"guidance.{name}": value for name, value in self.slew.items()},
            **{f"environment.{name}": value for name, value in self.disturbance.items()},
        }

    @property
    def window(self) -> float:
        """The window of the steady error, s."""
        return float(self.stop) / 8 if self.steady is None else self.steady

    @property
    def start(self) -> FloatArray:
        """The attitude q_BN at the start, scalar first."""
        q_start = self.slew["q_start"]
        reference = Rotation.from_quat(np.asarray(getattr(q_start, "value", q_start), float), scalar_first=True)
        return (reference * Rotation.from_rotvec(self.start_error, degrees=True)).as_quat(scalar_first=True)

    @property
    def words(self) -> tuple[str, ...]:
        """The mission in sentences."""
        s = {name: _text(value, UNITS.get(name, "")) for name, value in self.slew.items()}
        kind = "smooth" if getattr(self.slew["smooth"], "value", self.slew["smooth"]) > 0.5 else "bang-bang"
        ours = UNITS if self.environment == "HarmonicTorque" else {}
        values = ", ".join(f"{name} {_text(value, ours.get(name, ''))}" for name, value in self.disturbance.items())
        error = ", ".join(f"{angle:g}" for angle in self.start_error)
        return (
            f"slew: {s['angle']} about {s['axis']}, at most {s['max_rate']} and {s['max_acceleration']}, {kind}, begun "
            f"after {s['start_time']}; start error ({error}) deg at rest",
            f"disturbance: {name_of(self.environment)}{', ' if values else ''}{values}",
            f"settled: no component of the error above {self.threshold:g} deg any more, counted from the end of the "
            f"slew; steady error: largest |error| of the last {self.window:g} s of {float(self.stop):g} s; step "
            f"{float(self.step) * 1e3:g} ms",
        )

    def with_changes(self, **changes: Any) -> "Mission":
        """Return the mission with other fields; None: as it is."""
        changes = {name: value for name, value in changes.items() if value is not None}
        if changes.get("environment", self.environment) != self.environment:
            changes = {"disturbance": {}, **changes}  # another component has other parameters
        return replace(self, **changes)


def _known(what: str, given: Mapping[str, Any], known: Mapping[str, Any]) -> None:
    for name in given:
        if name not in known:
            raise UnknownName("parameter", name, f"the {what}", list(known))


def _text(value: Any, own: str) -> str:
    """Return a value with its unit, its variable's `own` where it says none, of a list with four digits an element."""
    number, unit = (value.value, value.unit) if isinstance(value, Value) else (value, None)
    text = f"({', '.join(f'{v:.4g}' for v in number)})" if isinstance(number, list) else f"{number:g}"
    return f"{text} {unit or own}".strip()
