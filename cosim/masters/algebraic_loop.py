"""An algebraic loop over FMUs that are set and read without a step: outputs x with x = G(x).

The same in initialization mode and at communication points. Newton's method, with F = G(x) - x and J = dG/dx - 1:

    J dx = -F,  x+ = x + dx                                                                               (1)

J is from the FMUs' directional derivatives where all of them give them. Where (1) does not converge, or they do not,
scipy's hybrid Powell method goes on, with differences where there are no derivatives. A loop that is one only for want
of dependencies settles by putting in what comes out, exactly.

Slopes at a communication point are a loop too, one that is linear: s = A s + b (`solve_linear`).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Protocol

import numpy as np

from cosim.arrays import FloatArray, IntArray
from cosim.errors import AlgebraicLoop, CallFailed
from cosim.masters.layout import ComponentLayout, Group, Reading
from cosim.masters.types import Kind
from cosim.slaves.slave import Slave

TOLERANCE = 1e-10
"""Largest accepted |G(x) - x|, relative to the larger of |x| and 1."""

ROUNDING = 1e-14
"""A step (1) below this part of the larger of |x| and 1 is what rounding leaves, and the last; so is the second in a
row below TOLERANCE, for a loop near singular keeps more of it."""

STEPS = 12
"""How many steps (1) are tried: quadratic convergence needs six from the first right digit on."""


def same_bits(a: FloatArray, b: FloatArray) -> bool:
    """Whether two arrays are equal bit by bit, NaN included."""
    return a.tobytes() == b.tobytes()


class Around(Protocol):
    """What a loop is solved in: the slots, and components by their places in the layout; raises `CallFailed`."""

    @property
    def values(self) -> FloatArray:
        """The values of all slots; those of the loop are written."""
        ...

    @property
    def time(self) -> float:
        """When it is, s."""
        ...

    @property
    def components(self) -> Sequence[ComponentLayout]:
        """Where each component has its slots."""
        ...

    @property
    def slaves(self) -> Sequence[Slave]:
        """The instances."""
        ...

    def set_inputs(self, place: int) -> None:
        """Set the inputs of a component to what its sources' slots say."""
        ...

    def read(self, reading: Reading) -> list[FloatArray]:
        """Return outputs of a component as its inputs are now, an array for each group."""
        ...


@dataclass(frozen=True)
class Loop:
    """The outputs of a loop: `readings` one for each component, `path` the loop as text.

    `settles`: whether it may be a loop for want of dependencies only, so that values are put in first, to see whether
    they settle; what does not goes on from where that has led.
    """

    readings: tuple[Reading, ...]
    path: tuple[str, ...]
    settles: bool = True

    @cached_property
    def groups(self) -> tuple[tuple[int, Group], ...]:
        """The groups of outputs, each with the place of its component."""
        return tuple((r.component, group) for r in self.readings for group in r.groups)

    @cached_property
    def slots(self) -> IntArray:
        """The slots of x."""
        return np.concatenate([group.slots for _, group in self.groups])

    def part(self, places: Sequence[int]) -> "Loop":
        """Return what is left of the loop where only some components are evaluated, the others' outputs given."""
        if all(r.component in places for r in self.readings):
            return self
        return replace(self, readings=tuple(r for r in self.readings if r.component in places))

    def solve(self, around: Around) -> bool:
        """Find x from the values that are known, and leave the components' inputs at it.

        Returns whether it took more than to put the values in. Raises `AlgebraicLoop` if there is no solution near or
        an FMU fails on the way to it, `CallFailed` for one that fails at values that it gave itself.
        """
        if self.settles and self._settled(around):
            return False
        if any(group.kind != Kind.REAL for _, group in self.groups):
            raise AlgebraicLoop(self.path, "its values, some of which are not Real, do not settle")
        around.values[self.slots] = self._root(around, around.values[self.slots].copy())
        return True

    def fits(self, around: Around) -> bool:
        """Whether the values are a solution."""
        x: FloatArray = around.values[self.slots].copy()
        fits = self._small(self._passed(around, x) - x, x, TOLERANCE)
        around.values[self.slots] = x
        return fits

    def _settled(self, around: Around) -> bool:
        x: FloatArray = around.values[self.slots].copy()
        for _ in range(len(x) + 1):
            new = self._passed(around, x)
            if same_bits(new, x):
                return True
            x = new
        return False

    def _passed(self, around: Around, x: FloatArray) -> FloatArray:
        """Return G(x)."""
        around.values[self.slots] = x
        self.pass_on(around)
        for reading in self.readings:
            around.set_inputs(reading.component)
        return np.concatenate([values for r in self.readings for values in around.read(r)])

    def pass_on(self, around: Around) -> None:
        """Let faults act on x."""
        for reading in self.readings:
            for passage in around.components[reading.component].outputs.passages:
                passage.show(around.values, around.time)

    @staticmethod
    def _small(change: FloatArray, x: FloatArray, part: float) -> bool:
        return bool(np.all(np.abs(change) <= part * np.maximum(1.0, np.abs(x))))

    def _root(self, around: Around, start: FloatArray) -> FloatArray:
        derivatives = all(around.slaves[r.component].description.provides_directional_derivative for r in self.readings)
        try:
            x = self._newton(around, start) if derivatives else None
            if x is None:
                x = self._powell(around, start, derivatives=derivatives)
            fits = self._small(self._passed(around, x) - x, x, TOLERANCE)
        except CallFailed as error:
            raise AlgebraicLoop(
                self.path, f"the loop could not be solved ({error})", component=error.component
            ) from error
        if not fits:
            raise AlgebraicLoop(self.path, "no solution of the loop was found")
        return x

    def _newton(self, around: Around, x: FloatArray) -> FloatArray | None:
        """Return x by (1), None where it does not converge."""
        near = False
        for _ in range(STEPS):
            residual = self._passed(around, x) - x
            if not np.isfinite(residual).all():
                return None
            try:
                change = np.linalg.solve(self._jacobian(around), -residual).astype(np.float64)  # (1)
            except np.linalg.LinAlgError:
                return None
            x = x + change
            if self._small(change, x, ROUNDING) or (near and self._small(change, x, TOLERANCE)):
                return x
            near = self._small(change, x, TOLERANCE)
        return None

    def _powell(self, around: Around, start: FloatArray, *, derivatives: bool) -> FloatArray:
        from scipy.optimize import root  # takes long to import, and few systems have a loop

        def jacobian(x: FloatArray) -> FloatArray:
            self._passed(around, x)
            return self._jacobian(around)

        def residual(x: FloatArray) -> FloatArray:
            return self._passed(around, x) - x

        return np.asarray(root(residual, start, jac=jacobian if derivatives else None, tol=ROUNDING).x)

    def _jacobian(self, around: Around) -> FloatArray:
        """Return J at the values that are set, shape (n, n), column by column of each component's inputs."""
        matrix = -np.eye(len(self.slots))
        place = {slot: (i, 1.0) for i, slot in enumerate(self.slots)}
        for reading in self.readings:  # what passes with a fault on the way moves with its source
            for passage in around.components[reading.component].outputs.passages:
                if passage.source in place:
                    place[passage.first] = place[passage.source][0], passage.gain(around.values)
        for component, group in self.groups:
            inputs, slave = around.components[component].inputs, around.slaves[component]
            rows = [place[slot][0] for slot in group.slots]
            for j, (slot, reference) in enumerate(zip(inputs.source, inputs.references, strict=True)):
                if slot in place:
                    column, gain = place[slot]
                    seed = np.array([gain * inputs.factor[j]])
                    matrix[rows, column] += slave.directional_derivative(group.references, (reference,), seed)
        return matrix


def solve_linear(evaluate: Callable[[FloatArray], FloatArray], n: int) -> FloatArray:
    """Return s with s = evaluate(s), which is A s + b, shape (n,); the last call is with s.

    A is found column by column with steps of the size of b, so that no digits are lost in the differences. Raises
    `numpy.linalg.LinAlgError` where 1 - A is singular.
    """
    b = evaluate(np.zeros(n))
    size = np.maximum(1.0, np.abs(b))
    a = np.column_stack([(evaluate(size[j] * unit) - b) / size[j] for j, unit in enumerate(np.eye(n))])
    s: FloatArray = np.linalg.solve(np.eye(n) - a, b).astype(np.float64)
    s += np.linalg.solve(np.eye(n) - a, evaluate(s) - s)  # what rounding has left
    evaluate(s)
    return s
