"""Gyro of three axes: bias with a random walk, angle random walk, scale factor, misalignment, range; sampled.

    b <- b + sigma_u T^1/2 n_u                                                                    (1)
    w = omega_BN_B_true; integrating = 1: mean over T, w = e/T, e rotation vector of q_last* (x) q_true    (2)
    m = (I + diag(k)) C w + 1/2 (b before (1) + b) + (sigma_v^2 / T + sigma_u^2 T / 12)^1/2 n_v   (3)
    omega_BN_B = min(max(m, -range), range),  angle_increment = T omega_BN_B                      (4)
Before the first sample there is no interval to average over: the body is taken to have turned at its rate,
    q_last = q_true (x) turn by -T omega_BN_B_true at the start                                   (5)

Symbols: T sample_time; b bias; sigma_v angle_random_walk, sigma_u rate_random_walk; n_u, n_v normal numbers of
deviation 1; k scale_error; C takes components in body axes to those in the gyro's, which are turned from them by
misalignment, a rotation vector; q_true at the sample, q_last at the one before.
Frames: B body, N inertial. An output has the name of what it measures, the true one is omega_BN_B_true.
Source: R. Farrenkopf, Analytic steady-state accuracy solutions for two common spacecraft attitude estimators, J.
Guidance and Control 1(4), 1978, for the two random walks. (1) and (3) are exact for them: of a Wiener process whose
ends over T are known, the mean has the mean of the ends and the variance sigma_u^2 T / 12 (that of a bridge).
Invariants: the sum of increments deviates from the angle by sigma_v t^1/2, with sigma_u^2 t^3 / 3 more variance and b t
of the bias at the start; without errors it is the angle itself about a fixed axis. The same seed gives the same noise.
Limits: no flicker noise (bias instability), no quantisation, no bandwidth, orthogonal axes. A rate gyro (integrating =
0) has the noise of one that integrates, and no anti-aliasing. (2) is the short way: less than half a turn in T.
"""

from typing import Any

import casadi as ca

from .. import attitude_sensing
from ..framework import Component, Condition, Input, Output, Parameter, State, flag_conditions, positive
from ..framework.ports import NO_ROTATION
from ..mathematics import quaternion
from ..mathematics.limits import saturated
from ..mathematics.noise import draws
from ..mathematics.vectors import length
from ..numbers import neutral
from ..vehicle import quaternion_condition


class Gyro(Component):
    role = "sensor"
    ports = attitude_sensing.GyroNoise
    sample_time = neutral.GYRO_SAMPLE

    integrating = Parameter(unit="1", doc="1: the mean rate since the last sample, from the attitude, 0: the rate now")
    scale_error = Parameter(unit="1", shape=(3,), doc="k, relative error of the scale factor of each axis")
    misalignment = Parameter(
        unit="rad", shape=(3,), display_unit="deg", doc="rotation vector from body axes to those of the gyro"
    )
    range = Parameter(
        unit="rad/s", start=neutral.NO_LIMIT, display_unit="deg/s", doc="largest rate of an axis; 1e9: none"
    )
    seed = Parameter(unit="1", start=31.0, doc="seed of the noise, a whole number")

    q_BN_true = Input(
        unit="1", shape=(4,), start=NO_ROTATION, doc="attitude of the body, scalar first; used if integrating"
    )
    omega_BN_B_true = Input(unit="rad/s", shape=(3,), display_unit="deg/s", nominal=1e-2, doc="rate of the body")
    bias = State(
        unit="rad/s", shape=(3,), output=True, display_unit="deg/h", nominal=1e-5, doc="b; its start is one sample ago"
    )
    q_last = State(unit="1", shape=(4,), start=NO_ROTATION, calculated=True, doc="attitude at the last sample")
    omega_seen = State(unit="rad/s", shape=(3,), nominal=1e-2, doc="rate measured last, without a limit")
    omega_BN_B = Output(unit="rad/s", shape=(3,), display_unit="deg/s", nominal=1e-2, doc="measured rate of the body")
    angle_increment = Output(unit="rad", shape=(3,), nominal=1e-4, doc="measured rate times the sample time")
    valid = Output(unit="1", doc="1: no axis is at the end of its range, else 0")

    def initial(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        back = quaternion.from_rotation_vector(-p.sample_time * u.omega_BN_B_true)
        return {"q_last": quaternion.product(u.q_BN_true, back)}  # (5)

    def update(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        T = p.sample_time
        walked = p.rate_random_walk * ca.sqrt(T) * draws(t, T, p.seed, 3)
        turn = quaternion.rotation_vector(quaternion.error(u.q_BN_true, x.q_last))
        omega = ca.if_else(p.integrating > 0.5, turn / T, u.omega_BN_B_true)  # (2)
        seen = (1 + p.scale_error) * (quaternion.dcm(quaternion.from_rotation_vector(p.misalignment)) @ omega)
        white, bridge = p.angle_random_walk / ca.sqrt(T), p.rate_random_walk * ca.sqrt(T / 12)
        deviation = ca.vertcat(*(length(ca.vertcat(white[i], bridge[i])) for i in range(3)))
        return {
            "bias": x.bias + walked,  # (1)
            "q_last": u.q_BN_true,
            "omega_seen": seen + x.bias + walked / 2 + deviation * draws(t, T, p.seed, 3, 3),  # (3)
        }

    def outputs(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        omega = saturated(x.omega_seen, p.range)
        return {
            "omega_BN_B": omega,  # (4)
            "angle_increment": p.sample_time * omega,  # (4)
            "valid": ca.mmax(ca.fabs(x.omega_seen)) < p.range,
        }

    def check(self, t: Any, x: Any, u: Any, p: Any) -> list[Condition]:
        return [
            *attitude_sensing.gyro_conditions(self, p),
            *positive(self, p, "range"),
            *flag_conditions(self, p, "integrating"),
            quaternion_condition("q_BN_true", u.q_BN_true),
        ]
