"""Multiplicative extended Kalman filter: attitude and gyro bias from a gyro and a star tracker, sampled as the gyro.

At every sample, T since the last one, w = w_m - b the rate measured over T less the bias estimated,
    q <- q (x) turn by w T,  g <- g (x) turn by w T                                               (1)
    P <- F P F^T + Q,  F = [A  -T A_1/2; 0  I],  A, A_1/2 from before to after the turn and half of it    (2)
    Q = [T sigma_v^2 + T^3/3 sigma_u^2   -T^2/2 sigma_u^2; -T^2/2 sigma_u^2   T sigma_u^2], diagonal blocks    (3)
and where a valid measurement q_m of a later exposure_time has arrived, s after its exposure, n samples at most memory,
    d = g_n* (x) g (x) turn by w (s - n T),  g_n what g was n samples ago                         (4)
    r = rotation vector of q* (x) q_m (x) d                                                       (5)
    H = [I  s I],  G = [s sigma_v^2; 0],  C = P H^T - G,  K = C (H C + R_s)^-1,  R_s = A_s R A_s^T    (6)
    q <- q (x) turn by (K r)_theta,  b <- b + (K r)_b                                             (7)
    P <- M P M^T + K (R_s + s sigma_v^2) K^T + M G K^T + (M G K^T)^T,  M = I - K H                (8)

Symbols: P covariance of the errors [theta; beta]: q_true = q (x) turn by theta, beta the true bias less b; w_m
omega_BN_B_measured; g the attitude by the gyro alone; A_s from before to after the turn d; sigma_v, sigma_u, R as in
attitude_sensing.py, as the filter assumes them. Frames: B body, N inertial. Inputs are measurements, in the outputs'
names with _measured.
Source: E. Lefferts, F. Markley, M. Shuster, Kalman filtering for spacecraft attitude estimation, J. Guidance, Control,
and Dynamics 5(5), 1982, for the multiplicative error, (1), (2) and, without delay, (5) to (7); (3) are the integrals of
the two walks, (8) is Joseph's form. The delay is of this file: from the exposure to now r gains s beta and the gyro's
noise of that time, whose covariance is s sigma_v^2 and which is in theta too, with the other sign.
Invariants: |q_BN| = 1; with what it assumes true, theta^T P_theta^-1 theta is chi-square of 3.
Limits: errors small against 1 rad once it has converged. (1) and (4) are exact for an integrating gyro and an exposure
at one of the last `memory` samples; for the rest of s the rate counts as constant, which errs by half the acceleration
times its square. F is right to (w T)^2 / 24, H to w s / 2. (6) has no measurement used between exposure and arrival:
with latencies beyond the time between measurements P is too small. It knows of no scale errors and misalignments, and
estimates none; P does not know of them.
"""

from dataclasses import replace
from typing import Any

import casadi as ca

from .. import attitude_sensing
from ..framework import Component, Condition, Input, Output, Parameter, State, positive
from ..framework.ports import NO_ROTATION
from ..mathematics import quaternion
from ..numbers import neutral
from ..vehicle import quaternion_condition


class MEKF(Component):
    role = "estimator"
    ports = (attitude_sensing.GyroNoise, attitude_sensing.TrackerNoise)
    sample_time = neutral.GYRO_SAMPLE
    memory: int = 20  # structural: samples whose turns it remembers, for late measurements

    angle_random_walk = replace(attitude_sensing.GyroNoise.angle_random_walk, start=neutral.ANGLE_WALK)
    rate_random_walk = replace(attitude_sensing.GyroNoise.rate_random_walk, start=neutral.RATE_WALK)
    cross_noise = replace(attitude_sensing.TrackerNoise.cross_noise, start=neutral.CROSS_NOISE)
    roll_noise = replace(attitude_sensing.TrackerNoise.roll_noise, start=neutral.ROLL_NOISE)
    sigma_q_BN_start = Parameter(
        unit="rad", start=0.1, display_unit="deg", doc="deviation of the attitude at the start, each axis"
    )
    sigma_bias_start = Parameter(
        unit="rad/s", start=1e-4, display_unit="deg/h", doc="deviation of the bias at the start, each axis"
    )

    q_BN_measured = Input(unit="1", shape=(4,), start=NO_ROTATION, doc="attitude by the star tracker, scalar first")
    exposure_time = Input(unit="s", doc="when that was the attitude; a later one makes it a new measurement")
    valid_measured = Input(unit="1", doc="1: it can be used, 0: it cannot")
    omega_BN_B_measured = Input(unit="rad/s", shape=(3,), nominal=1e-2, doc="rate by the gyro, mean over a sample time")

    q_estimate = State(unit="1", shape=(4,), start=NO_ROTATION, unit_length=True, doc="q, attitude estimated")
    bias_estimate = State(unit="rad/s", shape=(3,), display_unit="deg/h", nominal=1e-5, doc="b, bias estimated")
    P_attitude = State(unit="rad2", shape=(3, 3), calculated=True, nominal=1e-6, doc="P, of the attitude")
    P_cross = State(unit="rad2/s", shape=(3, 3), calculated=True, nominal=1e-9, doc="P, of attitude and bias")
    P_bias = State(unit="rad2/s2", shape=(3, 3), calculated=True, nominal=1e-12, doc="P, of the bias")
    omega_seen = State(unit="rad/s", shape=(3,), nominal=1e-2, doc="rate less bias")
    residual_seen = State(unit="rad", shape=(3,), nominal=1e-4, doc="r of the last measurement")
    q_gyro = State(unit="1", shape=(4,), start=NO_ROTATION, calculated=True, doc="g, attitude by the gyro alone")
    q_gyro_past = State(unit="1", shape=(4, "memory"), calculated=True, doc="g at the samples before, the latest first")
    time_last = State(unit="s", calculated=True, doc="time of the last sample")
    exposure_used = State(unit="s", start=-1e9, doc="exposure of the last measurement used")
    started = State(unit="1", calculated=True, doc="whether a measurement has been used")

    q_BN = Output(unit="1", shape=(4,), doc="estimated attitude of the body, scalar first")
    omega_BN_B = Output(unit="rad/s", shape=(3,), display_unit="deg/s", nominal=1e-2, doc="measured rate less bias")
    bias = Output(unit="rad/s", shape=(3,), display_unit="deg/h", nominal=1e-5, doc="estimated bias of the gyro")
    sigma_q_BN = Output(
        unit="rad", shape=(3,), display_unit="arcsec", nominal=1e-4, doc="deviation of the attitude, each axis"
    )
    sigma_bias = Output(
        unit="rad/s", shape=(3,), display_unit="deg/h", nominal=1e-5, doc="deviation of the bias, each axis"
    )
    residual = Output(
        unit="rad", shape=(3,), display_unit="arcsec", nominal=1e-4, doc="r of the last measurement that was used"
    )
    valid = Output(unit="1", doc="1: a measurement has been used, 0: it is the start, turned with the gyro")

    def initial(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {
            "P_attitude": p.sigma_q_BN_start**2 * ca.DM.eye(3),
            "P_cross": ca.SX.zeros(3, 3),
            "P_bias": p.sigma_bias_start**2 * ca.DM.eye(3),
            "q_gyro": ca.DM(NO_ROTATION),
            "q_gyro_past": ca.repmat(ca.DM(NO_ROTATION), 1, self.memory),
            "time_last": t,
            "started": 0,
        }

    def update(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        T, s = t - x.time_last, t - u.exposure_time
        w = u.omega_BN_B_measured - x.bias_estimate
        turn = quaternion.from_rotation_vector(w * T)
        q, g = (quaternion.product(attitude, turn) for attitude in (x.q_estimate, x.q_gyro))  # (1)
        past = ca.horzcat(quaternion.normalised(g), x.q_gyro_past)
        since = self._turn_since(past, w, s, p)
        r = quaternion.rotation_vector(quaternion.error(quaternion.product(u.q_BN_measured, since), q))  # (5)
        new = ca.logic_and(u.valid_measured > 0.5, u.exposure_time > x.exposure_used)
        K, P = self._corrected(self._propagated(x, w, T, p), new, since, s, p)
        correction = K @ r
        b = x.bias_estimate + correction[3:]
        return {
            "q_estimate": quaternion.normalised(
                quaternion.product(q, quaternion.from_rotation_vector(correction[:3]))  # (7)
            ),
            "bias_estimate": b,
            "P_attitude": (P[:3, :3] + P[:3, :3].T) / 2,
            "P_cross": P[:3, 3:],
            "P_bias": (P[3:, 3:] + P[3:, 3:].T) / 2,
            "omega_seen": u.omega_BN_B_measured - b,
            "residual_seen": ca.if_else(new, r, x.residual_seen),
            "q_gyro": past[:, 0],
            "q_gyro_past": past[:, : self.memory],
            "time_last": t,
            "exposure_used": ca.if_else(new, u.exposure_time, x.exposure_used),
            "started": ca.fmax(x.started, new),
        }

    def outputs(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {
            "q_BN": x.q_estimate,
            "omega_BN_B": x.omega_seen,
            "bias": x.bias_estimate,
            "sigma_q_BN": ca.sqrt(ca.diag(x.P_attitude)),
            "sigma_bias": ca.sqrt(ca.diag(x.P_bias)),
            "residual": x.residual_seen,
            "valid": x.started,
        }

    def check(self, t: Any, x: Any, u: Any, p: Any) -> list[Condition]:
        return [
            *attitude_sensing.gyro_conditions(self, p),
            *positive(self, p, "cross_noise", "roll_noise", "sigma_q_BN_start", "sigma_bias_start"),
            quaternion_condition("q_BN_measured", u.q_BN_measured),
        ]

    def _propagated(self, x: Any, w: Any, T: Any, p: Any) -> Any:
        """Return P a time T later."""
        A, half = (quaternion.dcm(quaternion.from_rotation_vector(part * w * T)) for part in (1, 0.5))
        zero, one = ca.DM.zeros(3, 3), ca.DM.eye(3)
        F = ca.blockcat([[A, -T * half], [zero, one]])
        v, walk = ca.diag(p.angle_random_walk**2), ca.diag(p.rate_random_walk**2)
        mixed = -(T**2) / 2 * walk
        Q = ca.blockcat([[T * v + T**3 / 3 * walk, mixed], [mixed, T * walk]])  # (3)
        P = ca.blockcat([[x.P_attitude, x.P_cross], [x.P_cross.T, x.P_bias]])
        return F @ P @ F.T + Q  # (2)

    def _turn_since(self, past: Any, w: Any, s: Any, p: Any) -> Any:
        """Return d, the turn of the last s, of `past`, g now and at the samples before."""
        n = ca.fmin(ca.fmax(ca.floor(s / p.sample_time + 0.5), 0), self.memory)
        then = past[:, 0]
        for samples in range(1, self.memory + 1):
            then = ca.if_else(n == samples, past[:, samples], then)
        rest = quaternion.from_rotation_vector(w * (s - n * p.sample_time))
        return quaternion.product(quaternion.product(quaternion.conjugate(then), past[:, 0]), rest)  # (4)

    def _corrected(self, P: Any, new: Any, since: Any, s: Any, p: Any) -> tuple[Any, Any]:
        """Return K, zero where there is no new measurement, and P after it."""
        H = ca.horzcat(ca.DM.eye(3), s * ca.DM.eye(3))
        walked = s * ca.diag(p.angle_random_walk**2)
        L = quaternion.dcm(since) @ attitude_sensing.deviation(p)
        G, R = ca.vertcat(walked, ca.DM.zeros(3, 3)), L @ L.T
        C = P @ H.T - G
        K = ca.if_else(new, C @ ca.inv(H @ C + R), 0)  # (6)
        M = ca.DM.eye(6) - K @ H
        mixed = M @ G @ K.T
        return K, M @ P @ M.T + K @ (R + walked) @ K.T + mixed + mixed.T  # (8)
