"""Single-gimbal control moment gyros: geometry of the rotors' momenta.

    t_0 = g x s_0                                                                                 (1)
    s = s_0 cos gamma + t_0 sin gamma                                                             (2)
    t = t_0 cos gamma - s_0 sin gamma,  s' = gamma' t                                             (3)
    h_B' = Q [gamma'; Om'],  Q = [h_i t_i, I_j a_j] with wheels beside them                       (4)

Symbols: a column a gyro; gamma gimbal angle, g gimbal axis, s rotor axis, t the direction that a gimbal rate turns the
momentum to, s_0 and t_0 at gamma = 0.
Source: D. Ye, Z. Sun, Y. Liu, An adaptive control algorithm for hybrid actuator with installation deviation, J. Harbin
Inst. Tech. 48(11), 2016, equations (3), (5), (11).
Invariants: (2), (3) are unit vectors if g and s_0 are, and at right angles; s' = gamma' t for any columns s_0, t_0.
"""

from typing import Any

import casadi as ca

from ..framework import Condition


def transverse(g: Any, s_0: Any) -> Any:
    """Return the columns t_0."""
    columns = [ca.cross(g[:, i], s_0[:, i]) for i in range(g.shape[1])]  # (1)
    return ca.horzcat(*columns) if columns else ca.SX(3, 0)


def rotated(s_0: Any, t_0: Any, gamma: Any) -> tuple[Any, Any]:
    """Return the columns s and t at the gimbal angles."""
    c, s = (ca.repmat(f(gamma).T, 3, 1) for f in (ca.cos, ca.sin))
    return s_0 * c + t_0 * s, t_0 * c - s_0 * s  # (2), (3)


def momentum_rates(t: Any, h: Any, spin_axes: Any, inertia: Any) -> Any:
    """Return Q, a column a gyro, then a column a wheel."""
    return ca.horzcat(t @ ca.diag(h), spin_axes @ ca.diag(inertia))  # (4)


def geometry_conditions(g: Any, s_0: Any) -> list[Condition]:
    """Return the conditions that each rotor axis is at right angles to its gimbal axis."""
    conditions: list[Condition] = []
    for i in range(g.shape[1]):
        cosine = ca.dot(g[:, i], s_0[:, i])
        text = f"axis {i + 1} of rotor_axes_B is not at right angles to its gimbal axis (cosine of the angle {{}})."
        conditions.append(Condition(1e-6 - ca.fabs(cosine), text, (cosine,)))
    return conditions
