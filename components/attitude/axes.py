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


def pseudo_inverse(A: Any) -> Any:
    """Return A^+ of a matrix of full row rank."""
    return A.T @ ca.inv(A @ A.T)  # (1)


def axis_conditions(name: str, A: Any, spanning: bool = True) -> list[Condition]:
    """Return the conditions that the columns of A are unit vectors and span three dimensions."""
    norms = [ca.norm_2(A[:, i]) for i in range(A.shape[1])]
    text = "axis {} of {} has length {{}}, a unit vector (within 1e-6) is needed. Divide it by its length."
    conditions = [
        Condition(1e-6 - ca.fabs(norm - 1), text.format(i + 1, name), (norm,)) for i, norm in enumerate(norms)
    ]
    least = smallest_eigenvalue(A @ A.T)
    text = f"axes {name} do not span three dimensions (smallest eigenvalue of A A^T {{}}). No torque about one axis."
    return conditions + ([Condition(least - 1e-6, text, (least,))] if spanning else [])
