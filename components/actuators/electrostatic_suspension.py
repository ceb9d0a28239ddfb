"""Electrostatic suspension: the torque on the test mass, limited, slewed, quantised, noisy, sampled.

    y = the command within +-torque_limit, moved by at most rate T a sample                       (1)
    tau = y rounded to quanta within its limits + noise, white, held between samples              (2)

Frames: T test mass. Symbols: T in (1) sample_time.
Source: made for J. Li, H. Fan, Design of adaptive neural network controllers for LEO drag-free satellite, Computing
Technology and Automation 33(2), 2014.
Invariants: without noise the limits hold at every sample.
Limits: no force on the test mass, no stiffness of its own: that is the plant's K_r.
"""

from typing import Any

import casadi as ca

from ..framework import Component, Condition, Input, Output, Parameter, State, not_negative
from ..mathematics.noise import white
from ..mathematics.slewing import quantised, slewed, start_conditions
from ..numbers import neutral


class ElectrostaticSuspension(Component):
    role = "actuators"
    sample_time = neutral.SAMPLE

    torque_limit = Parameter(unit="N.m", shape=(3,), start=neutral.NO_LIMIT, doc="largest torque, each axis; 1e9: none")
    torque_rate = Parameter(unit="N.m/s", shape=(3,), doc="fastest change of the torque; 0: no limit")
    torque_quantum = Parameter(unit="N.m", shape=(3,), doc="step of the torque; 0: none")
    torque_noise = Parameter(unit="N.m/Hz^(1/2)", shape=(3,), doc="spectral density of the torque noise")
    seed = Parameter(unit="1", start=12.0, doc="seed of the noise, a whole number")

    tau_command_T = Input(unit="N.m", shape=(3,), nominal=1e-8, doc="torque wanted on the test mass")
    tau_last = State(unit="N.m", shape=(3,), nominal=1e-8, doc="torque without quantisation and noise")
    tau_now = State(unit="N.m", shape=(3,), nominal=1e-8, doc="torque since the last sample")
    tau_T = Output(unit="N.m", shape=(3,), nominal=1e-8, doc="torque on the test mass")
    saturated = Output(unit="1", doc="how many axes are at their limit")

    def update(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        limit = p.torque_limit
        tau = slewed(u.tau_command_T, x.tau_last, -limit, limit, p.torque_rate, p.sample_time)  # (1)
        noise = white(t, p.sample_time, p.seed, p.torque_noise)
        return {"tau_last": tau, "tau_now": quantised(tau, p.torque_quantum, -limit, limit) + noise}  # (2)

    def outputs(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"tau_T": x.tau_now, "saturated": ca.sum1(ca.fabs(x.tau_last) >= p.torque_limit)}

    def check(self, t: Any, x: Any, u: Any, p: Any) -> list[Condition]:
        return [
            *not_negative(self, p, "torque_limit", "torque_rate", "torque_quantum", "torque_noise"),
            *start_conditions(self, "tau_last", x.tau_last, -p.torque_limit, p.torque_limit),
        ]
