"""How a variable is shown: in which unit, and by which names its components go.

Angles and rates are in degrees, the speed of a wheel in rpm, the bias of a gyro in deg/h. Components of a quaternion
are w, x, y, z (scalar first), those of a vector of three x, y, z, all others are counted as FMI counts them.
"""

import math
from collections.abc import Sequence

from fmus.description.names import split_element

DEGREE = math.degrees(1.0)
FACTORS = {  # SI unit -> what it is shown in, and how many of that it has
    "rad": ("deg", DEGREE),
    "rad/s": ("deg/s", DEGREE),
    "rad/s2": ("deg/s2", DEGREE),
}
RPM = ("rpm", 30 / math.pi)
DEG_PER_HOUR = ("deg/h", 3600 * DEGREE)


def unit_of(name: str, unit: str | None) -> tuple[str, float]:
    """Return the unit in which a variable is shown, and the factor from its own; `name` with or without instance."""
    if unit == "rad/s" and "wheel" in name.rpartition(".")[2]:
        return RPM
    if unit == "rad/s" and "bias" in name:
        return DEG_PER_HOUR
    return FACTORS.get(unit or "", (unit or "1", 1.0))


def components_of(name: str, shape: Sequence[int]) -> list[str]:
    """Return the names of a variable's components, row by row: "" of a scalar."""
    base = split_element(name)[0].rpartition(".")[2]
    if not shape:
        return [""]
    if tuple(shape) == (4,) and base.startswith("q_"):
        return ["w", "x", "y", "z"]
    if tuple(shape) == (3,):
        return ["x", "y", "z"]
    if len(shape) == 1:
        return [str(i + 1) for i in range(shape[0])]
    return [f"{i + 1},{j + 1}" for i in range(shape[0]) for j in range(math.prod(shape[1:]))]
