"""Electrostatic sensor of a test mass: its position and attitude in its cage, white noise, their filtered rates.

    r = r_true + n,  q_TS = q_true (x) [1; n/2] normalised                                        (1)
    v = c/T (r - y),  y <- y + c (r - y),  c = 1 - exp(-T/T_f): first-order velocity filter       (2)
    omega_TS_T likewise, from th = rotation vector of q_TS                                        (3)

Frames: S satellite and cage, T test mass. An output has the name of what it measures; the true ones end in _true.
Symbols: T sample_time, T_f filter_time, n white noise.
Source: made for J. Li, H. Fan, Design of adaptive neural network controllers for LEO drag-free satellite, Computing
Technology and Automation 33(2), 2014, whose law needs velocities that nothing measures.
Invariants: a constant velocity is estimated as it is, after some T_f; the filters start at rest.
Limits: (3) takes the rate of th as the body rate, right to second order in th. (2) lags by about T_f.
"""

from typing import Any

import casadi as ca

from ..framework import Component, Condition, Input, Output, Parameter, State, not_negative, positive
from ..framework.ports import NO_ROTATION
from ..mathematics import quaternion
from ..mathematics.noise import white
from ..numbers import neutral
from ..vehicle import quaternion_condition


class ElectrostaticSensor(Component):
    role = "sensor"
    sample_time = neutral.SAMPLE

    position_noise = Parameter(unit="m/Hz^(1/2)", shape=(3,), doc="density of the noise of the position")
    attitude_noise = Parameter(unit="rad/Hz^(1/2)", shape=(3,), doc="density of the noise of the attitude")
    filter_time = Parameter(unit="s", start=neutral.SAMPLE, doc="T_f, time constant of the velocity filter")
    seed = Parameter(unit="1", start=22.0, doc="seed of the noise, a whole number")

    r_rel_true = Input(unit="m", shape=(3,), nominal=1e-3, doc="test mass in its cage, S")
    q_TS_true = Input(unit="1", shape=(4,), start=NO_ROTATION, doc="attitude of the test mass to the satellite")
    r_seen = State(unit="m", shape=(3,), nominal=1e-3, doc="position measured last")
    q_seen = State(unit="1", shape=(4,), start=NO_ROTATION, unit_length=True, doc="attitude measured last")
    r_slow = State(unit="m", shape=(3,), calculated=True, nominal=1e-3, doc="y, filtered position")
    th_slow = State(unit="rad", shape=(3,), calculated=True, nominal=1e-2, doc="filtered rotation vector")
    v_seen = State(unit="m/s", shape=(3,), nominal=1e-4, doc="velocity estimated last")
    omega_seen = State(unit="rad/s", shape=(3,), nominal=1e-3, doc="rate estimated last")
    r_rel = Output(unit="m", shape=(3,), nominal=1e-3, doc="measured position of the test mass, S axes")
    v_rel = Output(unit="m/s", shape=(3,), nominal=1e-4, doc="estimated velocity of the test mass, S axes")
    q_TS = Output(unit="1", shape=(4,), doc="measured attitude of the test mass to the satellite, scalar first")
    omega_TS_T = Output(unit="rad/s", shape=(3,), nominal=1e-3, doc="estimated rate of the test mass to the satellite")
    valid = Output(unit="1", doc="1: the measurement can be used")

    def initial(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"r_slow": u.r_rel_true, "th_slow": quaternion.rotation_vector(quaternion.short(u.q_TS_true))}

    def update(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        r = u.r_rel_true + white(t, p.sample_time, p.seed, p.position_noise)  # (1)
        n = white(t, p.sample_time, p.seed, p.attitude_noise, 3)
        q = quaternion.turned(u.q_TS_true, n)  # (1)
        th, part = quaternion.rotation_vector(quaternion.short(q)), 1 - ca.exp(-p.sample_time / p.filter_time)
        return {
            "r_seen": r,
            "q_seen": q,
            "r_slow": x.r_slow + part * (r - x.r_slow),  # (2)
            "th_slow": x.th_slow + part * (th - x.th_slow),  # (3)
            "v_seen": part / p.sample_time * (r - x.r_slow),  # (2)
            "omega_seen": part / p.sample_time * (th - x.th_slow),  # (3)
        }

    def outputs(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"r_rel": x.r_seen, "v_rel": x.v_seen, "q_TS": x.q_seen, "omega_TS_T": x.omega_seen, "valid": 1}

    def check(self, t: Any, x: Any, u: Any, p: Any) -> list[Condition]:
        return [
            *positive(self, p, "filter_time"),
            *not_negative(self, p, "position_noise", "attitude_noise"),
            quaternion_condition("q_TS_true", u.q_TS_true),
        ]
