"""The vehicle: parameters that plants and controllers share, one name, unit and text each, and where it starts.

    J - delta^T delta positive definite: the modes hold less inertia than J                       (1)
    no principal moment of J above the sum of the others, as no body has one: 2 J_max <= tr J     (2)

Their start values are one vehicle for all, no paper's: components/numbers/neutral.py.

Frames: B body axes at the mass centre, N inertial, R reference.
"""

from typing import Any

import casadi as ca
import numpy as np

from .framework import Component, Condition, Parameter, not_negative, positive
from .mathematics import cmg
from .mathematics.axes import axis_conditions, spanning_condition
from .mathematics.vectors import asymmetry, smallest_eigenvalue
from .numbers import neutral

DEGREE = np.pi / 180

J = Parameter(
    unit="kg.m2", shape=(3, 3), start=neutral.J, shared=True, doc="inertia of the undeformed spacecraft, rotors locked"
)
delta = Parameter(
    unit="kg(1/2).m",
    shape=("modes", 3),
    start=lambda c: neutral.coupling(c.modes),
    shared=True,
    doc="coupling of rotation and modes, a row a mode",
)
Omega = Parameter(
    unit="rad/s",
    shape=("modes",),
    start=lambda c: neutral.frequencies(c.modes),
    shared=True,
    doc="modal frequency, hub clamped",
)
zeta = Parameter(unit="1", shape=("modes",), start=neutral.ZETA, shared=True, doc="modal damping ratio")


class MomentumStorage:
    """Gyros and wheels, nominal, as a cluster and the controllers that need it know them: a pyramid, and body axes."""

    gimbal_axes_B = Parameter(
        unit="1",
        shape=(3, "gimbals"),
        start=lambda c: neutral.pyramid(c.gimbals)[0],
        shared=True,
        doc="gimbal axes",
    )
    rotor_axes_B = Parameter(
        unit="1",
        shape=(3, "gimbals"),
        start=lambda c: neutral.pyramid(c.gimbals)[1],
        shared=True,
        doc="rotor axes at angle 0",
    )
    rotor_momentum = Parameter(
        unit="N.m.s",
        shape=("gimbals",),
        start=neutral.ROTOR_MOMENTUM,
        shared=True,
        doc="angular momentum of each gyro's rotor",
    )
    spin_axes_B = Parameter(
        unit="1",
        shape=(3, "wheels"),
        start=lambda c: neutral.wheel_axes(c.wheels),
        shared=True,
        doc="spin axes, a column a wheel",
    )
    wheel_inertia = Parameter(
        unit="kg.m2",
        shape=("wheels",),
        start=neutral.WHEEL_INERTIA,
        shared=True,
        doc="inertia of a wheel about its spin axis",
    )


class StorageLimits:
    """What gyros and wheels can do, as a cluster and its steering know it; the start values, 1e9, are no limit."""

    gimbal_rate_limit = Parameter(
        unit="rad/s",
        shape=("gimbals",),
        start=neutral.NO_LIMIT,
        display_unit="deg/s",
        doc="largest gimbal rate",
    )
    gimbal_dead_zone = Parameter(unit="rad/s", display_unit="deg/s", doc="gimbal rates below this are not carried out")
    wheel_torque_limit = Parameter(
        unit="N.m", shape=("wheels",), start=neutral.NO_LIMIT, doc="largest motor torque of a wheel, 1e9: none"
    )


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
