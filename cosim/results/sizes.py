"""How large the numbers of a flight become: one that diverges, finite yet, is larger than at shorter steps."""

from collections.abc import Mapping

import numpy as np

from cosim.results.result import Result

ALIKE = 10.0
"""Two flights are alike whose values become as large as each other's up to this factor."""

NOISE = 1e-12
"""What is no larger is rounding."""


def sizes(run: Result) -> dict[str, float]:
    """Return the largest size of every recorded number, arrays whole."""
    numbers = {name: run[name] for name in run.names if run[name].dtype.kind in "fiub"}
    return {name: float(np.max(np.abs(values.astype(np.float64)), initial=0.0)) for name, values in numbers.items()}


def unlike(some: Mapping[str, float], others: Mapping[str, float]) -> str:
    """Return the first variable whose sizes are not alike, "" if all are."""
    for name in (name for name in others if name in some):
        a, b = max(some[name], NOISE), max(others[name], NOISE)
        if not b / ALIKE <= a <= b * ALIKE:
            return name
    return ""
