"""Modified Rodrigues parameters sigma_BN = e tan(angle / 4).

    dcm_BN = I - 4 (1 - s2) / (1 + s2)^2 skew(sigma) + 8 / (1 + s2)^2 skew(sigma)^2, s2 = |sigma|^2      (1)
    sigma' = G(sigma) omega_BN_B,  G = 1/4 [(1 - s2) I + 2 skew(sigma) + 2 sigma sigma^T]                (2)
    G' = 1/2 [skew(sigma') + sigma' sigma^T + sigma sigma'^T - (sigma' . sigma) I]                       (3)
    G^-1 = 16 / (1 + s2)^2 G^T                                                                           (4)
    shadow set: -sigma / s2, the same attitude                                                           (5)
    sigma = q_v / (1 + q_0), q the scalar-first quaternion                                               (6)

Source: D. Ye, Z. Sun, Y. Liu, An adaptive control algorithm for hybrid actuator with installation deviation, J. Harbin
Inst. Tech. 48(11), 2016: C(sigma), its equation (6), and G' above its (7); (5), (6) are textbook identities.
Limits: singular at a full turn; (5) at s2 = 0 is infinite.
"""

from typing import Any

import casadi as ca


def from_quaternion(q_BN: Any) -> Any:
    """Return sigma_BN of a scalar-first quaternion, as it is signed."""
    return q_BN[1:4] / (1 + q_BN[0])  # (6)


def dcm(sigma: Any) -> Any:
    """Return dcm_BN, which takes v_N to v_B."""
    s2, S = ca.dot(sigma, sigma), ca.skew(sigma)
    return ca.DM.eye(3) - 4 * (1 - s2) / (1 + s2) ** 2 * S + 8 / (1 + s2) ** 2 * S @ S  # (1)


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


def shadow(sigma: Any) -> Any:
    """Return the shadow set where |sigma| > 1, else sigma."""
    s2 = ca.dot(sigma, sigma)
    return sigma * ca.if_else(s2 > 1, -1 / ca.if_else(s2 > 1, s2, 1), 1)  # (5)
