"""Modified Rodrigues parameters sigma_BN = e tan(angle / 4).

    sigma = q_v / (1 + q_0), q the scalar-first quaternion                                               (1)
    sigma' = G(sigma) omega_BN_B,  G = 1/4 [(1 - s2) I + 2 skew(sigma) + 2 sigma sigma^T]                (2)
    G' = 1/2 [skew(sigma') + sigma' sigma^T + sigma sigma'^T - (sigma' . sigma) I]                       (3)
    G^-1 = 16 / (1 + s2)^2 G^T                                                                           (4)
with s2 = |sigma|^2. The shadow set -sigma / s2, the same attitude, is (1) of -q.
Source: D. Ye, Z. Sun, Y. Liu, An adaptive control algorithm for hybrid actuator with installation deviation, J. Harbin
Inst. Tech. 48(11), 2016: its equation (6), and G' above its (7); (1) is a textbook identity.
Limits: singular at a full turn, q_0 = -1.
"""

from typing import Any

import casadi as ca


def from_quaternion(q_BN: Any) -> Any:
    """Return sigma_BN of a scalar-first quaternion, as it is signed."""
    return q_BN[1:4] / (1 + q_BN[0])  # (1)


def G(sigma: Any) -> Any:
    """Return G: sigma' from the body rate."""
    s2 = ca.dot(sigma, sigma)
    return ((1 - s2) * ca.DM.eye(3) + 2 * ca.skew(sigma) + 2 * sigma @ sigma.T) / 4  # (2)


def G_dot(sigma: Any, sigma_dot: Any) -> Any:
    """Return the time derivative of G."""
    outer = sigma_dot @ sigma.T + sigma @ sigma_dot.T
    return (ca.skew(sigma_dot) + outer - ca.dot(sigma_dot, sigma) * ca.DM.eye(3)) / 2  # (3)


def G_inverse(sigma: Any) -> Any:
    """Return the inverse of G."""
    return 16 / (1 + ca.dot(sigma, sigma)) ** 2 * G(sigma).T  # (4)
