"""Small dense linear algebra, operation by operation as the kernel does it, so that both loops give the same bits."""

import numpy as np

from cosim.arrays import FloatArray


def solve(matrix: FloatArray, right: FloatArray) -> FloatArray | None:
    """Return x of `matrix` x = `right` by Gaussian elimination with partial pivoting; None where it is singular."""
    a, x = matrix.copy(), right.copy()
    n = len(x)
    for j in range(n):
        pivot = j + int(np.argmax(np.abs(a[j:, j])))
        if not np.isfinite(a[pivot, j]) or a[pivot, j] == 0:
            return None
        if pivot != j:
            a[[j, pivot]] = a[[pivot, j]]
            x[[j, pivot]] = x[[pivot, j]]
        factor = a[j + 1 :, j] / a[j, j]
        a[j + 1 :, j:] -= factor[:, np.newaxis] * a[j, j:]
        x[j + 1 :] -= factor * x[j]
    for j in range(n - 1, -1, -1):
        x[j] = x[j] / a[j, j]
        x[:j] -= a[:j, j] * x[j]
    return x


def broyden(jacobian: FloatArray, residual: FloatArray, step: FloatArray) -> FloatArray:
    """Return the Jacobian after a Newton step that left a residual (Broyden 1965): J + f s^T / s^T s.

    A step of no length says nothing new.
    """
    square = 0.0
    for s in step.tolist():
        square += s * s
    if square == 0:
        return jacobian
    return jacobian + (residual / square)[:, np.newaxis] * step
