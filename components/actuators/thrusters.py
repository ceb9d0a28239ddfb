"""Thrusters of a drag-free satellite: force and torque per axis, limited, slewed, quantised, noisy, sampled.

    y = the command within its limits, moved by at most rate T a sample                           (1)
    f = y rounded to quanta within its limits + noise, tau likewise; white, held between samples  (2)

Frames: S satellite body. Symbols: T sample_time; each axis has its own limits, so that a pair that only pushes one way
(an ion thruster against the drag) has a lower limit above zero.
Source: made for J. Li, H. Fan, Design of adaptive neural network controllers for LEO drag-free satellite, Computing
Technology and Automation 33(2), 2014, which names its thrusters only.
Invariants: without noise the limits hold at every sample.
Limits: no geometry of nozzles, no coupling of the axes, no mass flow. The noise is added after the limits. An axis with
both limits on one side of zero cannot be switched off, at the start neither.
"""

from typing import Any

import casadi as ca

from ..framework import Component, Condition, Input, Output, Parameter, State, not_negative
from ..mathematics.noise import white
from ..mathematics.slewing import quantised, slewed, start_conditions
from ..numbers import neutral


class Thrusters(Component):
    role = "actuators"
    sample_time = neutral.SAMPLE

    force_lower = Parameter(unit="N", shape=(3,), start=-neutral.NO_LIMIT, doc="least force, each axis; -1e9: none")
    force_upper = Parameter(unit="N", shape=(3,), start=neutral.NO_LIMIT, doc="largest force, each axis; 1e9: none")
    force_rate = Parameter(unit="N/s", shape=(3,), doc="fastest change of the force; 0: no limit")
    force_quantum = Parameter(unit="N", shape=(3,), doc="step of the force; 0: none")
    force_noise = Parameter(unit="N/Hz^(1/2)", shape=(3,), doc="density of the force noise")
    torque_limit = Parameter(unit="N.m", shape=(3,), start=neutral.NO_LIMIT, doc="largest torque, each axis; 1e9: none")
    torque_rate = Parameter(unit="N.m/s", shape=(3,), doc="fastest change of the torque; 0: no limit")
    torque_quantum = Parameter(unit="N.m", shape=(3,), doc="step of the torque; 0: none")
    torque_noise = Parameter(unit="N.m/Hz^(1/2)", shape=(3,), doc="density of the torque noise")
    seed = Parameter(unit="1", start=11.0, doc="seed of the noise, a whole number")

    f_command_S = Input(unit="N", shape=(3,), nominal=1e-2, doc="force wanted on the satellite")
    tau_command_S = Input(unit="N.m", shape=(3,), nominal=1e-3, doc="torque wanted on the satellite")
    f_last = State(unit="N", shape=(3,), nominal=1e-2, doc="force without quantisation and noise")
    f_now = State(unit="N", shape=(3,), nominal=1e-2, doc="force since the last sample")
    tau_last = State(unit="N.m", shape=(3,), nominal=1e-3, doc="torque without quantisation and noise")
    tau_now = State(unit="N.m", shape=(3,), nominal=1e-3, doc="torque since the last sample")
    f_S = Output(unit="N", shape=(3,), nominal=1e-2, doc="force on the satellite")
    tau_S = Output(unit="N.m", shape=(3,), nominal=1e-3, doc="torque on the satellite")
    saturated = Output(unit="1", doc="how many axes of force are at a limit")

    def update(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        lower, upper, limit = p.force_lower, p.force_upper, p.torque_limit
        f = slewed(u.f_command_S, x.f_last, lower, upper, p.force_rate, p.sample_time)  # (1)
        tau = slewed(u.tau_command_S, x.tau_last, -limit, limit, p.torque_rate, p.sample_time)  # (1)
        f_noise = white(t, p.sample_time, p.seed, p.force_noise)
        tau_noise = white(t, p.sample_time, p.seed, p.torque_noise, 3)
        return {
            "f_last": f,
            "f_now": quantised(f, p.force_quantum, lower, upper) + f_noise,  # (2)
            "tau_last": tau,
            "tau_now": quantised(tau, p.torque_quantum, -limit, limit) + tau_noise,  # (2)
        }

    def outputs(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        at_limit = ca.logic_or(x.f_last >= p.force_upper, x.f_last <= p.force_lower)
        return {"f_S": x.f_now, "tau_S": x.tau_now, "saturated": ca.sum1(at_limit)}

    def check(self, t: Any, x: Any, u: Any, p: Any) -> list[Condition]:
        gap = ca.mmin(p.force_upper - p.force_lower)
        text = "force_upper is below force_lower on an axis (difference {} N). Exchange them."
        return [
            Condition(gap >= 0, text, (gap,)),
            *not_negative(self, p, "torque_limit", "force_rate", "torque_rate", "force_quantum", "torque_quantum"),
            *not_negative(self, p, "force_noise", "torque_noise"),
            *start_conditions(self, "f_last", x.f_last, p.force_lower, p.force_upper),
            *start_conditions(self, "tau_last", x.tau_last, -p.torque_limit, p.torque_limit),
        ]
