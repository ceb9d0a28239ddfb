"""Lengths, symmetric 3 x 3 matrices.

    asymmetry of A: the largest |a_ij - a_ji|                                                     (1)
    |v| = sqrt(v . v), with slope 0 at v = 0;  direction v / |v|, 0 for v = 0                     (2)
    eigenvalues of a symmetric A: m + 2 r cos(phi - 2 pi k / 3), k = 0, 1, 2,                     (3)
        m = tr A / 3, r^2 = tr (A - m I)^2 / 6, cos 3 phi = det((A - m I) / r) / 2
    square root U of a positive definite A, with a, b, c = tr A, sum of principal 2 x 2 minors, det A and those of U:
        a_U^2 - 2 b_U = a,  b_U^2 - 2 a_U c_U = b,  c_U^2 = c                                     (4)
        a_U by Newton's method from sqrt(3 a), which is never below it                            (5)
        U^3 - a_U U^2 + b_U U - c_U I = 0, hence U = (A + b_U I)^-1 (a_U A + c_U I)               (6)

Source: (3) is the trigonometric solution of the characteristic polynomial; (6) the theorem of Cayley and Hamilton.
Limits: (3) is exact to about 1e-8 of the largest eigenvalue where two are equal. (6) takes 20 rounds of (5), enough for
eigenvalues of A down to 1e-6 of the largest, of which it then has eight digits or more.
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


def square_root(A: Any) -> Any:
    """Return the positive definite square root of a positive definite 3 x 3 matrix, smooth at equal eigenvalues too."""
    a, b = ca.trace(A), sum(A[i, i] * A[j, j] - A[i, j] * A[j, i] for i, j in ((0, 1), (0, 2), (1, 2)))
    c_U = ca.sqrt(ca.det(A))  # (4)
    a_U = ca.sqrt(3 * a)
    for _ in range(20):
        b_U = (a_U**2 - a) / 2  # (4)
        a_U = a_U - (b_U**2 - 2 * a_U * c_U - b) / (2 * (a_U * b_U - c_U))  # (5)
    eye = ca.DM.eye(3)
    return ca.inv(A + (a_U**2 - a) / 2 * eye) @ (a_U * A + c_U * eye)  # (6)


def asymmetry(A: Any) -> Any:
    """Return the largest difference between an element of a matrix and its mirror image."""
    return ca.mmax(ca.fabs(A - A.T))  # (1)
