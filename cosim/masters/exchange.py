"""Values that travel between FMUs in initialization mode."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from cosim.masters.plan import Plan, Reading
from cosim.slaves.slave import Slave

FloatArray = NDArray[np.float64]


class Exchange:
    """The values of all slots in initialization mode, and which of them are known yet."""

    def __init__(self, plan: Plan, slaves: Mapping[str, Slave]) -> None:
        self.components = plan.components
        self.slaves = slaves
        self.values: FloatArray = np.zeros(plan.size)
        self.known = np.zeros(plan.size, dtype=np.bool_)
        constants = slice(plan.size - len(plan.constants), plan.size)
        self.values[constants], self.known[constants] = plan.constants, True

    def set_inputs(self, place: int) -> None:
        """Set the inputs of a component whose sources are known; the others keep their start values."""
        inputs = self.components[place].inputs
        ready = self.known[inputs.source]
        if ready.any():
            values = inputs.factor[ready] * self.values[inputs.source[ready]] + inputs.addend[ready]
            references = tuple(r for r, known in zip(inputs.references, ready, strict=True) if known)
            self.slave(place).set_real(references, values)

    def read(self, reading: Reading) -> FloatArray:
        """Return outputs of a component as its inputs are now."""
        return self.slave(reading.component).get_real(reading.references)

    def store(self, reading: Reading, values: FloatArray) -> None:
        """Make values known to the inputs that follow."""
        self.values[reading.slots] = values
        self.known[reading.slots] = True

    def slave(self, place: int) -> Slave:
        """Return the slave of a component by its place in the stepping order."""
        return self.slaves[self.components[place].name]
