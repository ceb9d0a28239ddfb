"""Which conditions of an instance do not hold, and what each depends on: the twin of fmi2.c's `broken`."""

from typing import Any

from components.framework.unit_vectors import unit_conditions
from fmus.export.python.plain import Watched, namespaces
from fmus.export.python.vector import Vector

OF_PARAMETERS, OF_STATES, OF_INPUTS, OF_ANYTHING = 1, 2, 4, 7
"""What a condition depends on at most."""

Broken = list[tuple[int, str]]
"""What a condition that does not hold depends on, and its text."""


def broken(part: Any, t: float, vector: Vector) -> Broken:
    """Return the conditions that do not hold at time t, s."""
    return _plain(part, t, vector) if part.python_only else _symbolic(part, t, vector)


def _symbolic(part: Any, t: float, vector: Vector) -> Broken:
    f = part.functions
    margins, shown = (r.full().ravel() for r in f.check(t, vector.x, vector.u, vector.p, vector.c))
    numbers = iter(shown)
    texts = [c.text.format(*(f"{next(numbers):g}" for _ in c.shown)) for c in f.conditions]
    found = zip(f.lasting_conditions, f.conditions_of_inputs, texts, margins, strict=True)
    return [
        (OF_PARAMETERS if lasts else OF_INPUTS if moves else OF_STATES, text)
        for lasts, moves, text, margin in found
        if not margin > 0
    ]


def _plain(part: Any, t: float, vector: Vector) -> Broken:
    """In plain Python no one knows which conditions are of inputs: all are, of a check that reads any."""
    x, u, p = namespaces(part, vector)
    seen = Watched(u)
    checked = part.check(t, x, seen, p)
    kinds = [(OF_STATES, c) for c in unit_conditions(part, x, p)]
    kinds += [(OF_INPUTS if seen.is_read() else OF_STATES, c) for c in checked]
    return [(kind, c.text.format(*(f"{float(n):g}" for n in c.shown))) for kind, c in kinds if not c.margin > 0]
