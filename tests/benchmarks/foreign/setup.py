"""What an FMU is flown with on both sides: the same times, tolerance and variables."""

import math
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

from fmpy.model_description import ModelDescription, ModelVariable, read_model_description
from fmpy.util import auto_interval

from cosim.errors import TimeError
from cosim.time import NANOSECONDS, exact_seconds

STEPS = 1000
"""How many steps a flight has at most."""

TOLERANCE = 1e-6
"""Of integrators, where an FMU has none."""

COLUMNS = 50
"""How many variables are recorded where an FMU has no outputs."""


@dataclass(frozen=True)
class Setup:
    """An experiment: times in s, steps between `times[0]` and the end, names of variables to be recorded."""

    start: float
    step: float
    times: tuple[float, ...]
    tolerance: float | None
    record: tuple[str, ...]

    @property
    def stop(self) -> float:
        return self.times[-1]


def described(path: Path, *, validate: bool = False) -> ModelDescription:
    """Read modelDescription.xml by fmpy."""
    return read_model_description(str(path), validate=validate)


def setup(path: Path) -> Setup:
    """The FMU's DefaultExperiment, else 1 s; its own step, else one that divides the time into some hundred."""
    about = described(path)
    said = about.defaultExperiment
    start = float(said.startTime) if said and said.startTime else 0.0
    stop = float(said.stopTime) if said and said.stopTime else start + 1.0
    if not start < stop:
        stop = start + 1.0
    step = _own_step(about) or float(auto_interval(stop - start))
    while (stop - start) / step > STEPS:
        step *= 2
    exact, begin = _exact(step), _exact(start)
    steps = max(1, math.floor((_exact(stop) - begin) / exact + Fraction(1, 1000)))
    times = tuple(float(begin + k * exact) for k in range(steps + 1))
    usual = None if about.coSimulation is not None else TOLERANCE
    tolerance = float(said.tolerance) if said and said.tolerance else usual
    return Setup(start, float(exact), times, tolerance, tuple(v.name for v in recorded(about)))


def _exact(seconds: float) -> Fraction:
    """A time that this project takes: to the nanosecond where it is no simple fraction."""
    try:
        return exact_seconds(seconds, "time")
    except TimeError:
        return Fraction(round(seconds * NANOSECONDS), NANOSECONDS)


def _own_step(about: ModelDescription) -> float | None:
    fixed = getattr(about.coSimulation, "fixedInternalStepSize", None)
    said = about.defaultExperiment.stepSize if about.defaultExperiment else None
    given = float(fixed or said or 0.0)
    return given if math.isfinite(given) and given > 0 else None


def recorded(about: ModelDescription) -> list[ModelVariable]:
    """The numeric outputs; where there are none, some of all numeric variables but `time`."""
    numeric = [v for v in about.modelVariables if v.type not in ("String", "Binary", "Clock") and v.name != "time"]
    outputs = [v for v in numeric if v.causality == "output"]
    return outputs or [v for v in numeric if v.causality not in ("parameter", "structuralParameter")][:COLUMNS]


def exporter(about: ModelDescription) -> str:
    """The tool that exported an FMU, without its version."""
    words: list[str] = []
    for word in (about.generationTool or "").split():
        if word[:1] in "-(" or word.lstrip("v")[:1].isdigit() or word in ("Version", "Compiler", "FMI", "(v"):
            break
        words.append(word.rstrip(":"))
        if word.endswith(":"):
            break
    return " ".join(words).rstrip("0123456789.") or "not named"
