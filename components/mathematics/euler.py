"""Euler angles theta = (phi, th, psi) about body axes x, y, z: sequence 1-2-3 and sequence 3-2-1, in rad.

Sequence 1-2-3 turns by phi about x, then th about y, then psi about z:
    q_BN = q_x(phi) (x) q_y(th) (x) q_z(psi)                                                      (1)
    omega_BN_B = G(theta) theta',   G = [ cos psi cos th   sin psi   0                            (2)
                                         -sin psi cos th   cos psi   0
                                          sin th           0         1]
    omega_BN_B' = G theta'' + G' theta'                                                           (3)
    theta' = F omega_BN_B,  F = G^-1 = [ cos psi / cos th   -sin psi / cos th   0                 (4)
                                         sin psi             cos psi            0
                                        -cos psi tan th      sin psi tan th     1]
    theta'' = F (omega_BN_B' - G' theta')                                                         (5)
Sequence 3-2-1 turns by psi about z, then th about y, then phi about x:
    q_BN = q_z(psi) (x) q_y(th) (x) q_x(phi)                                                      (6)
    omega_BN_B = R(theta) theta',   R = [1  0         -sin th                                     (7)
                                         0  cos phi    sin phi cos th
                                         0 -sin phi    cos phi cos th]
    omega_BN_B' = R theta'' + R' theta'                                                           (8)

Frames: B body, N the frame that the angles start from (inertial, reference or orbit frame). Quaternions scalar first.
Source: (4) C. Zhang, Y. Sun, G. Ma, C. Li, Prescribed performance adaptive attitude tracking control for flexible
spacecraft, J. Harbin Inst. Tech. 50(4), 2018, equation (3); (7) B. Xiao, Q. Hu, G. Ma, Adaptive L2-gain controller for
flexible spacecraft attitude tracking, Control Theory & Applications 28(1), 2011, equation (2), with the sign of cos phi
corrected.
Limits: (4), (5) and the inverse of (7) are singular at th = +-90 deg, where phi and psi are not unique either.
"""

from typing import Any

import casadi as ca

from .quaternion import dcm, product

LOCK = 1e-3  # |cos th| under which a pitch counts as +-90 deg: within 0.06 deg


def _axis(i: int, angle: Any) -> Any:
    parts = [ca.cos(angle / 2), 0, 0, 0]
    parts[i] = ca.sin(angle / 2)
    return ca.vertcat(*parts)


def quaternion_from_123(theta: Any) -> Any:
    """Return q_BN of the angles of sequence 1-2-3."""
    return product(product(_axis(1, theta[0]), _axis(2, theta[1])), _axis(3, theta[2]))  # (1)


def angles_123(q_BN: Any) -> Any:
    """Return the angles of sequence 1-2-3; phi and psi in (-pi, pi], th in [-pi/2, pi/2]."""
    C = dcm(q_BN)
    phi = ca.atan2(-C[2, 1], C[2, 2])
    th = ca.atan2(C[2, 0], ca.sqrt(C[0, 0] ** 2 + C[1, 0] ** 2))
    psi = ca.atan2(-C[1, 0], C[0, 0])
    return ca.vertcat(phi, th, psi)  # (1)


def G_123(theta: Any) -> Any:
    """Return G: body rate from the rates of the angles of sequence 1-2-3."""
    _, th, psi = ca.vertsplit(theta)
    s, c = ca.sin(psi), ca.cos(psi)
    row_1 = ca.horzcat(c * ca.cos(th), s, 0)
    row_2 = ca.horzcat(-s * ca.cos(th), c, 0)
    return ca.vertcat(row_1, row_2, ca.horzcat(ca.sin(th), 0, 1))  # (2)


def G_dot_123(theta: Any, theta_dot: Any) -> Any:
    """Return the time derivative of G."""
    _, th, psi = ca.vertsplit(theta)
    _, th_dot, psi_dot = ca.vertsplit(theta_dot)
    s, c, st, ct = ca.sin(psi), ca.cos(psi), ca.sin(th), ca.cos(th)
    row_1 = ca.horzcat(-s * ct * psi_dot - c * st * th_dot, c * psi_dot, 0)
    row_2 = ca.horzcat(-c * ct * psi_dot + s * st * th_dot, -s * psi_dot, 0)
    return ca.vertcat(row_1, row_2, ca.horzcat(ct * th_dot, 0, 0))  # (3)


def F_123(theta: Any, floor: float = 0.0) -> Any:
    """Return F, the inverse of G; |cos th| counts as at least `floor`, so that it is finite."""
    _, th, psi = ca.vertsplit(theta)
    s, c, level = ca.sin(psi), ca.cos(psi), _level(th, floor)
    slope = ca.sin(th) / level
    row_1 = ca.horzcat(c / level, -s / level, 0)
    return ca.vertcat(row_1, ca.horzcat(s, c, 0), ca.horzcat(-c * slope, s * slope, 1))  # (4)


def acceleration_123(theta: Any, theta_dot: Any, omega_dot: Any, floor: float = 0.0) -> Any:
    """Return theta'' from the derivative of the body rate; `floor` as in F_123."""
    return F_123(theta, floor) @ (omega_dot - G_dot_123(theta, theta_dot) @ theta_dot)  # (5)


def quaternion_from_321(theta: Any) -> Any:
    """Return q_BN of the angles (phi, th, psi) of sequence 3-2-1."""
    return product(product(_axis(3, theta[2]), _axis(2, theta[1])), _axis(1, theta[0]))  # (6)


def angles_321(q_BN: Any) -> Any:
    """Return the angles of sequence 3-2-1; phi and psi in (-pi, pi], th in [-pi/2, pi/2]."""
    C = dcm(q_BN)
    phi = ca.atan2(C[1, 2], C[2, 2])
    th = ca.atan2(-C[0, 2], ca.sqrt(C[0, 0] ** 2 + C[0, 1] ** 2))
    psi = ca.atan2(C[0, 1], C[0, 0])
    return ca.vertcat(phi, th, psi)  # (6)


def R_321(theta: Any) -> Any:
    """Return R: body rate from the rates of the angles of sequence 3-2-1."""
    phi, th, _ = ca.vertsplit(theta)
    s, c, ct = ca.sin(phi), ca.cos(phi), ca.cos(th)
    return ca.vertcat(ca.horzcat(1, 0, -ca.sin(th)), ca.horzcat(0, c, s * ct), ca.horzcat(0, -s, c * ct))  # (7)


def R_dot_321(theta: Any, theta_dot: Any) -> Any:
    """Return the time derivative of R."""
    phi, th, _ = ca.vertsplit(theta)
    phi_dot, th_dot, _ = ca.vertsplit(theta_dot)
    s, c, st, ct = ca.sin(phi), ca.cos(phi), ca.sin(th), ca.cos(th)
    row_2 = ca.horzcat(0, -s * phi_dot, c * ct * phi_dot - s * st * th_dot)
    row_3 = ca.horzcat(0, -c * phi_dot, -s * ct * phi_dot - c * st * th_dot)
    return ca.vertcat(ca.horzcat(0, 0, -ct * th_dot), row_2, row_3)  # (8)


def _level(th: Any, floor: float) -> Any:
    level = ca.cos(th)
    return ca.if_else(level < 0, -1, 1) * ca.fmax(ca.fabs(level), floor)


def locked(theta: Any) -> Any:
    """Return whether the pitch of either sequence is as good as +-90 deg."""
    return ca.fabs(ca.cos(theta[1])) < LOCK


def rates_321(theta: Any, omega: Any, floor: float = 0.0) -> Any:
    """Return theta' of sequence 3-2-1 from the body rate; |cos th| counts as at least `floor`, so that it is finite."""
    phi, th, _ = ca.vertsplit(theta)
    level = _level(th, floor)
    turn = ca.sin(phi) * omega[1] + ca.cos(phi) * omega[2]
    pitch = ca.cos(phi) * omega[1] - ca.sin(phi) * omega[2]
    return ca.vertcat(omega[0] + ca.sin(th) / level * turn, pitch, turn / level)  # R^-1 omega of (7)
