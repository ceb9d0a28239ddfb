"""Values that travel between FMUs in initialization mode."""

from collections.abc import Mapping

import numpy as np

from cosim.arrays import FloatArray
from cosim.masters.calls import read, refuse_values, write
from cosim.masters.layout import Layout, Reading
from cosim.masters.point import Point
from cosim.slaves.slave import Slave


class Values:
    """The values of all slots in initialization mode, and which of them are known yet."""

    def __init__(self, layout: Layout, slaves: Mapping[str, Slave], point: Point, time: float) -> None:
        self.layout, self.texts, self.time = layout, point.texts, time
        self.components = layout.components
        self.slaves = [slaves[c.name] for c in layout.components]
        self.values: FloatArray = point.values
        self.known = np.zeros(layout.size, dtype=np.bool_)
        self.known[layout.held : layout.held + len(layout.constants)] = True

    def set_inputs(self, place: int) -> None:
        """Set the inputs of a component whose sources are known; the others keep their start values.

        Raises `CallFailed`, `ValueRefused`.
        """
        inputs = self.components[place].inputs
        ready = self.known[inputs.source]
        given = inputs.factor * self.values[inputs.source] + inputs.addend
        refuse_values(inputs, given, self.time, ready)
        at = 0
        for group in inputs.groups:
            mine = slice(at, at + len(group.references))
            at = mine.stop
            if ready[mine].any():
                known = tuple(r for r, is_known in zip(group.references, ready[mine], strict=True) if is_known)
                write(self.slaves[place], group.kind, known, given[mine][ready[mine]], self.texts)

    def read(self, reading: Reading) -> list[FloatArray]:
        """Return outputs of a component as its inputs are now, an array for each group."""
        slave = self.slaves[reading.component]
        return [read(slave, g.kind, g.references, self.texts) for g in reading.groups]

    def store(self, reading: Reading) -> None:
        """Read outputs of a component, and make them known to the inputs that follow."""
        for group, values in zip(reading.groups, self.read(reading), strict=True):
            self.values[group.slots] = values
            self.known[group.slots] = True
        for passage in self.components[reading.component].outputs.passages:
            if self.known[passage.source]:
                passage.show(self.values, self.time)
                self.known[passage.slots] = True
