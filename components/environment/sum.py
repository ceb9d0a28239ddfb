"""Several disturbance torques into one, since an input takes one connection.

    d = tau_1 + tau_2 + ... + tau_n                                                               (1)

Frames: all in body axes B.
Source: none needed.
Limits: not for the step-mean torques of actuators: their sum does not carry the mark, so that a master may ramp it.
To a plant that takes their momentum they do not go at all.
"""

from typing import Any

import casadi as ca

from ..framework import Component, Environment, Input, Variable


class Sum(Component):
    role = "sum"
    ports = Environment
    n: int = 2  # structural: how many torques

    def declare(self) -> dict[str, Variable]:
        return {f"tau_{i + 1}": Input(unit="N.m", shape=(3,), doc=f"torque {i + 1}") for i in range(self.n)}

    def outputs(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"tau_dist_B": sum((vars(u)[f"tau_{i + 1}"] for i in range(self.n)), ca.SX.zeros(3))}  # (1)
