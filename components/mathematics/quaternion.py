"""Unit quaternions, SCALAR FIRST, Hamilton: v_N = q_BN (x) v_B (x) q_BN*; q and -q are one attitude.

    a (x) b = [a0 b0 - a . b;  a0 b + b0 a + a x b]                                               (1)
    q' = 1/2 q (x) [0; omega_BN_B]                                                                (2)
    dcm_BN = (q0^2 - qv . qv) I + 2 qv qv^T - 2 q0 skew(qv),   v_B = dcm_BN v_N                   (3)
    q_BR = q_RN* (x) q_BN, with the sign of a scalar part >= 0: the short way                     (4)
    rotation vector: e = 2 atan(n / q0) qv / n,  n = |qv|;  near n = 0 the series of atan         (5)
    turn by an angle a about a unit axis: [cos(a/2); sin(a/2) axis]                               (6)
    4 q q^T from dcm_BN; q is its column with the largest diagonal element, scalar part >= 0      (7)
    turn by a rotation vector e: (6) with angle |e| and axis e / |e|;  near e = 0 the series      (8)
    q turned by a small rotation vector n: q (x) [1; n/2], normalised                             (9)

Source: textbook identities; the tests compare each with scipy.spatial.transform.Rotation (scalar_first=True).
Invariants: (2) keeps |q|; (5) has all derivatives at zero; (4), (5) and the angles from (3) are those of q / |q|.
Every result is a number for q = 0 too, so that it is a start's check that refuses it.
Limits: at half a turn the short way is either way: (4) jumps there.
"""

from typing import Any

import casadi as ca

from .vectors import direction


def product(a: Any, b: Any) -> Any:
    """Return the Hamilton product a (x) b."""
    a0, av, b0, bv = a[0], a[1:4], b[0], b[1:4]
    return ca.vertcat(a0 * b0 - ca.dot(av, bv), a0 * bv + b0 * av + ca.cross(av, bv))  # (1)


def conjugate(q: Any) -> Any:
    """Return q*, the inverse rotation."""
    return ca.vertcat(q[0], -q[1:4])


def about(axis: Any, angle: Any) -> Any:
    """Return the quaternion of a turn by an angle about a unit axis."""
    return ca.vertcat(ca.cos(angle / 2), ca.sin(angle / 2) * axis)  # (6)


def from_rotation_vector(e: Any) -> Any:
    """Return the quaternion of a turn by |e| about e, e in rad; the inverse of `rotation_vector` up to half a turn."""
    n2 = ca.dot(e, e)
    near = n2 <= 1e-4  # the next terms of the series are below 1e-16
    n = ca.sqrt(ca.if_else(near, 1, n2))
    scalar = ca.if_else(near, 1 - n2 / 8 + n2**2 / 384, ca.cos(n / 2))
    vector = ca.if_else(near, 0.5 - n2 / 48 + n2**2 / 3840, ca.sin(n / 2) / n)
    return ca.vertcat(scalar, vector * e)  # (8)


def turned(q: Any, n: Any) -> Any:
    """Return q turned by a small rotation vector n in body axes, as an error of a measurement: by 2 atan(|n|/2)."""
    return normalised(product(q, ca.vertcat(1, n / 2)))  # (9)


def normalised(q: Any) -> Any:
    """Return q / |q|, and 0 for q = 0."""
    return direction(q)


def short(q: Any) -> Any:
    """Return that of q and -q whose scalar part is not negative: the short way."""
    return q * ca.if_else(q[0] < 0, -1, 1)  # (4)


def rotate(q: Any, v: Any) -> Any:
    """Return q (x) v (x) q*: v_N from v_B with q_BN."""
    return dcm(q).T @ v


def dcm(q: Any) -> Any:
    """Return dcm_BN of q_BN, which takes v_N to v_B."""
    q0, qv = q[0], q[1:4]
    return (q0**2 - ca.dot(qv, qv)) * ca.DM.eye(3) + 2 * qv @ qv.T - 2 * q0 * ca.skew(qv)  # (3)


def from_dcm(C: Any) -> Any:
    """Return q_BN of dcm_BN, its scalar part not negative."""
    trace = ca.trace(C)
    first = ca.vertcat(1 + trace, C[1, 2] - C[2, 1], C[2, 0] - C[0, 2], C[0, 1] - C[1, 0])
    rest = C + C.T + (1 - trace) * ca.SX.eye(3)
    columns = ca.horzcat(first, ca.vertcat(first[1:4].T, rest))  # (7)
    best, size = columns[:, 0], columns[0, 0]
    for k in range(1, 4):
        larger = columns[k, k] > size
        best, size = ca.if_else(larger, columns[:, k], best), ca.if_else(larger, columns[k, k], size)
    return short(normalised(best))


def rate(q: Any, omega: Any) -> Any:
    """Return the time derivative of q_BN at the body rate omega_BN_B."""
    return product(q, ca.vertcat(0, omega)) / 2  # (2)


def error(q_BN: Any, q_RN: Any) -> Any:
    """Return q_BR, the attitude of the body relative to the reference, short way."""
    return short(product(conjugate(q_RN), q_BN))  # (4)


def rotation_vector(q: Any) -> Any:
    """Return axis times angle of a quaternion whose scalar part is not negative, in rad."""
    q0, qv = q[0], q[1:4]
    n2 = ca.dot(qv, qv)
    near = n2 <= 1e-8 * q0**2
    n = ca.sqrt(ca.if_else(near, 1, n2))
    scalar = ca.if_else(ca.logic_and(near, q0 != 0), q0, 1)
    x2 = n2 / scalar**2
    series = (1 - x2 / 3 + x2**2 / 5) / scalar
    return 2 * ca.if_else(near, series, ca.atan2(n, q0) / n) * qv  # (5)
