"""The Jacobian of a loop's residual f = F(x) - x, by differences: one step of the loop's members for each unknown."""

import numpy as np

from cosim.arrays import FloatArray
from cosim.masters.implicit.newton import Evaluate, weight
from cosim.masters.implicit.plan import Loop

DIFFERENCE = 1e-6
"""Of its weight, by which an unknown is moved: rounding and curvature each spoil some six digits of a column."""


def jacobian(loop: Loop, x: FloatArray, result: FloatArray, h: float, evaluate: Evaluate) -> FloatArray:
    """Return the Jacobian at x, where F(x) is `result`, shape (n, n); raises what the members raise."""
    moves = DIFFERENCE * weight(loop, x) / np.where(loop.slope, h, 1.0)
    matrix = np.zeros((loop.size, loop.size))
    for j, move in enumerate(moves):
        moved = x.copy()
        moved[j] += move
        move = moved[j] - x[j]
        matrix[:, j] = (evaluate(moved) - result) / move
        matrix[j, j] -= 1.0
    return matrix
