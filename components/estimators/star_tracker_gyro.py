"""Star tracker and gyro: attitude and rate of a body with white noise, sampled.

    q_BN = q_true (x) [1; n/2] normalised, n white noise of each axis                             (1)
    omega_BN_B = omega_true + n, n white noise of each axis                                       (2)

Frames: B body, N inertial. An output has the name of what it measures, the true one is q_BN_true, omega_BN_B_true.
Source: made for J. Li, H. Fan, Design of adaptive neural network controllers for LEO drag-free satellite, Computing
Technology and Automation 33(2), 2014.
Invariants: |q_BN| = 1; the same seed gives the same noise.
Limits: no bias, no misalignment, no delay, no blinding.
"""

from typing import Any

from ..framework import Component, Condition, Input, Output, Parameter, State, not_negative
from ..framework.ports import NO_ROTATION
from ..mathematics import quaternion
from ..mathematics.noise import white
from ..numbers import neutral
from ..vehicle import quaternion_condition


class StarTrackerGyro(Component):
    role = "sensor"
    sample_time = neutral.SAMPLE

    attitude_noise = Parameter(unit="rad/Hz^(1/2)", shape=(3,), doc="density of the star tracker's noise")
    rate_noise = Parameter(unit="rad/s/Hz^(1/2)", shape=(3,), doc="density of the gyro's noise")
    seed = Parameter(unit="1", start=21.0, doc="seed of the noise, a whole number")

    q_BN_true = Input(unit="1", shape=(4,), start=NO_ROTATION, doc="attitude of the body, scalar first")
    omega_BN_B_true = Input(unit="rad/s", shape=(3,), nominal=1e-3, doc="rate of the body")
    q_seen = State(unit="1", shape=(4,), start=NO_ROTATION, unit_length=True, doc="attitude measured last")
    omega_seen = State(unit="rad/s", shape=(3,), nominal=1e-3, doc="rate measured last")
    q_BN = Output(unit="1", shape=(4,), doc="measured attitude of the body, scalar first")
    omega_BN_B = Output(unit="rad/s", shape=(3,), nominal=1e-3, doc="measured rate of the body")
    valid = Output(unit="1", doc="1: the measurement can be used")

    def update(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        n = white(t, p.sample_time, p.seed, p.attitude_noise)
        return {
            "q_seen": quaternion.turned(u.q_BN_true, n),  # (1)
            "omega_seen": u.omega_BN_B_true + white(t, p.sample_time, p.seed, p.rate_noise, 3),  # (2)
        }

    def outputs(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"q_BN": x.q_seen, "omega_BN_B": x.omega_seen, "valid": 1}

    def check(self, t: Any, x: Any, u: Any, p: Any) -> list[Condition]:
        return [
            *not_negative(self, p, "attitude_noise", "rate_noise"),
            quaternion_condition("q_BN_true", u.q_BN_true),
        ]
