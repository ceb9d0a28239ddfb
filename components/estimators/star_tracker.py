"""Star tracker: attitude at its own rate, late, turned by its misalignment, with noise across and about its boresight.

    at every n-th sample:  q_m = q_true (x) d (x) [1; v/2] normalised,  v = L w                   (1)
    d the turn by misalignment, L and w as in attitude_sensing.py                                 (2)
    q_BN(t) = q_m(t - latency), exposure_time = t - latency, from one measurement to the next     (3)
    a measurement is under way for m = latency / T samples, beside floor(m / n) later ones        (4)

Symbols: T sample_time, n samples_per_measurement. misalignment is the rotation vector, in B, from the star tracker as
it is believed to be mounted to the star tracker as it is. Frames: B body, N inertial; q_BN_true is the true attitude.
Source: textbook.
Invariants: |q_BN| = 1; (3) is exact, for any motion. The same seed gives the same noise.
Limits: latency is a whole number of samples; a fraction of the time between two measurements is had with
samples_per_measurement above 1. Until the first measurement arrives, q_BN is the attitude at the start and valid = 0.
What is measured while available = 0 arrives as valid = 0, and q_BN stays. No smear at high rates, no blinding by Sun,
Moon or Earth, no centroiding errors that repeat with the stars.
"""

from typing import Any

import casadi as ca

from .. import attitude_sensing
from ..framework import (
    Component,
    Condition,
    Input,
    Output,
    Parameter,
    State,
    flag_conditions,
    not_negative,
)
from ..framework.ports import NO_ROTATION
from ..mathematics import quaternion
from ..mathematics.noise import draws
from ..numbers import neutral
from ..vehicle import quaternion_condition


class StarTracker(Component):
    role = "sensor"
    ports = attitude_sensing.TrackerNoise
    sample_time = neutral.TRACKER_SAMPLE
    memory: int = 4  # structural: measurements that may be under way

    samples_per_measurement = Parameter(unit="1", start=1.0, doc="n, a measurement is made at every n-th sample")
    latency = Parameter(unit="s", doc="age of a measurement when it is shown, a whole number of samples")
    misalignment = Parameter(
        unit="rad", shape=(3,), display_unit="arcsec", doc="rotation vector from believed to true mounting, body axes"
    )
    available = Parameter(unit="1", start=1.0, tunable=True, doc="0: what is measured cannot be used, as when blinded")
    seed = Parameter(unit="1", start=41.0, doc="seed of the noise, a whole number")

    q_BN_true = Input(unit="1", shape=(4,), start=NO_ROTATION, doc="attitude of the body, scalar first")

    tick = State(unit="1", calculated=True, doc="number of the next sample")
    q_taken = State(unit="1", shape=(4, "memory"), calculated=True, doc="attitudes measured, the latest first")
    time_taken = State(unit="s", shape=("memory",), calculated=True, doc="when they were measured")
    usable_taken = State(unit="1", shape=("memory",), calculated=True, doc="whether they can be used")
    q_seen = State(unit="1", shape=(4,), start=NO_ROTATION, calculated=True, doc="attitude shown")
    time_seen = State(unit="s", calculated=True, doc="when it was measured")
    valid_seen = State(unit="1", calculated=True, doc="whether the last that arrived can be used")

    q_BN = Output(unit="1", shape=(4,), doc="measured attitude of the body, scalar first")
    exposure_time = Output(unit="s", doc="when that was the attitude")
    valid = Output(unit="1", doc="1: the last measurement that arrived can be used, else 0")

    def initial(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        q = self._mounted(u, p)
        return {
            "tick": 0,
            "q_taken": ca.repmat(q, 1, self.memory),
            "time_taken": ca.repmat(t, self.memory, 1),
            "usable_taken": ca.SX.zeros(self.memory),
            "q_seen": q,
            "time_seen": t,
            "valid_seen": 0,
        }

    def update(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        k, n, late = (ca.floor(v + 0.5) for v in (x.tick, p.samples_per_measurement, p.latency / p.sample_time))
        noise = attitude_sensing.deviation(p) @ draws(t, p.sample_time, p.seed, 3)  # (2)
        now = ca.vertcat(quaternion.turned(self._mounted(u, p), noise), t, p.available)  # (1)
        before = [ca.vertcat(x.q_taken[:, i], x.time_taken[i], x.usable_taken[i]) for i in range(self.memory)]
        measured = ca.fmod(k, n) == 0
        taken = [ca.if_else(measured, a, b) for a, b in zip([now, *before], before, strict=False)]
        due = (taken or [now])[0]
        for later, one in enumerate(taken):
            due = ca.if_else(ca.floor(late / n) == later, one, due)  # (4)
        arrived = ca.logic_and(k >= late, ca.fmod(k - late, n) == 0)
        seen = ca.if_else(ca.logic_and(arrived, due[5] > 0.5), due[:5], ca.vertcat(x.q_seen, x.time_seen))  # (3)
        rows = ca.horzcat(ca.SX(6, 0), *taken)
        return {
            "tick": k + 1,
            "q_taken": rows[:4, :],
            "time_taken": rows[4, :].T,
            "usable_taken": rows[5, :].T,
            "q_seen": seen[:4],
            "time_seen": seen[4],
            "valid_seen": ca.if_else(arrived, due[5], x.valid_seen),
        }

    def outputs(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"q_BN": x.q_seen, "exposure_time": x.time_seen, "valid": x.valid_seen}

    def check(self, t: Any, x: Any, u: Any, p: Any) -> list[Condition]:
        n, late = p.samples_per_measurement, p.latency / p.sample_time
        whole = ca.logic_and(n >= 1, n == ca.floor(n))
        fits = ca.fabs(late - ca.floor(late + 0.5)) < 1e-6
        longest = self.memory * n * p.sample_time
        return [
            *not_negative(self, p, "cross_noise", "roll_noise", "latency"),
            *flag_conditions(self, p, "available"),
            quaternion_condition("q_BN_true", u.q_BN_true),
            Condition(whole, "samples_per_measurement = {}: it must be a whole number, 1 or more.", (n,)),
            Condition(
                fits,
                "latency = {} s is no whole number of samples of {} s. Choose a sample_time that it is a multiple of, "
                "and samples_per_measurement.",
                (p.latency, p.sample_time),
            ),
            Condition(
                ca.logic_or(p.latency < longest * (1 - 1e-9), late < 0.5),
                f"latency = {{}} s, but memory = {self.memory} measurements last for less than {{}} s. Build it with a "
                "larger memory.",
                (p.latency, longest),
            ),
        ]

    def _mounted(self, u: Any, p: Any) -> Any:
        """Return the attitude as it is measured without noise."""
        return quaternion.product(u.q_BN_true, quaternion.from_rotation_vector(p.misalignment))  # (1)
