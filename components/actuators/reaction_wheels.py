"""A cluster of reaction wheels with fixed axes: limits, motor lag, friction with stiction, failures.

    m_c = sat(-A^+ tau_command),  |m_ci| <= torque_limit_i                                        (1)
    m_w = health y;  motor_lag y' = m_c - y, or y = m_c where motor_lag = 0                       (2)
    h_w' = m_w - f(Omega_w), where |h_wi| is at momentum_limit_i only inwards                     (3)
    h_w = J_s Omega_w                                                                             (4)
    h_B = A h_w                                                                                   (5)
    tau_B = -(h_B(t) - h_B(t - H)) / H over the last communication step H                         (6)
    A^+ = W A^T (A W A^T)^-1; with 1e-6 I in the bracket where the wheels that W leaves do not span    (7)

Symbols: A spin_axes_B, one column a wheel; m_w motor_torque, y lagged_torque, h_w wheel_momentum, Omega_w wheel_speed,
J_s rotor_inertia; f as in mathematics/bearing.py, with friction (viscous), coulomb_friction, static_friction,
stribeck_speed; all along the spin axes and relative to the body. W the diagonal of allocation_weight; tau_command the
torque wanted on the hub. Frames: B body axes.
Source: B. Xiao, Q. Hu, G. Ma, Adaptive L2-gain controller for flexible spacecraft attitude tracking, Control Theory &
Applications 28(1), 2011, equation (1): h = J_s Omega_s, u = -h', and its limit (36). The others are numbers of this
file.
Invariants: with the hub's own momentum the total inertial momentum is kept, whatever saturates, rubs or fails: (6) is
minus the mean of h_B'. No torque about axes that do not exist.
Limits: no imbalance; h_w leaves out J_s times the body rate, which is in the vehicle's J, and m_w what it takes to turn
the rotor with the body. A saturated wheel is not helped by the others. (7) does not know of health: a wheel that fails
is missed until its allocation_weight is set to 0, as by what detects the failure. A wheel that has failed still rubs.
"""

from typing import Any

import casadi as ca

from ..framework import (
    ActuatorCluster,
    CalculatedParameter,
    Component,
    Condition,
    Output,
    Parameter,
    State,
    lag_condition,
    not_negative,
    positive,
)
from ..mathematics import bearing
from ..mathematics.allocation import robust_inverse, weighted_inverse
from ..mathematics.axes import SPANNING, spanning_condition
from ..mathematics.limits import saturated, stopped
from ..mathematics.vectors import smallest_eigenvalue
from ..numbers import neutral
from ..vehicle import MomentumStorage

STABLE = 2.78  # largest step of the internal integrator times a decay rate


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
    coulomb_friction = Parameter(unit="N.m", shape=("wheels",), doc="friction torque at any speed")
    static_friction = Parameter(unit="N.m", shape=("wheels",), doc="torque to break away; below Coulomb's: as that")
    stribeck_speed = Parameter(
        unit="rad/s", shape=("wheels",), start=1.0, doc="speed at which static friction is largest; ten times Coulomb's"
    )
    motor_lag = Parameter(unit="s", doc="time constant of the motors, 0: none")
    health = Parameter(
        unit="1", shape=("wheels",), start=1.0, tunable=True, doc="part of its torque that a motor gives, 0: failed"
    )
    allocation_weight = Parameter(
        unit="1", shape=("wheels",), start=1.0, tunable=True, doc="share of a wheel in the torque wanted, 0: not used"
    )
    allocation = CalculatedParameter(unit="1", shape=("wheels", 3), doc="weighted pseudo-inverse of the spin axes")

    wheel_momentum = State(unit="N.m.s", shape=("wheels",), output=True, doc="momentum of a wheel relative to the body")
    lagged_torque = State(unit="N.m", shape=("wheels",), doc="torque of the motors, if they lag")
    wheel_speed = Output(unit="rad/s", shape=("wheels",), doc="speed of a wheel relative to the body")
    motor_torque = Output(unit="N.m", shape=("wheels",), doc="torque of a motor on its wheel")
    saturated = Output(unit="1", doc="number of wheels whose torque or momentum is at its limit")

    def calculate(self, p: Any) -> dict[str, Any]:
        A, W = p.spin_axes_B, p.allocation_weight
        spans = smallest_eigenvalue(A @ ca.diag(W) @ A.T) > SPANNING
        robust = robust_inverse(A, W, SPANNING * ca.DM.eye(3))
        return {"allocation": ca.if_else(spans, weighted_inverse(A, W), robust)}  # (7)

    def derivatives(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        lagging, commanded = p.motor_lag > 0, self._commanded(u, p)
        rubbing = bearing.friction(
            self._speed(x, p), p.coulomb_friction, p.static_friction, p.stribeck_speed, p.friction
        )
        return {
            "wheel_momentum": stopped(x.wheel_momentum, self._motor(x, u, p) - rubbing, p.momentum_limit),  # (3)
            "lagged_torque": ca.if_else(lagging, commanded - x.lagged_torque, 0) / ca.if_else(lagging, p.motor_lag, 1),
        }

    def project(self, x: Any, p: Any) -> dict[str, Any]:
        return {"wheel_momentum": saturated(x.wheel_momentum, p.momentum_limit)}  # (3)

    def step_means(self, t: Any, x: Any, p: Any) -> dict[str, Any]:
        return {"tau_B": -p.spin_axes_B @ x.wheel_momentum}  # (6)

    def outputs(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        wanted = -p.allocation @ u.tau_command_B
        torque, momentum = abs(wanted) >= p.torque_limit, abs(x.wheel_momentum) >= p.momentum_limit
        limited = [(torque[i] + momentum[i]) > 0 for i in range(self.wheels)]
        return {
            "h_B": p.spin_axes_B @ x.wheel_momentum,  # (5)
            "wheel_speed": self._speed(x, p),
            "motor_torque": self._motor(x, u, p),
            "saturated": sum(limited),
        }

    def check(self, t: Any, x: Any, u: Any, p: Any) -> list[Condition]:
        conditions = [
            spanning_condition("axes spin_axes_B", p.spin_axes_B),
            *positive(self, p, "torque_limit", "momentum_limit", "rotor_inertia", "stribeck_speed"),
            *not_negative(self, p, "friction", "coulomb_friction", "static_friction", "health", "allocation_weight"),
            lag_condition(p, "motor_lag"),
        ]
        step = vars(p)["solver.step"]
        slope = bearing.steepest(p.coulomb_friction, p.static_friction, p.stribeck_speed)
        for i in range(self.wheels):
            value, limit = x.wheel_momentum[i], p.momentum_limit[i]
            text = f"wheel_momentum[{i + 1}] = {{}} N.m.s at the start is beyond momentum_limit[{i + 1}] = {{}} N.m.s."
            conditions.append(Condition(limit - abs(value) >= 0, text, (value, limit)))
            text = f"health[{i + 1}] = {{}}: it must not be above 1, the whole torque."
            conditions.append(Condition(p.health[i] <= 1, text, (p.health[i],)))
            text = (
                f"friction of wheel {i + 1} is too steep at rest for solver.step = {{}} s: it needs {{}} s or less, or "
                f"a stribeck_speed[{i + 1}] above {{}} rad/s."
            )
            largest = STABLE * p.rotor_inertia[i] / ca.fmax(slope[i], 1e-300)
            conditions.append(Condition(largest >= step, text, (step, largest, p.stribeck_speed[i])))
        return conditions

    def _commanded(self, u: Any, p: Any) -> Any:
        return saturated(-p.allocation @ u.tau_command_B, p.torque_limit)  # (1)

    def _motor(self, x: Any, u: Any, p: Any) -> Any:
        return p.health * ca.if_else(p.motor_lag > 0, x.lagged_torque, self._commanded(u, p))  # (2)

    def _speed(self, x: Any, p: Any) -> Any:
        return x.wheel_momentum / p.rotor_inertia  # (4)
