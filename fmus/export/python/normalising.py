"""Unit vectors of an instance, divided by their length where they were typed: the twin of fmi2.c's normalise_typed."""

from typing import Any

from components.framework.unit_vectors import is_typed, lengths_said
from fmus.export.python.vector import Vector


def normalise(part: Any, vector: Vector, in_flight: bool) -> list[str]:
    """Divide what was typed by its length, in flight only parameters; return what is to be said of it."""
    function = part.functions.normalise
    if function is None:
        return []
    lengths, x, p = (r.full().ravel() for r in function(vector.x, vector.p))
    of_states, of_parameters = lengths_said(part.states), lengths_said(part.parameters)
    vector.p[:] = p
    if not in_flight:
        vector.x[:] = x
    told = zip([*of_states, *of_parameters], lengths, strict=True)
    divided = list(told)[len(of_states) if in_flight else 0 :]
    return [f"{vector.name}: {what} {n:.12g}. It was divided by that." for what, n in divided if is_typed(n)]
