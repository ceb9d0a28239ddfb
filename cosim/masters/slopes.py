"""Which slopes of outputs a master knows: those that an FMU tells, or differences of its last points.

A slope is true or it is none. The output derivative that an FMU tells is dy/dt + dy/dx x' + dy/du u', so it is true
only where every input on which the output depends directly moves as its source does while the FMU steps, or is still.
Where it does not, or the FMU tells none, the slope at the end of a step is that of the parabola through the last three
points; with h and g the lengths of this step and the one before, y the value now and a, p those before:

    d = (y - a) / h,  e = (a - p) / g,  y' = d + (d - e) h / (h + g)                                      (1)

After the first step it is d; before, there is none (NaN): a smooth input is then a ramp, an extrapolated one held.
"""

from dataclasses import dataclass

import numpy as np

from cosim.arrays import FloatArray, IntArray
from cosim.system.timing import between
from cosim.system.wiring import Port, Wiring

UNKNOWN = float("nan")
"""The slope of what has no points yet."""

MOVING = ("ramp", "smooth", "extrapolated", "signal")
"""Timings of inputs that move while the target steps, so that it knows their slopes."""


def told(wiring: Wiring, port: Port) -> int:
    """Return up to which order an FMU tells true derivatives of an output."""
    description = wiring.descriptions[port.component]
    if not description.max_output_derivative_order:
        return 0
    depends = {Port(port.component, name) for name in description.feedthrough(port.variable)}
    links = [link for link in wiring.into(port.component) if link.target in depends]
    true = all(link.timing in MOVING or not between(wiring, link) for link in links)
    return description.max_output_derivative_order if true else 0


@dataclass(frozen=True)
class Differences:
    """Outputs of one component whose slopes are differences: slots of values, slopes, values one step before.

    `step`: the slot of the length of that step, s.
    """

    value: IntArray
    slope: IntArray
    before: IntArray
    step: int

    def take(self, begun: FloatArray, newest: FloatArray, h: float) -> None:
        """Put the slopes at the end of a step of length h, which began at `begun`, into `newest`; both all slots."""
        a = begun[self.value]
        d = (newest[self.value] - a) / h
        e = (a - begun[self.before]) / begun[self.step]
        slope = d + (d - e) * h / (h + begun[self.step])  # (1)
        newest[self.slope] = np.where(np.isnan(slope), d, slope)
        newest[self.before] = a
        newest[self.step] = h

    def forget(self, values: FloatArray) -> None:
        """Note that nothing is known of them yet."""
        values[self.slope] = values[self.before] = values[self.step] = UNKNOWN
