"""Notch filter: takes a frequency out of a signal, as that of an elastic mode out of a torque command.

    y / u = (s^2 + 2 zeta_z W s + W^2) / (s^2 + 2 zeta_p W s + W^2)                               (1)
with the band-pass b and the low-pass l of the same poles, both of the unit of u:
    l' = W b                                                                                      (2)
    b' = W (u - l - 2 zeta_p b)                                                                   (3)
    y = u - 2 (zeta_p - zeta_z) b                                                                 (4)
    at the start: l = u, b = 0                                                                    (5)

Symbols: W frequency. The gain at W is zeta_z / zeta_p, the depth; the edges of a deep notch, where its gain is
1/sqrt(2), are 2 zeta_p W apart, the width.
Source: textbook (second-order notch in terms of its band-pass); (1)-(5) are numbers of this file.
Invariants: a constant passes unchanged, and so does what is far above W. zeta_z = zeta_p changes nothing, a larger
zeta_z amplifies. Poles at W (-zeta_p +- i sqrt(1 - zeta_p^2)): what is in the filter dies out.
Limits: below W the phase lags, a deep notch far below by 2 zeta_p w / W rad, which costs phase margin. One frequency an
element: put several in a row. Internal steps are to be short against 1/W.
"""

from typing import Any

from ..framework import Condition, Parameter, State, not_negative, positive
from ..numbers import neutral
from .filter import Filter


class Notch(Filter):
    frequency = Parameter(
        unit="rad/s",
        shape=("width",),
        start=neutral.FREQUENCY,
        display_unit="Hz",
        tunable=True,
        doc="frequency that is taken out",
    )
    zeta_z = Parameter(
        unit="1", shape=("width",), start=0.05, tunable=True, doc="damping of the zeros; 0 takes all of it out"
    )
    zeta_p = Parameter(unit="1", shape=("width",), start=0.5, tunable=True, doc="damping of the poles, half the width")

    low = State(unit="unit", shape=("width",), calculated=True, doc="what of u is below the frequency, l")
    band = State(unit="unit", shape=("width",), calculated=True, doc="what of u is around the frequency, b")

    def initial(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"low": u.u, "band": 0 * u.u}  # (5)

    def derivatives(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {
            "low": p.frequency * x.band,  # (2)
            "band": p.frequency * (u.u - x.low - 2 * p.zeta_p * x.band),  # (3)
        }

    def outputs(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"y": u.u - 2 * (p.zeta_p - p.zeta_z) * x.band}  # (4)

    def check(self, t: Any, x: Any, u: Any, p: Any) -> list[Condition]:
        return [*positive(self, p, "frequency", "zeta_p"), *not_negative(self, p, "zeta_z")]
