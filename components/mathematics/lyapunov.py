"""The Lyapunov equation of an error e'' = -K_1 e - K_2 e' of three components, as a linear equation.

    A^T P + P A = -Q,  A = [0, 1; -K_1, -K_2],  P = [P_11, P_12; P_12^T, P_22], Q alike           (1)
block by block, P_11 and P_22 symmetric:
    K_1^T P_12^T + P_12 K_1 = Q_11                                                                (2)
    K_2^T P_22 + P_22 K_2 - P_12 - P_12^T = Q_22                                                  (3)
    P_11 = K_1^T P_22 + P_12 K_2 - Q_12                                                           (4)
(2), (3) and that (4) is symmetric are 15 equations for the 15 numbers of P_12 and P_22. K_1, K_2, Q diagonal, Q_12 = 0:
    P_12 = Q_11/(2 K_1),  P_22 = (Q_22 + 2 P_12)/(2 K_2),  P_11 = K_2 P_12 + K_1 P_22             (5)
    pivots of a symmetric matrix (Gauss): all positive where it is positive definite              (6)
With Q positive definite, A is Hurwitz (every eigenvalue left of the imaginary axis) just where P is positive definite.

Source: textbook (Lyapunov's matrix equation; Sylvester's law of inertia).
Limits: (1) has no solution where two eigenvalues of A add up to zero: P is then not finite, its pivots not positive.
"""

from typing import Any

import casadi as ca

PAIRS = [(i, j) for i in range(3) for j in range(i, 3)]  # of a symmetric matrix
SKEW = [(0, 1), (0, 2), (1, 2)]


def solve(K_1: Any, K_2: Any, Q_11: Any, Q_12: Any, Q_22: Any) -> tuple[Any, Any, Any]:
    """Return P_11, P_12 and P_22, each 3 x 3; by (5) where all is diagonal, so that axes do not meet in rounding."""
    whole = _coupled(K_1, K_2, Q_11, Q_12, Q_22)
    apart = _diagonal(*(ca.diag(matrix) for matrix in (K_1, K_2, Q_11, Q_22)))
    beside = [matrix - ca.diag(ca.diag(matrix)) for matrix in (K_1, K_2, Q_11, Q_22)]
    coupled = ca.sumsqr(ca.vertcat(*(ca.vec(matrix) for matrix in (*beside, Q_12)))) > 0
    P_11, P_12, P_22 = (ca.if_else(coupled, a, b) for a, b in zip(whole, apart, strict=True))
    return P_11, P_12, P_22


def pivots(A: Any) -> list[Any]:
    """Return the pivots of a symmetric matrix."""
    found, rest = list[Any](), A
    while rest.shape[0]:
        first, column = rest[0, 0], rest[1:, 0]
        found.append(first)
        rest = rest[1:, 1:] - column @ column.T / first  # (6)
    return found


def _coupled(K_1: Any, K_2: Any, Q_11: Any, Q_12: Any, Q_22: Any) -> tuple[Any, Any, Any]:
    unknown = ca.SX.sym("unknown", 15)
    P_12 = ca.reshape(unknown[:9], 3, 3)
    P_22 = ca.SX(3, 3)
    for k, (i, j) in enumerate(PAIRS):
        P_22[i, j] = P_22[j, i] = unknown[9 + k]
    P_11 = K_1.T @ P_22 + P_12 @ K_2 - Q_12  # (4)
    first = K_1.T @ P_12.T + P_12 @ K_1 - Q_11  # (2)
    second = K_2.T @ P_22 + P_22 @ K_2 - P_12 - P_12.T - Q_22  # (3)
    rest = (
        [first[i, j] for i, j in PAIRS] + [second[i, j] for i, j in PAIRS] + [P_11[i, j] - P_11[j, i] for i, j in SKEW]
    )
    slope, constant = ca.linear_coeff(ca.vertcat(*rest), unknown, True)
    found = ca.solve(slope, -constant)
    first_block, mixed, last = (ca.substitute(matrix, unknown, found) for matrix in (P_11, P_12, P_22))
    return first_block, mixed, last


def _diagonal(K_1: Any, K_2: Any, Q_11: Any, Q_22: Any) -> tuple[Any, Any, Any]:
    P_12 = Q_11 / (2 * K_1)  # (5)
    P_22 = (Q_22 + 2 * P_12) / (2 * K_2)  # (5)
    return ca.diag(K_2 * P_12 + K_1 * P_22), ca.diag(P_12), ca.diag(P_22)  # (5)
