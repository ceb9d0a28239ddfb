"""The variables of one instance of a python FMU: one flat vector, and what of it may be set when.

Value reference = index into v = [p | c | u | x | y | s]: parameters, calculated parameters, inputs, states, other
outputs, the internal step taken (regions.py).
"""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from fmus.export.python.failure import RuntimeFailure
from fmus.export.python.modes import GETTABLE, INITIALIZATION, INSTANTIATED, SETTABLE, STEPPING, admit
from fmus.export.regions import step_taken


class Vector:
    """All variables at their start values; `mode`: in which of FMI's modes the instance is.

    What follows from others is brought up to date when something is read: a subclass writes `_evaluate`.
    """

    def __init__(self, component: Any, name: str):
        part, self.name = component, name
        groups = (
            part.parameters,
            part.calculated_parameters,
            part.inputs,
            part.states,
            part.outputs_declared,
            step_taken(part),
        )
        sizes = [part.size(g) for g in groups]
        ends = np.cumsum(sizes)
        self.v = np.zeros(int(ends[-1]))
        p, c, u, x, y, s = (slice(int(e) - n, int(e)) for e, n in zip(ends, sizes, strict=True))
        self.p, self.c, self.u, self.x, self.y, self.taken = (self.v[part] for part in (p, c, u, x, y, s))
        self.names = [n for g in groups for v in g for n in v.elements()]
        self._first_input, self._first_state = u.start, x.start
        self.e = self.y[: part.size(part.exact_outputs)]  # whose start is set
        settable = (part.parameters, part.inputs, part.states, part.exact_outputs)
        for group, values in zip(settable, (self.p, self.u, self.x, self.e), strict=True):
            values[:] = np.concatenate([np.zeros(0), *(np.ravel(v.start) for v in group)])
        before, between = np.zeros(len(self.v), bool), np.zeros(len(self.v), bool)
        before[p] = before[u] = between[u] = True
        before[x] = np.repeat([not s.calculated for s in part.states], [s.size for s in part.states])
        before[y.start : y.start + len(self.e)] = True
        between[p] = np.repeat([q.tunable for q in part.parameters], [q.size for q in part.parameters])
        self.mode = INSTANTIATED
        self._stale, self._parameters_stale = True, True
        self.given: np.ndarray | None = None  # inputs that a host has set, while others stand for them in v
        self._settable = {INSTANTIATED: before, INITIALIZATION: before, STEPPING: between}
        self._places: dict[tuple[int, ...], np.ndarray] = {}  # hosts pass the same references step after step
        self._admitted: dict[int, dict[tuple[int, ...], tuple[np.ndarray, bool]]] = {m: {} for m in self._settable}

    def _index(self, name: str) -> int | None:
        return self.names.index(name) if name in self.names else None

    def _evaluate(self) -> None:
        """Bring up to date what follows from what was set."""
        raise NotImplementedError

    def _check_tuned(self) -> None:
        """Refuse parameters that were changed in flight and break a condition."""

    def enter_initialization(self) -> None:
        """From now on what is calculated follows every set (fmi2EnterInitializationMode)."""
        admit(self.mode, "fmi2EnterInitializationMode", INSTANTIATED)
        self.mode = INITIALIZATION

    def get(self, references: Sequence[int]) -> list[float]:
        """Return variables by value reference, evaluated where something was set since."""
        admit(self.mode, "fmi2GetReal", GETTABLE)
        if self._stale:
            self._evaluate()
        key = tuple(references)
        index = self._places.get(key)
        if index is None:
            self._require_variables("fmi2GetReal", key)
            index = self._places[key] = np.array(key, dtype=np.intp)
        return (self.v if self.given is None else self._as_given(self.given))[index].tolist()

    def set(self, references: Sequence[int], values: Sequence[float]) -> None:
        """Set variables by value reference, all or none."""
        admit(self.mode, "fmi2SetReal", SETTABLE)
        key = tuple(references)
        index, parameters = self._admitted[self.mode].get(key) or self._admit(key)
        if not math.isfinite(sum(values)):
            bad = [(r, x) for r, x in zip(references, values, strict=True) if not math.isfinite(x)]
            if bad:
                raise RuntimeFailure(f"fmi2SetReal: variable {self.names[bad[0][0]]} = {bad[0][1]} is not finite.")
        before = self.p.copy() if parameters else None
        if self.given is None:
            self.v[index] = values
        else:
            self._give(self.given, index, values)
        self._stale = True
        if before is not None and self.p.tobytes() != before.tobytes():
            self._parameters_stale = True
            if self.mode == STEPPING:
                try:
                    self._check_tuned()
                except RuntimeFailure:
                    self.p[:] = before  # a refused call sets no parameter
                    raise

    def _as_given(self, inputs: np.ndarray) -> np.ndarray:
        """Return all variables, with the inputs that a host has set."""
        return np.concatenate([self.v[: self._first_input], inputs, self.v[self._first_state :]])

    def _give(self, inputs: np.ndarray, index: np.ndarray, values: Sequence[float]) -> None:
        """Set variables while others stand for the inputs that a host has set."""
        after = self._as_given(inputs)
        after[index] = values
        self.p[:], self.given = after[: len(self.p)], after[self._first_input : self._first_state]

    def require_real(self, function: str, references: Sequence[int]) -> None:
        """Refuse variables of another type: there are none."""
        if references:
            raise RuntimeFailure(f"{function}: all variables of {self.name} are Real.")

    def _admit(self, references: tuple[int, ...]) -> tuple[np.ndarray, bool]:
        """Return the index of references that may be set now, and whether a parameter is among them; remember both."""
        settable = self._settable[self.mode]
        self._require_variables("fmi2SetReal", references)
        for reference in references:
            if not settable[reference]:
                raise RuntimeFailure(f"fmi2SetReal: variable {self.names[reference]} cannot be set now.")
        found = np.array(references, dtype=np.intp), min(references, default=self._first_input) < self._first_input
        self._admitted[self.mode][references] = found
        return found

    def _require_variables(self, function: str, references: Sequence[int]) -> None:
        for reference in references:
            if not 0 <= reference < len(self.v):
                number = reference % 2**32  # pythonfmu hands over what is above 2^31 as a negative number
                raise RuntimeFailure(f"{function}: there is no Real variable with value reference {number}.")

    def _input_positions(
        self, references: Sequence[int], orders: Sequence[int], values: Sequence[float]
    ) -> list[tuple[int, int, float]]:
        """Return (index among the inputs, order, value) of input derivatives, once all of them are in order."""
        admit(self.mode, "fmi2SetRealInputDerivatives", SETTABLE)
        given = list(zip(references, orders, values, strict=True))
        for reference, order, value in given:
            name = self.names[reference] if 0 <= reference < len(self.v) else "(none)"
            what = f"fmi2SetRealInputDerivatives: variable {name}"
            if not self._first_input <= reference < self._first_state or order not in (1, 2, 3):
                raise RuntimeFailure(f"{what}, order {order}: inputs, order 1 to 3 only.")
            if not math.isfinite(value):
                raise RuntimeFailure(f"{what} = {value} is not finite.")
        return [(reference - self._first_input, order, value) for reference, order, value in given]
