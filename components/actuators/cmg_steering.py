"""Steering of gyros with parallel gimbal axes and of wheels beside them: from a torque to rates and accelerations.

The gimbals turn about z, so that the gyros give torque in the x-y plane only. Columns of A, h_0 the mean momentum:
    A_i = (h_i / h_0) [-sin gamma_i; cos gamma_i],  m = det(A A^T) = sum_i<j (A_i x A_j)^2        (1)
    h'_xy = -c u_xy,  u_xy the command, shortened to plane_torque_limit                           (2)
    c = 3 z^2 - 2 z^3,  z = (|e| + T |w| - near) / (far - near), kept within 0 to 1               (3)
    gamma' = W A^T (A W A^T + V)^-1 h'_xy / h_0                                                   (4)
    lambda = lambda_0 exp(-alpha m),  k = k_0 cos(k_frequency t)                                  (5)
    V = lambda [1 k; k 1],  W = I + lambda (ones - I)                                             (6)
gamma' is shortened, its direction kept, to the largest rate, then rates within the dead zone are not commanded. The
wheels give what the gyros will not, each within its torque, in the plane only where b is 1:
    a = -A_w^+ diag(b, b, 1) (u - u_gyros) / I_w,  u_gyros = [-h_0 A gamma'; 0]                   (7)
    trim_wheels = 0: b = 0;  1: b = 1;  2: b = 1 in the end phase, where c of (3) is below 1, else 0      (8)
With hand_over = 0 the gyros keep the whole command, c = 1 in (2); (8) still goes by (3). Before the manoeuvre the
gimbals are only turned, at an even rate, and the wheels rest:
    t < start_time:  gamma' = (gimbal_start - gamma) / (start_time - t) in place of (4), a = 0    (9)
The matrix that (4) inverts, N = A W A^T + V, is symmetric: its least singular value is
    sigma_min = det N / (f + |[(N_11 - N_22) / 2, N_12]|),  f = (N_11 + N_22) / 2                (10)

Symbols: u tau_command_B, gamma gimbal_angle from x, h_i rotor_momentum, e attitude_error, w omega_BN_B, A_w
spin_axes_B, a wheel_acceleration_command, I_w wheel_inertia; all axes in B. W, V bring the gyros off a singularity.
Source: Y. Geng, W. Wu, Y. Ma, Neural network compensation of flexible satellite rapid maneuver, J. Harbin Inst. Tech.
44(5), 2012: (4)-(6); the equation numbers here are this file's. It prints a wheel about z, trim_wheels = 0, and
says that wheels about x and y act in the end phase only, 2. Of (9) it says that the gyros are turned before the
manoeuvre, parallel, without torque. Not in the paper: A normalised, (2), (3), trim_wheels = 1, when (9) ends.
Invariants: with trim_wheels = 1 the command is met exactly where neither a wheel nor the plane's limit cuts it; N is
positive definite, also where A is singular; (9) gives no torque where two equal gyros start against each other and are
turned by the same angle.
Limits: gyros with parallel gimbal axes; two equal ones have m = n (1 - n/4), n = |h|^2 / h_0^2, and are singular
wherever their momentum h is zero. What a limit cuts is not made up for later.
"""

from typing import Any

import casadi as ca

from ..framework import Component, Condition, Input, Output, Parameter, flag_conditions, not_negative, positive
from ..mathematics import allocation, axes
from ..mathematics.limits import saturated
from ..mathematics.vectors import length
from ..numbers import neutral
from ..vehicle import DEGREE, MomentumStorage, StorageLimits, limit_conditions


def _spread(component: Any) -> list[float]:
    """Return the start of gimbal angles: gyros against each other, off the body axes."""
    return [ca.pi / 4 + ca.pi * i for i in range(component.gimbals)]


class CmgSteering(Component):
    role = "steering"
    gimbals: int = 2  # structural: gyros with parallel gimbal axes
    wheels: int = 3  # structural: reaction wheels

    rotor_momentum = MomentumStorage.rotor_momentum
    spin_axes_B = MomentumStorage.spin_axes_B
    wheel_inertia = MomentumStorage.wheel_inertia
    gimbal_rate_limit = StorageLimits.gimbal_rate_limit
    gimbal_dead_zone = StorageLimits.gimbal_dead_zone
    plane_torque_limit = Parameter(
        unit="N.m", start=neutral.NO_LIMIT, doc="largest torque commanded in the x-y plane; 1e9: none"
    )
    wheel_torque_limit = StorageLimits.wheel_torque_limit
    trim_wheels = Parameter(
        unit="1",
        start=1.0,
        doc="1: wheels give what the gyros do not, 0: its z part only, 2: all of it in the end phase",
    )
    hand_over = Parameter(unit="1", start=1.0, doc="1: the gyros fade out near the reference, 0: c = 1")
    near = Parameter(unit="rad", start=0.3 * DEGREE, display_unit="deg", doc="|e| + T |w| where c is 0")
    far = Parameter(unit="rad", start=1.0 * DEGREE, display_unit="deg", doc="|e| + T |w| where c is 1")
    hand_over_time = Parameter(unit="s", start=4.0, doc="T, weight of the rate in the hand-over")
    lambda_0 = Parameter(unit="1", start=0.01, doc="lambda of a singular cluster")
    start_time = Parameter(unit="s", doc="start of the manoeuvre; before it the gimbals are turned to gimbal_start")
    gimbal_start = Parameter(
        unit="rad", shape=("gimbals",), start=_spread, display_unit="deg", doc="gimbal angles at start_time"
    )
    alpha = Parameter(unit="1", start=10.0, doc="how fast lambda falls with the measure of singularity")
    k_0 = Parameter(unit="1", start=0.1, doc="amplitude of the off-diagonal weight k")
    k_frequency = Parameter(unit="rad/s", start=1.0, doc="frequency of the off-diagonal weight k")

    tau_command_B = Input(unit="N.m", shape=(3,), doc="torque wanted on the hub")
    attitude_error = Input(unit="rad", shape=(3,), display_unit="deg", nominal=1e-2, doc="attitude error, for c")
    omega_BN_B = Input(unit="rad/s", shape=(3,), display_unit="deg/s", nominal=1e-2, doc="body rate, for c")
    gimbal_angle = Input(
        unit="rad",
        shape=("gimbals",),
        start=_spread,
        display_unit="deg",
        doc="gimbal angles",
    )

    gimbal_rate_command = Output(
        unit="rad/s", shape=("gimbals",), display_unit="deg/s", nominal=1e-2, doc="gimbal rates"
    )
    wheel_acceleration_command = Output(unit="rad/s2", shape=("wheels",), doc="wheel accelerations")
    tau_planned_B = Output(unit="N.m", shape=(3,), doc="torque on the hub that the commands amount to")
    share = Output(unit="1", doc="c, part of the plane's torque that is asked of the gyros")
    singularity = Output(unit="1", doc="m = det(A A^T), 0: the gyros give torque in one direction only")
    inverted_determinant = Output(unit="1", doc="det(A W A^T + V), of the matrix that is inverted")
    inverted_singular_value = Output(unit="1", doc="sigma_min, least singular value of A W A^T + V")
    saturated = Output(unit="1", doc="1 where the command is not met, else 0")

    def outputs(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        h_0 = ca.sum1(p.rotor_momentum) / self.gimbals
        A = ca.horzcat(-ca.sin(u.gimbal_angle), ca.cos(u.gimbal_angle)).T @ ca.diag(p.rotor_momentum / h_0)  # (1)
        pairs = [(i, j) for j in range(self.gimbals) for i in range(j)]
        m = sum((ca.SX(A[0, i] * A[1, j] - A[1, i] * A[0, j]) ** 2 for i, j in pairs), ca.SX(0))  # (1)
        lam, k = p.lambda_0 * ca.exp(-p.alpha * m), p.k_0 * ca.cos(p.k_frequency * t)  # (5)
        V = lam * ca.vertcat(ca.horzcat(1, k), ca.horzcat(k, 1))  # (6)
        W = lam * ca.SX.ones(self.gimbals, self.gimbals) + (1 - lam) * ca.SX.eye(self.gimbals)  # (6)
        share = self._share(u, p)
        c = ca.if_else(p.hand_over > 0.5, share, 1)
        norm = length(u.tau_command_B[:2])
        over = norm > p.plane_torque_limit
        wanted = u.tau_command_B[:2] * ca.if_else(over, p.plane_torque_limit / ca.if_else(over, norm, 1), 1)  # (2)
        waiting = t < p.start_time
        left = ca.if_else(waiting, p.start_time - t, 1)
        steered = allocation.robust_inverse(A, W, V) @ (-c * wanted) / h_0  # (2), (4)
        rates = ca.if_else(waiting, (p.gimbal_start - u.gimbal_angle) / left, steered)  # (9)
        rates = allocation.dead_zone(allocation.limited(rates, p.gimbal_rate_limit), p.gimbal_dead_zone)
        gyros = ca.vertcat(-h_0 * A @ rates, 0)  # (7)
        missing = ca.vertcat(wanted, u.tau_command_B[2]) - gyros
        trimming = ca.if_else(p.trim_wheels > 1.5, share < 1, p.trim_wheels > 0.5)  # (8)
        rest = ca.if_else(trimming, missing, ca.vertcat(0, 0, missing[2]))
        rest = ca.if_else(waiting, 0, rest)  # (9)
        wheels = saturated(axes.pseudo_inverse(p.spin_axes_B) @ rest, p.wheel_torque_limit)  # (7)
        planned = gyros + p.spin_axes_B @ wheels
        N = A @ W @ A.T + V
        largest = ca.trace(N) / 2 + length(ca.vertcat((N[0, 0] - N[1, 1]) / 2, N[0, 1]))
        return {
            "gimbal_rate_command": rates,
            "wheel_acceleration_command": -wheels / p.wheel_inertia,
            "tau_planned_B": planned,
            "share": c,
            "singularity": m,
            "inverted_determinant": ca.det(N),
            "inverted_singular_value": ca.det(N) / largest,  # (10)
            "saturated": ca.sumsqr(planned - u.tau_command_B) > 1e-18 * ca.sumsqr(u.tau_command_B),
        }

    def check(self, t: Any, x: Any, u: Any, p: Any) -> list[Condition]:
        conditions = [
            axes.spanning_condition("axes spin_axes_B", p.spin_axes_B),
            *limit_conditions(self, p),
            *positive(self, p, "rotor_momentum", "wheel_inertia", "plane_torque_limit", "lambda_0"),
            *not_negative(self, p, "hand_over_time", "alpha"),
            *flag_conditions(self, p, "hand_over"),
        ]
        mode = p.trim_wheels
        one = mode * (mode - 1) * (mode - 2) == 0
        conditions.append(Condition(one, "trim_wheels = {}: it must be 0, 1 or 2.", (mode,)))
        text = "near = {} deg, far = {} deg: far > near is needed."
        conditions.append(Condition(p.far - p.near, text, (p.near / DEGREE, p.far / DEGREE)))
        text = "k_0 = {}: it must be between -1 and 1, so that V is positive definite."
        return [*conditions, Condition(1 - ca.fabs(p.k_0), text, (p.k_0,))]

    def _share(self, u: Any, p: Any) -> Any:
        away = length(u.attitude_error) + p.hand_over_time * length(u.omega_BN_B)
        z = ca.fmax(0, ca.fmin((away - p.near) / (p.far - p.near), 1))
        return 3 * z**2 - 2 * z**3  # (3)
