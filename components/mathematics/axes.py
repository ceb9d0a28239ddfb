"""Sharing a torque among actuators with fixed axes, the columns of A (3 x n).

    A^+ = A^T (A A^T)^-1: of all x with A x = v, A^+ v is the shortest                            (1)

Frames: A and v in one frame, e.g. body axes B.
Source: Moore-Penrose inverse of a matrix of full row rank, textbook identity.
Invariants: A A^+ = I.
Limits: the axes must span three dimensions.
"""

from typing import Any

import casadi as ca

from ..framework import Condition
from .vectors import smallest_eigenvalue

SPANNING = 1e-6  # smallest eigenvalue of A A^T under which axes count as in a plane


def pseudo_inverse(A: Any) -> Any:
    """Return A^+ of a matrix of full row rank."""
    return A.T @ ca.inv(A @ A.T)  # (1)


def pseudo_inverse_or_zero(A: Any) -> Any:
    """Return A^+, or zero where the columns of A do not span three dimensions."""
    return ca.if_else(smallest_eigenvalue(A @ A.T) > SPANNING, pseudo_inverse(A), 0)


def spanning_condition(what: str, A: Any, remedy: str = "No torque about one axis.") -> Condition:
    """Return the condition that the columns of A span three dimensions."""
    least = smallest_eigenvalue(A @ A.T)
    text = f"{what} do not span three dimensions (smallest eigenvalue of A A^T {{}}). {remedy}"
    return Condition(least - SPANNING, text, (least,))
