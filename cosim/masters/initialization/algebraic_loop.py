"""An algebraic loop over FMUs in initialization mode: outputs x with x = G(x).

Solved with scipy's hybrid Powell method, with the Jacobian from the FMUs' directional derivatives where all of them
give them, by differences where not; refused with the loop printed variable by variable where that fails.
"""

from typing import Any

import numpy as np

from cosim.arrays import FloatArray
from cosim.errors import AlgebraicLoop, CallFailed
from cosim.masters.initialization.values import Values
from cosim.masters.layout import Reading
from cosim.masters.types import Kind

TOLERANCE = 1e-10
"""Largest accepted |G(x) - x|, relative to the larger of |x| and 1."""


def same_bits(a: FloatArray, b: FloatArray) -> bool:
    """Whether two arrays are equal bit by bit, NaN included."""
    return a.tobytes() == b.tobytes()


class Loop:
    """The outputs of a loop: `readings` one for each component, `path` the loop as text."""

    def __init__(self, values: Values, readings: tuple[Reading, ...], path: tuple[str, ...]) -> None:
        self.all, self.readings, self.path = values, readings, path
        self.groups = [(r.component, group) for r in readings for group in r.groups]
        self.slots = np.concatenate([group.slots for _, group in self.groups])
        self.solved = False

    def evaluate(self) -> None:
        """Solve the loop, starting from the values known or the FMUs' start values.

        Raises `AlgebraicLoop` if there is no solution near.
        """
        if not self.all.known[self.slots].all():
            for reading in self.readings:
                self.all.set_inputs(reading.component)
                self.all.store(reading)
        x = self.all.values[self.slots].copy()
        if self.solved and self._fits(x):
            return self._keep(x)
        for _ in range(len(x) + 1):  # a loop that is one only for want of dependencies settles here, exactly
            new = self._passed(x)
            if same_bits(new, x):
                return self._keep(x)
            x = new
        if any(group.kind != Kind.REAL for _, group in self.groups):
            raise AlgebraicLoop(self.path, "its values, some of which are not Real, do not settle")
        return self._keep(self._root(self.all.values[self.slots]))

    def _keep(self, x: FloatArray) -> None:
        self.all.values[self.slots] = x

    def _passed(self, x: FloatArray) -> FloatArray:
        """Return G(x)."""
        self._keep(x)
        for reading in self.readings:
            self.all.set_inputs(reading.component)
        return np.concatenate([values for r in self.readings for values in self.all.read(r)])

    def _fits(self, x: FloatArray) -> bool:
        return bool(np.all(np.abs(self._passed(x) - x) <= TOLERANCE * np.maximum(1.0, np.abs(x))))

    def _root(self, start: FloatArray) -> FloatArray:
        from scipy.optimize import root  # takes long to import, and few systems have a loop

        derivatives = all(
            self.all.slaves[r.component].description.provides_directional_derivative for r in self.readings
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
        for component, group in self.groups:
            inputs = self.all.layout.components[component].inputs
            rows = [place[slot] for slot in group.slots]
            for j, (slot, reference) in enumerate(zip(inputs.source, inputs.references, strict=True)):
                if slot in place:
                    seed = np.array([inputs.factor[j]])
                    slave = self.all.slaves[component]
                    matrix[rows, place[slot]] += slave.directional_derivative(group.references, (reference,), seed)
        return matrix
