"""The vehicle: parameters that plants and controllers share, one name, unit and text each, and where it starts.

    J - delta^T delta positive definite: the modes hold less inertia than J                       (1)
    no principal moment of J above the sum of the others, as no body has one: 2 J_max <= tr J     (2)
    axes as they are installed: s_i0 = nominal + ds_i,  t_i0 = nominal + dt_i,  a_j = nominal + da_j  (3)

Their start values are one vehicle for all, no paper's: components/numbers/neutral.py.

Frames: B body axes at the mass centre, N inertial, R reference.
"""

from typing import Any

import casadi as ca
import numpy as np

from .framework import Component, Condition, Parameter, not_negative, positive
from .mathematics import cmg
from .mathematics.axes import spanning_condition
from .mathematics.vectors import asymmetry, smallest_eigenvalue
from .numbers import neutral

DEGREE = np.pi / 180

J = Parameter(
    unit="kg.m2", shape=(3, 3), start=neutral.J, shared=True, doc="inertia of the undeformed spacecraft, rotors locked"
)
delta = Parameter(
    unit="kg^(1/2).m",
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
        unit_length=True,
        doc="gimbal axes",
    )
    rotor_axes_B = Parameter(
        unit="1",
        shape=(3, "gimbals"),
        start=lambda c: neutral.pyramid(c.gimbals)[1],
        shared=True,
        unit_length=True,
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
        unit_length=True,
        doc="spin axes, a column a wheel",
    )
    wheel_inertia = Parameter(
        unit="kg.m2",
        shape=("wheels",),
        start=neutral.WHEEL_INERTIA,
        shared=True,
        doc="inertia of a wheel about its spin axis",
    )


class Installation:
    """How far the axes of gyros and wheels are from the nominal ones, element by element."""

    rotor_deviation = Parameter(unit="1", shape=(3, "gimbals"), doc="ds, true minus nominal rotor axes")
    transverse_deviation = Parameter(unit="1", shape=(3, "gimbals"), doc="dt, true minus nominal transverse axes")
    spin_deviation = Parameter(unit="1", shape=(3, "wheels"), doc="da, true minus nominal spin axes")


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
    """Return the condition that a quaternion that comes from others is, at the start, one of a rotation."""
    norm = ca.norm_2(q)
    text = f"{name} has norm {{}} at the start, a unit quaternion (within 1e-6) is needed. Divide it by its norm."
    return Condition(1e-6 - ca.fabs(norm - 1), text, (norm,))


def attitude_conditions(u: Any) -> list[Condition]:
    """Return the conditions on the attitudes that a controller is given at the start."""
    return [quaternion_condition(name, vars(u)[name]) for name in ("q_BN", "q_RN")]


def storage_conditions(component: Component, p: Any) -> list[Condition]:
    """Return the conditions on the parameters of `MomentumStorage`."""
    conditions = cmg.geometry_conditions(p.gimbal_axes_B, p.rotor_axes_B)
    every = ca.horzcat(p.rotor_axes_B, cmg.transverse(p.gimbal_axes_B, p.rotor_axes_B), p.spin_axes_B)
    conditions.append(spanning_condition("rotor, transverse and spin axes together", every))
    return [*conditions, *positive(component, p, "rotor_momentum", "wheel_inertia")]


def true_axes(p: Any) -> tuple[Any, Any, Any]:
    """Return s_0, t_0 and a of `MomentumStorage` with the deviations of `Installation`."""
    t_0 = cmg.transverse(p.gimbal_axes_B, p.rotor_axes_B)
    return p.rotor_axes_B + p.rotor_deviation, t_0 + p.transverse_deviation, p.spin_axes_B + p.spin_deviation  # (3)


def installation_conditions(p: Any) -> list[Condition]:
    """Return the conditions that deviations leave every gyro and wheel a momentum, and the cluster three axes."""
    s_0, t_0, a = true_axes(p)
    checked: list[tuple[str, Any]] = []
    for i in range(s_0.shape[1]):
        text = f"rotor_deviation leaves gyro {i + 1} no rotor axis: rotor_axes_B + rotor_deviation has length {{}}"
        checked.append((text, ca.norm_2(s_0[:, i])))
        text = f"transverse_deviation leaves gyro {i + 1} no plane to turn its momentum in: |s_0 x t_0| is {{}}"
        checked.append((text, ca.norm_2(ca.cross(s_0[:, i], t_0[:, i]))))
    for j in range(a.shape[1]):
        text = f"spin_deviation leaves wheel {j + 1} no spin axis: spin_axes_B + spin_deviation has length {{}}"
        checked.append((text, ca.norm_2(a[:, j])))
    conditions = [Condition(size - 1e-3, f"{text}, more than 0.001 is needed.", (size,)) for text, size in checked]
    every = ca.horzcat(s_0, t_0, a)
    return [*conditions, spanning_condition("rotor, transverse and spin axes with their deviations", every)]


def limit_conditions(component: Component, p: Any) -> list[Condition]:
    """Return the conditions on the parameters of `StorageLimits`."""
    limits = positive(component, p, "gimbal_rate_limit", "wheel_torque_limit")
    return [*limits, *not_negative(component, p, "gimbal_dead_zone")]
