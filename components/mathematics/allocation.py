"""Sharing a demand among redundant actuators, the columns of A (a row a demand, e.g. 3 x n), and what limits do to it.

    W A^T (A W A^T)^-1 v: of all x with A x = v the one with the least x . W^-1 x                 (1)
    W A^T (A W A^T + V)^-1 v: singularity robust, A x = v only approximately                      (2)
    limited: x min(1, min_i limit_i / |x_i|), the direction is kept                               (3)
    dead zone: x_i = 0 where |x_i| < zone                                                         (4)
    measure of singularity: det(A A^T), or det(A^T A) where A has fewer columns than rows         (5)

Frames: A and v in one frame, e.g. body axes B. W: a column, the diagonal of the weights, or a square matrix.
Source: (1) the weighted Moore-Penrose inverse of a matrix of full row rank (without weights: axes.py); (2), (3)
Y. Geng, W. Wu, Y. Ma, Neural network compensation of flexible satellite rapid maneuver, J. Harbin Inst. Tech. 44(5),
2012.
Invariants: (5) is the product of the squared singular values.
Limits: A must have full row rank in (1); not in (2) if V is positive definite.
"""

from typing import Any

import casadi as ca


def weighted_inverse(A: Any, W: Any) -> Any:
    """Return W A^T (A W A^T)^-1."""
    return robust_inverse(A, W, 0)  # (1)


def robust_inverse(A: Any, W: Any, V: Any) -> Any:
    """Return W A^T (A W A^T + V)^-1."""
    weighted = (ca.diag(W) if W.shape[1] == 1 else W) @ A.T
    return weighted @ ca.inv(A @ weighted + V)  # (2)


def limited(x: Any, limit: Any) -> Any:
    """Return x shortened, its direction kept, until no element exceeds its limit."""
    scale: Any = 1
    for i in range(x.numel()):
        size, bound = ca.fabs(x[i]), limit if ca.SX(limit).is_scalar() else limit[i]
        scale = ca.fmin(scale, ca.if_else(size > bound, bound / ca.if_else(size > bound, size, 1), 1))
    return scale * x  # (3)


def dead_zone(x: Any, zone: Any) -> Any:
    """Return x with elements smaller than the zone set to zero."""
    return ca.if_else(ca.fabs(x) < zone, 0, x)  # (4)


def singularity(A: Any) -> Any:
    """Return the product of the squared singular values of A: zero where A loses rank."""
    if not A.numel():
        return ca.SX(1)
    return ca.det(A @ A.T if A.shape[1] >= A.shape[0] else A.T @ A)  # (5)
