"""A cluster of reaction wheels with fixed axes: torque and momentum limits, viscous friction.

    m_w = sat(-A^+ tau_command),  |m_wi| <= torque_limit_i                                        (1)
    h_w' = m_w - c Omega_w, where |h_wi| is at momentum_limit_i only inwards                      (2)
    h_w = J_s Omega_w                                                                             (3)
    h_B = A h_w                                                                                   (4)
    tau_B = -(h_B(t) - h_B(t - H)) / H over the last communication step H                         (5)

Symbols: A spin_axes_B, one column a wheel; m_w motor torque, h_w wheel_momentum, Omega_w wheel_speed, J_s
rotor_inertia, c friction; all along the spin axes and relative to the body. tau_command the torque wanted on the hub.
Frames: B body axes.
Source: B. Xiao, Q. Hu, G. Ma, Adaptive L2-gain controller for flexible spacecraft attitude tracking, Control Theory &
Applications 28(1), 2011, equation (1): h = J_s Omega_s, u = -h', and its limit (36). (2), (4), (5) for any number of
wheels are numbers of this file.
Invariants: with the hub's own momentum the total inertial momentum is kept, whatever saturates: (5) is minus the mean
of h_B'. No torque about axes that do not exist.
Limits: no motor lag, no imbalance, no Coulomb friction; h_w leaves out J_s times the body rate, which is in the
vehicle's J, and m_w what it takes to turn the rotor with the body. A saturated wheel is not helped by the others.
"""

from typing import Any

from ..framework import (
    ActuatorCluster,
    CalculatedParameter,
    Component,
    Condition,
    Output,
    Parameter,
    State,
    not_negative,
    positive,
)
from ..mathematics.axes import axis_conditions, pseudo_inverse
from ..mathematics.limits import saturated, stopped
from ..numbers import neutral
from ..vehicle import MomentumStorage


class ReactionWheels(Component):
    ports = ActuatorCluster
    wheels: int = 3  # structural: number of wheels

    spin_axes_B = MomentumStorage.spin_axes_B
    torque_limit = Parameter(
        unit="N.m",
        shape=("wheels",),
        start=neutral.NO_LIMIT,
        shared=True,
        doc="largest motor torque of a wheel; 1e9: none",
    )
    momentum_limit = Parameter(
        unit="N.m.s", shape=("wheels",), start=neutral.NO_LIMIT, doc="largest momentum of a wheel; 1e9: none"
    )
    rotor_inertia = Parameter(
        unit="kg.m2", shape=("wheels",), start=neutral.WHEEL_INERTIA, doc="inertia of a rotor about its axis"
    )
    friction = Parameter(unit="N.m.s/rad", shape=("wheels",), doc="viscous friction torque per wheel speed")
    allocation = CalculatedParameter(unit="1", shape=("wheels", 3), doc="pseudo-inverse of the spin axes")

    wheel_momentum = State(unit="N.m.s", shape=("wheels",), output=True, doc="momentum of a wheel relative to the body")
    wheel_speed = Output(unit="rad/s", shape=("wheels",), doc="speed of a wheel relative to the body")
    saturated = Output(unit="1", doc="number of wheels whose torque or momentum is at its limit")

    def calculate(self, p: Any) -> dict[str, Any]:
        return {"allocation": pseudo_inverse(p.spin_axes_B)}

    def derivatives(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        motor = saturated(-p.allocation @ u.tau_command_B, p.torque_limit)  # (1)
        rate = motor - p.friction * self._speed(x, p)
        return {"wheel_momentum": stopped(x.wheel_momentum, rate, p.momentum_limit)}  # (2)

    def project(self, x: Any, p: Any) -> dict[str, Any]:
        return {"wheel_momentum": saturated(x.wheel_momentum, p.momentum_limit)}  # (2)

    def step_means(self, t: Any, x: Any, p: Any) -> dict[str, Any]:
        return {"tau_B": -p.spin_axes_B @ x.wheel_momentum}  # (5)

    def outputs(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        wanted = -p.allocation @ u.tau_command_B
        torque, momentum = abs(wanted) >= p.torque_limit, abs(x.wheel_momentum) >= p.momentum_limit
        limited = [(torque[i] + momentum[i]) > 0 for i in range(self.wheels)]
        return {
            "h_B": p.spin_axes_B @ x.wheel_momentum,  # (4)
            "wheel_speed": self._speed(x, p),
            "saturated": sum(limited),
        }

    def check(self, t: Any, x: Any, u: Any, p: Any) -> list[Condition]:
        conditions = [
            *axis_conditions("spin_axes_B", p.spin_axes_B),
            *positive(self, p, "torque_limit", "momentum_limit", "rotor_inertia"),
            *not_negative(self, p, "friction"),
        ]
        for i in range(self.wheels):
            value, limit = x.wheel_momentum[i], p.momentum_limit[i]
            text = f"wheel_momentum[{i + 1}] = {{}} N.m.s at the start is beyond momentum_limit[{i + 1}] = {{}} N.m.s."
            conditions.append(Condition(limit - abs(value) >= 0, text, (value, limit)))
        return conditions

    def _speed(self, x: Any, p: Any) -> Any:
        return x.wheel_momentum / p.rotor_inertia  # (3)
