"""The vehicle: parameters that plants and controllers share, one name, unit and text each, and where it starts.

    J - delta^T delta positive definite: the modes hold less inertia than J                       (1)
    no principal moment of J above the sum of the others, as no body has one: 2 J_max <= tr J     (2)

Each mode has a column of couplings in its paper, F = delta^T; here a row of delta is a mode. The start values are the
flexible spacecraft of the source: four modes of panel 1, then the same of panel 2 with opposite couplings. With fewer
modes the first ones are taken; further ones repeat the frequencies with zero coupling.

Frames: B body axes at the mass centre, N inertial, R reference.
Source: C. Zhang, Y. Sun, G. Ma, C. Li, Prescribed performance adaptive attitude tracking control for flexible
spacecraft, J. Harbin Inst. Tech. 50(4), 2018, Table 1; its initial attitude rates are
read as rates of the Euler angles 1-2-3. AGILE: Y. Geng, W. Wu, G. Ma, Neural network compensation of flexible satellite
rapid maneuver, J. Harbin Inst. Tech. 44(5), 2012, section 4.
"""

from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np

from .framework import Component, Condition, Parameter, not_negative, positive
from .mathematics import cmg, euler
from .mathematics.axes import axis_conditions, spanning_condition
from .mathematics.vectors import asymmetry, smallest_eigenvalue
from .numbers import geng2012, ye2016, zhang2018

DEGREE = np.pi / 180


def _coupling(component: Any) -> np.ndarray:
    rows = np.zeros((component.modes, 3))
    panels = np.vstack([zhang2018.F_1.T, -zhang2018.F_1.T])[: component.modes]
    rows[: len(panels)] = panels
    return rows


def _frequency(component: Any) -> np.ndarray:
    return np.resize(zhang2018.OMEGA, component.modes)


J = Parameter(
    unit="kg.m2", shape=(3, 3), start=np.array(zhang2018.J), doc="inertia of the undeformed spacecraft, rotors locked"
)
delta = Parameter(unit="kg(1/2).m", shape=("modes", 3), start=_coupling, doc="coupling of rotation and modes")
Omega = Parameter(unit="rad/s", shape=("modes",), start=_frequency, doc="modal frequency, hub clamped")
zeta = Parameter(unit="1", shape=("modes",), start=zhang2018.ZETA, doc="modal damping ratio")


def starting_at(inertia: Any, coupling: Any, frequency: Any, damping: Any) -> tuple[Parameter, ...]:
    """Return J, delta, Omega, zeta with the numbers of another vehicle; coupling as F, a column a mode.

    With fewer modes the first ones are taken; further ones repeat frequency and damping with zero coupling.
    """
    F = np.asarray(coupling)

    def rows(component: Any) -> np.ndarray:
        return np.pad(F.T, ((0, max(component.modes - F.shape[1], 0)), (0, 0)))[: component.modes]

    def repeated(values: Any) -> Any:
        return lambda component: np.resize(values, component.modes)

    return (
        replace(J, start=np.asarray(inertia)),
        replace(delta, start=rows),
        replace(Omega, start=repeated(frequency)),
        replace(zeta, start=repeated(damping)),
    )


AGILE = starting_at(geng2012.J, geng2012.F, geng2012.OMEGA, geng2012.ZETA)


class MomentumStorage:
    """Gyros and wheels, nominal, as a cluster and the controllers that need it know them.

    The start values are a pyramid of gyros as D. Ye, Z. Sun, Y. Liu, An adaptive control algorithm for hybrid actuator
    with installation deviation, J. Harbin Inst. Tech. 48(11), 2016 has it, wheels on the body axes; chosen numbers.
    """

    gimbal_axes_B = Parameter(
        unit="1", shape=(3, "gimbals"), start=lambda c: ye2016.pyramid(c.gimbals)[0], doc="gimbal axes, a column a gyro"
    )
    rotor_axes_B = Parameter(
        unit="1", shape=(3, "gimbals"), start=lambda c: ye2016.pyramid(c.gimbals)[1], doc="rotor axes at gimbal angle 0"
    )
    rotor_momentum = Parameter(
        unit="N.m.s", shape=("gimbals",), start=ye2016.ROTOR_MOMENTUM, doc="angular momentum of each gyro's rotor"
    )
    spin_axes_B = Parameter(
        unit="1",
        shape=(3, "wheels"),
        start=lambda c: np.eye(3)[:, np.arange(c.wheels) % 3],
        doc="spin axes, a column a wheel",
    )
    wheel_inertia = Parameter(
        unit="kg.m2", shape=("wheels",), start=ye2016.WHEEL_INERTIA, doc="inertia of a wheel about its spin axis"
    )


class StorageLimits:
    """What gyros and wheels can do, as a cluster and its steering know it; the start values are no limit."""

    gimbal_rate_limit = Parameter(
        unit="rad/s", shape=("gimbals",), start=1e9, display_unit="deg/s", doc="largest gimbal rate, 1e9: none"
    )
    gimbal_dead_zone = Parameter(unit="rad/s", display_unit="deg/s", doc="gimbal rates below this are not carried out")
    wheel_torque_limit = Parameter(
        unit="N.m", shape=("wheels",), start=1e9, doc="largest motor torque of a wheel, 1e9: none"
    )


_ANGLES = DEGREE * ca.DM(zhang2018.THETA_0)
_ANGLE_RATES = DEGREE * ca.DM(zhang2018.THETA_DOT_0)
START_Q_BN = euler.quaternion_from_123(_ANGLES).full().ravel()
START_OMEGA_BN_B = (euler.G_123(_ANGLES) @ _ANGLE_RATES).full().ravel()


def inertia_conditions(J: Any) -> list[Condition]:
    """Return the conditions on an inertia matrix, whatever the axes that it is given in."""
    largest = -smallest_eigenvalue(-J)
    others = ca.trace(J) - largest
    return [
        Condition(
            asymmetry(J) <= 1e-9 * ca.mmax(ca.fabs(J)),
            "J is not symmetric: elements that mirror each other differ by {} kg.m2. Give both the same value.",
            (asymmetry(J),),
        ),
        Condition(
            smallest_eigenvalue(J),
            "J is not positive definite (smallest eigenvalue {} kg.m2). Check its diagonal.",
            (smallest_eigenvalue(J),),
        ),
        Condition(
            largest <= others + 1e-6 * ca.fabs(largest),  # (2)
            "J breaks the triangle inequality: its largest principal moment {} kg.m2 is more than the sum {} kg.m2 of "
            "the others. Check its diagonal.",
            (largest, others),
        ),
    ]


def flexible_conditions(component: Component, p: Any) -> list[Condition]:
    """Return the conditions on the parameters of a flexible vehicle."""
    conditions = inertia_conditions(p.J)
    if component.structure["modes"]:
        least = smallest_eigenvalue(p.J - p.delta.T @ p.delta)  # (1)
        text = (
            "J - delta^T delta is not positive definite (smallest eigenvalue {} kg.m2). The modes hold more inertia "
            "than J."
        )
        conditions.append(Condition(least, text, (least,)))
    return [*conditions, *not_negative(component, p, "Omega", "zeta")]


def quaternion_condition(name: str, q: Any) -> Condition:
    """Return the condition that a quaternion given at the start is one of a rotation."""
    norm = ca.norm_2(q)
    text = f"{name} has norm {{}} at the start, a unit quaternion (within 1e-6) is needed. Divide it by its norm."
    return Condition(1e-6 - ca.fabs(norm - 1), text, (norm,))


def attitude_conditions(u: Any) -> list[Condition]:
    """Return the conditions on the attitudes that a controller is given at the start."""
    return [quaternion_condition(name, vars(u)[name]) for name in ("q_BN", "q_RN")]


def storage_conditions(component: Component, p: Any) -> list[Condition]:
    """Return the conditions on the parameters of `MomentumStorage`."""
    conditions = cmg.geometry_conditions(p.gimbal_axes_B, p.rotor_axes_B)
    for name in ("gimbal_axes_B", "rotor_axes_B", "spin_axes_B"):
        conditions += axis_conditions(name, vars(p)[name], spanning=False)
    every = ca.horzcat(p.rotor_axes_B, cmg.transverse(p.gimbal_axes_B, p.rotor_axes_B), p.spin_axes_B)
    conditions.append(spanning_condition("rotor, transverse and spin axes together", every))
    return [*conditions, *positive(component, p, "rotor_momentum", "wheel_inertia")]


def limit_conditions(component: Component, p: Any) -> list[Condition]:
    """Return the conditions on the parameters of `StorageLimits`."""
    limits = positive(component, p, "gimbal_rate_limit", "wheel_torque_limit")
    return [*limits, *not_negative(component, p, "gimbal_dead_zone")]
