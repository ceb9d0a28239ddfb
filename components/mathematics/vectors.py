"""Lengths, symmetric 3 x 3 matrices.

    asymmetry of A: the largest |a_ij - a_ji|                                                     (1)
    |v| = sqrt(v . v), with slope 0 at v = 0;  direction v / |v|, 0 for v = 0                     (2)
    eigenvalues of a symmetric A: m + 2 r cos(phi - 2 pi k / 3), k = 0, 1, 2,                     (3)
        m = tr A / 3, r^2 = tr (A - m I)^2 / 6, cos 3 phi = det((A - m I) / r) / 2

Source: (3) is the trigonometric solution of the characteristic polynomial.
Limits: (3) is exact to about 1e-8 of the largest eigenvalue where two are equal.
"""

from typing import Any

import casadi as ca


def length(v: Any) -> Any:
    """Return the Euclidean norm of a column; its derivative at zero is zero, where that of a square root has none."""
    square = ca.dot(v, v)
    return ca.if_else(square > 0, ca.sqrt(ca.if_else(square > 0, square, 1)), 0)  # (2)


def direction(v: Any) -> Any:
    """Return v / |v|, and 0 for v = 0."""
    size = length(v)
    return v / ca.if_else(size > 0, size, 1)  # (2)


def smallest_eigenvalue(A: Any) -> Any:
    """Return the smallest eigenvalue of a symmetric 3 x 3 matrix."""
    mean = ca.trace(A) / 3
    B = A - mean * ca.DM.eye(3)
    r = ca.sqrt(ca.sumsqr(B) / 6)
    scaled = B / ca.if_else(r > 0, r, 1)
    phi = ca.acos(ca.fmax(-1, ca.fmin(1, ca.det(scaled) / 2))) / 3
    return mean + 2 * r * ca.cos(phi + 2 * ca.pi / 3)  # (3)


def asymmetry(A: Any) -> Any:
    """Return the largest difference between an element of a matrix and its mirror image."""
    return ca.mmax(ca.fabs(A - A.T))  # (1)
