"""Smooth projection of an adaptive law: the estimate stays within a ball, its rate is Lipschitz.

    theta' = Phi                                                      if n < b or theta . Phi <= 0
    theta' = Phi - (n - b)/d (theta . Phi)/n theta,  n = |theta|^2    else                        (1)

Symbols: theta estimate, Phi rate without projection, b squared radius where it begins, d its width.
Source: D. Ye, Z. Sun, Y. Liu, An adaptive control algorithm for hybrid actuator with installation deviation, J. Harbin
Inst. Tech. 48(11), 2016, the law after its (26), with |theta|^2 where the print has |Phi|^2, and the factor theta that
it has lost.
Invariants: n <= b + d if it is so at the start.
"""

from typing import Any

import casadi as ca


def smooth(theta: Any, Phi: Any, b: Any, d: Any) -> Any:
    """Return the rate of an estimate: Phi without what would take |theta|^2 beyond b + d."""
    n, outward = ca.dot(theta, theta), ca.dot(theta, Phi)
    acts = ca.logic_and(n >= b, outward > 0)
    part = ca.if_else(acts, (n - b) / d * outward / ca.if_else(acts, n, 1), 0)
    return Phi - part * theta  # (1)
