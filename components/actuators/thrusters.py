"""Thrusters of a drag-free satellite: force and torque per axis, limited, slewed, quantised, noisy, sampled.

    y = the command within its limits, moved by at most rate T a sample                           (1)
    f = quantised y + noise, tau likewise; white noise held between samples                       (2)

Frames: S satellite body. Symbols: T sample_time; each axis has its own limits, so that a pair that only pushes one way
(an ion thruster against the drag) has a lower limit above zero.
Source: ranges chosen for H. Li, L. Fan, Design of adaptive neural network controllers for LEO drag-free satellite,
Computing Technology and Automation 33(2), 2014, which names its thrusters only: x an ion thruster of 1 to 20 mN,
2.5 mN/s, 12 uN, 12 uN/sqrt(Hz) as the GOCE one; y, z micro-thrusters of +-0.65 mN; torques of +-1 mN m.
Invariants: without noise the limits hold at every sample.
Limits: no geometry of nozzles, no coupling of the axes, no mass flow. The noise is added after the limits.
"""

from typing import Any

import casadi as ca

from ..attitude.noise import white
from ..attitude.slewing import quantised, slewed
from ..framework import Component, Condition, Input, Output, Parameter, State

MICRO = 0.65e-3  # N


class Thrusters(Component):
    sample_time = 0.1

    force_lower = Parameter(unit="N", shape=(3,), start=(1e-3, -MICRO, -MICRO), doc="least force, each axis")
    force_upper = Parameter(unit="N", shape=(3,), start=(20e-3, MICRO, MICRO), doc="largest force, each axis")
    force_rate = Parameter(unit="N/s", shape=(3,), start=(2.5e-3, 0, 0), doc="fastest change of the force; 0: no limit")
    force_quantum = Parameter(unit="N", shape=(3,), start=(12e-6, 0, 0), doc="step of the force; 0: none")
    force_noise = Parameter(unit="N/Hz(1/2)", shape=(3,), start=(12e-6, 0, 0), doc="density of the force noise")
    torque_limit = Parameter(unit="N.m", shape=(3,), start=1e-3, doc="largest torque, each axis")
    torque_noise = Parameter(unit="N.m/Hz(1/2)", shape=(3,), doc="density of the torque noise")
    seed = Parameter(unit="1", start=11.0, doc="seed of the noise, a whole number")

    f_command_S = Input(unit="N", shape=(3,), nominal=1e-2, doc="force wanted on the satellite")
    tau_command_S = Input(unit="N.m", shape=(3,), nominal=1e-3, doc="torque wanted on the satellite")
    f_last = State(unit="N", shape=(3,), nominal=1e-2, doc="force without quantisation and noise")
    f_now = State(unit="N", shape=(3,), nominal=1e-2, doc="force since the last sample")
    tau_now = State(unit="N.m", shape=(3,), nominal=1e-3, doc="torque since the last sample")
    f_S = Output(unit="N", shape=(3,), nominal=1e-2, doc="force on the satellite")
    tau_S = Output(unit="N.m", shape=(3,), nominal=1e-3, doc="torque on the satellite")
    saturated = Output(unit="1", doc="how many axes of force are at a limit")

    def update(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        f = slewed(u.f_command_S, x.f_last, p.force_lower, p.force_upper, p.force_rate, p.sample_time)  # (1)
        noise = white(t, p.sample_time, p.seed, p.force_noise)
        tau = ca.fmax(-p.torque_limit, ca.fmin(p.torque_limit, u.tau_command_S))  # (1)
        return {
            "f_last": f,
            "f_now": quantised(f, p.force_quantum) + noise,  # (2)
            "tau_now": tau + white(t, p.sample_time, p.seed, p.torque_noise, 3),  # (2)
        }

    def outputs(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        at_limit = ca.logic_or(x.f_last >= p.force_upper, x.f_last <= p.force_lower)
        return {"f_S": x.f_now, "tau_S": x.tau_now, "saturated": ca.sum1(at_limit)}

    def check(self, t: Any, x: Any, u: Any, p: Any) -> list[Condition]:
        gap, least = ca.mmin(p.force_upper - p.force_lower), ca.mmin(p.torque_limit)
        text = "force_upper is below force_lower on an axis (difference {} N). Exchange them."
        return [
            Condition(gap >= 0, text, (gap,)),
            Condition(least >= 0, "torque_limit has an element {} N.m: it must not be negative.", (least,)),
        ]
