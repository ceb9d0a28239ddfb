"""The only list of units: name -> exponents of kg, m, s, A, rad.

Every unit is coherent SI (factor 1, offset 0); other units of the same dimension exist for display only. An exponent
may be a half (mass-normalised modal coordinates); FMI 2.0 cannot express that, so such a unit has a name and no base
unit there. Names are those of FMI, kg.m2; an exponent that is no whole number stands after ^, for tools that read the
names as expressions (with m2 as m^2).
"""

from dataclasses import dataclass
from fractions import Fraction

HALF = Fraction(1, 2)
BASE_UNITS = ("kg", "m", "s", "A", "rad")


@dataclass(frozen=True)
class CoherentUnit:
    """A unit of coherent SI: exponents of the base units, and display units (name -> display value per SI value)."""

    exponents: dict[str, Fraction | int]
    display: dict[str, float]

    def scale(self, **factors: float) -> float:
        """Return how a value changes when a base unit changes: a value in the old unit times this is in the new one."""
        result = 1.0
        for base, exponent in self.exponents.items():
            result *= factors.get(base, 1.0) ** float(exponent)
        return result


DEGREES = 57.29577951308232  # per radian
HERTZ = 0.15915494309189535  # per radian per second, of an angular frequency


def _unit(display: dict[str, float] | None = None, /, **exponents: Fraction | int) -> CoherentUnit:
    return CoherentUnit(exponents, display or {})


UNITS: dict[str, CoherentUnit] = {
    "1": _unit({"%": 1e2}),
    "s": _unit({"ms": 1e3, "us": 1e6, "min": 1 / 60, "h": 1 / 3600}, s=1),
    "s2": _unit(s=2),
    "1/s": _unit(s=-1),
    "1/s2": _unit(s=-2),
    "1/s3": _unit(s=-3),
    "kg": _unit({"g": 1e3}, kg=1),
    "kg/m3": _unit(kg=1, m=-3),
    "m": _unit({"mm": 1e3, "um": 1e6, "km": 1e-3}, m=1),
    "m/s": _unit({"mm/s": 1e3}, m=1, s=-1),
    "m/s2": _unit(m=1, s=-2),
    "m2": _unit(m=2),
    "m3/s2": _unit(m=3, s=-2),
    "m/Hz^(1/2)": _unit(m=1, s=HALF),
    "rad": _unit({"deg": DEGREES, "arcsec": DEGREES * 3600}, rad=1),
    "rad2": _unit(rad=2),
    "rad2/s": _unit(rad=2, s=-1),
    "rad2/s2": _unit(rad=2, s=-2),
    "rad.s": _unit(rad=1, s=1),
    "rad/s": _unit({"deg/s": DEGREES, "deg/h": DEGREES * 3600, "Hz": HERTZ, "rpm": 60 * HERTZ}, rad=1, s=-1),
    "rad/s2": _unit({"deg/s2": DEGREES}, rad=1, s=-2),
    "rad/Hz^(1/2)": _unit(rad=1, s=HALF),
    "rad/s/Hz^(1/2)": _unit({"deg/h^(1/2)": DEGREES * 60}, rad=1, s=-HALF),
    "rad/s2/Hz^(1/2)": _unit({"deg/h^(3/2)": DEGREES * 216000}, rad=1, s=-3 * HALF),
    "kg.m2": _unit(kg=1, m=2),
    "1/(kg.m2)": _unit(kg=-1, m=-2),
    "kg.m2.s": _unit(kg=1, m=2, s=1),
    "kg.m2.s2": _unit(kg=1, m=2, s=2),
    "kg2.m4/s": _unit(kg=2, m=4, s=-1),
    "N": _unit({"mN": 1e3}, kg=1, m=1, s=-2),
    "N/m": _unit(kg=1, s=-2),
    "N/s": _unit(kg=1, m=1, s=-3),
    "N.s/m": _unit(kg=1, s=-1),
    "N/Hz^(1/2)": _unit(kg=1, m=1, s=-3 * HALF),
    "N.m": _unit({"mN.m": 1e3, "uN.m": 1e6}, kg=1, m=2, s=-2),
    "N.m.s": _unit({"mN.m.s": 1e3}, kg=1, m=2, s=-1),
    "N.m/s": _unit(kg=1, m=2, s=-3),
    "N.m/Hz^(1/2)": _unit(kg=1, m=2, s=-3 * HALF),
    "N.m/rad": _unit(kg=1, m=2, s=-2, rad=-1),
    "N.m.s/rad": _unit(kg=1, m=2, s=-1, rad=-1),
    "N.m/(rad.s)": _unit(kg=1, m=2, s=-3, rad=-1),
    "J": _unit(kg=1, m=2, s=-2),
    "W": _unit(kg=1, m=2, s=-3),
    "kg^(1/2).m": _unit(kg=HALF, m=1),
    "kg^(1/2).m.s": _unit(kg=HALF, m=1, s=1),
    "kg^(1/2).m/s": _unit(kg=HALF, m=1, s=-1),
    "kg^(1/2).m/s2": _unit(kg=HALF, m=1, s=-2),
}


def rate_unit(unit: str) -> str | None:
    """Return the unit of the time derivative of a quantity in `unit`, or None where the list has none."""
    wanted = dict(UNITS[unit].exponents)
    wanted["s"] = wanted.get("s", 0) - 1
    wanted = {base: exponent for base, exponent in wanted.items() if exponent}
    return next((name for name, other in UNITS.items() if other.exponents == wanted), None)
