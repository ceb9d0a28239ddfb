"""What a component in plain Python computes between an FMU's calls: its functions see floats and arrays by name."""

from types import SimpleNamespace
from typing import Any

import numpy as np

from fmus.export.python.failure import RuntimeFailure
from fmus.export.python.vector import Vector


def evaluate_outputs(part: Any, t: float, vector: Vector) -> None:
    """Bring the outputs up to date."""
    _store("outputs", part.outputs_declared, vector.y, part.outputs(t, *namespaces(part, vector)))


def advance(part: Any, t: float, step: float, vector: Vector) -> None:
    """Bring the states from t to t + step."""
    if part.states:
        _store("step", part.states, vector.x, part.step(t, step, *namespaces(part, vector)))


class Watched:
    """A namespace of which it is noted whether anything was read."""

    def __init__(self, space: SimpleNamespace):
        self._space, self._read = space, False

    def __getattr__(self, name: str) -> Any:
        self._read = True
        return getattr(self._space, name)

    def is_read(self) -> bool:
        """Whether anything was read."""
        return self._read


def namespaces(part: Any, vector: Vector) -> list[SimpleNamespace]:
    """Return x, u, p under their names; arrays are copies."""
    spaces: list[SimpleNamespace] = []
    for group, flat in ((part.states, vector.x), (part.inputs, vector.u), (part.parameters, vector.p)):
        at, values = 0, {}
        for v in group:
            array = flat[at : at + v.size].copy()
            values[v.name] = array.reshape(v.shape) if v.shape else float(array[0])
            at += v.size
        spaces.append(SimpleNamespace(**values))
    return spaces


def _store(where: str, group: Any, flat: np.ndarray, values: Any) -> None:
    """Take what a component's function returned, if it is what was declared."""
    names = [v.name for v in group]
    if not isinstance(values, dict):
        raise RuntimeFailure(f"{where} returns {type(values).__name__}, a dictionary with {sorted(names)} is needed.")
    if sorted(values) != sorted(names):
        raise RuntimeFailure(f"{where} returns {sorted(values)}, declared are {sorted(names)}.")
    at = 0
    for v in group:
        given = np.asarray(values[v.name])
        if given.dtype.kind not in "fiub":
            kind = "complex" if given.dtype.kind == "c" else type(values[v.name]).__name__
            raise RuntimeFailure(f"{where}: {v.name} is {kind}, declared as real numbers of shape {v.shape}.")
        array = given.astype(float)
        if array.shape != v.shape:
            raise RuntimeFailure(f"{where}: {v.name} has shape {array.shape}, declared with {v.shape}.")
        flat[at : at + v.size] = array.ravel()
        at += v.size
