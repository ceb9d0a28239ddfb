"""By how much two solutions of a step differ, measured by what the user allows.

The largest, over the Real outputs that are connected and move on curves, of

    |x - y| / (absolute nominal + relative max(|x|, |x_0|)),  x_0 at the start of the step.               (1)
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from cosim.arrays import FloatArray, IntArray
from cosim.errors import UnknownName
from cosim.masters.columns import matches
from cosim.masters.layout import Layout
from cosim.masters.master import Deviation
from cosim.system.timing import between
from cosim.system.wiring import Wiring
from fmus.description.names import split_element


@dataclass(frozen=True)
class Norm:
    """The outputs of a wiring that are judged, arrays of shape (n,); `absolute` in their own units."""

    names: tuple[str, ...]
    slots: IntArray
    absolute: FloatArray
    relative: FloatArray

    @classmethod
    def of(
        cls, wiring: Wiring, layout: Layout, absolute: float, relative: float, tolerances: Mapping[str, float]
    ) -> "Norm":
        """Judge all by `absolute`, of their nominal values, and `relative`; those that match a pattern by its own.

        Raises `UnknownName` for a pattern that matches none of them.
        """
        ports = list(dict.fromkeys(link.source for link in wiring.links if between(wiring, link) and not link.fed))
        both = np.array([(absolute, relative)] * len(ports)).reshape(len(ports), 2)
        for pattern, tolerance in tolerances.items():
            chosen = [any(matches(pattern, name) for name in (str(p), split_element(str(p))[0])) for p in ports]
            if not any(chosen):
                known = dict.fromkeys(split_element(str(port))[0] for port in ports)
                raise UnknownName("connected output", pattern, "tolerances", list(known))
            both[chosen] = tolerance
        nominal = np.array([abs(wiring.variable(port).nominal) or 1.0 for port in ports], dtype=np.float64)
        slots = np.array([layout.slots[port] for port in ports], dtype=np.int64)
        return cls(tuple(map(str, ports)), slots, both[:, 0] * nominal, both[:, 1])

    def between(self, start: FloatArray, x: FloatArray, y: FloatArray, divisor: float) -> Deviation | None:
        """Return the largest deviation of x, vectors of slots: its difference from y over a divisor; None: of nothing.

        A deviation that is not a number is infinite.
        """
        if not len(self.slots):
            return None
        start, x, y = (values[self.slots] for values in (start, x, y))
        error = np.abs(x - y) / divisor
        error[np.isnan(error)] = np.inf
        allowed = self.absolute + self.relative * np.maximum(np.abs(start), np.abs(x))
        worst = int(np.argmax(error / allowed))  # (1)
        return Deviation(self.names[worst], float(error[worst]), float(allowed[worst]))
