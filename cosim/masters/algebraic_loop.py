"""An algebraic loop over FMUs in initialization mode: outputs x with x = G(x).

Solved with scipy's hybrid Powell method, with the Jacobian from the FMUs' directional derivatives where all of them
give them, by differences where not; refused with the loop printed variable by variable where that fails.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from cosim.errors import AlgebraicLoop, CallFailed
from cosim.masters.exchange import Exchange
from cosim.masters.plan import Reading

FloatArray = NDArray[np.float64]

TOLERANCE = 1e-10
"""Largest accepted |G(x) - x|, relative to the larger of |x| and 1."""


def same_bits(a: FloatArray, b: FloatArray) -> bool:
    """Whether two arrays are equal bit by bit, NaN included."""
    return a.tobytes() == b.tobytes()


class Loop:
    """The outputs of a loop: `readings` one for each component, `path` the loop as text."""

    def __init__(self, exchange: Exchange, readings: tuple[Reading, ...], path: tuple[str, ...]) -> None:
        self.exchange, self.readings, self.path = exchange, readings, path
        self.slots = np.concatenate([r.slots for r in readings])
        self.solved = False

    def evaluate(self) -> None:
        """Solve the loop, starting from the values known or the FMUs' start values.

        Raises `AlgebraicLoop` if there is no solution near.
        """
        if not self.exchange.known[self.slots].all():
            for reading in self.readings:
                self.exchange.set_inputs(reading.component)
                self.exchange.store(reading, self.exchange.read(reading))
        x = self.exchange.values[self.slots].copy()
        if self.solved and self._fits(x):
            return self._keep(x)
        for _ in range(len(x) + 1):  # a loop that is one only for want of dependencies settles here, exactly
            new = self._passed(x)
            if same_bits(new, x):
                return self._keep(x)
            x = new
        return self._keep(self._root(self.exchange.values[self.slots]))

    def _keep(self, x: FloatArray) -> None:
        self.exchange.values[self.slots] = x

    def _passed(self, x: FloatArray) -> FloatArray:
        """Return G(x)."""
        self._keep(x)
        for reading in self.readings:
            self.exchange.set_inputs(reading.component)
        return np.concatenate([self.exchange.read(r) for r in self.readings])

    def _fits(self, x: FloatArray) -> bool:
        return bool(np.all(np.abs(self._passed(x) - x) <= TOLERANCE * np.maximum(1.0, np.abs(x))))

    def _root(self, start: FloatArray) -> FloatArray:
        from scipy.optimize import root  # takes long to import, and few systems have a loop

        derivatives = all(
            self.exchange.slave(r.component).description.provides_directional_derivative for r in self.readings
        )
        try:
            x: FloatArray = np.asarray(
                root(lambda x: self._passed(x) - x, start, jac=self._jacobian if derivatives else None, tol=1e-14).x
            )
            if derivatives:  # one Newton step more: exact where the loop is linear
                x = x - np.linalg.solve(self._jacobian(x), self._passed(x) - x)
            fits = self._fits(x)
        except (CallFailed, np.linalg.LinAlgError) as error:
            raise AlgebraicLoop(self.path, f"the loop could not be solved ({error})") from error
        if not fits:
            raise AlgebraicLoop(self.path, "no solution of the loop was found")
        self.solved = True
        return x

    def _jacobian(self, x: FloatArray, *_: Any) -> FloatArray:
        """Return dG/dx - 1, shape (n, n), column by column of each component's inputs."""
        self._passed(x)
        matrix = -np.eye(len(x))
        place = {slot: i for i, slot in enumerate(self.slots)}
        for reading in self.readings:
            slave = self.exchange.slave(reading.component)
            inputs = self.exchange.components[reading.component].inputs
            rows = [place[slot] for slot in reading.slots]
            for j, slot in enumerate(inputs.source):
                if slot in place:
                    seed = np.array([inputs.factor[j]])
                    column = slave.directional_derivative(reading.references, (inputs.references[j],), seed)
                    matrix[rows, place[slot]] += column
        return matrix
