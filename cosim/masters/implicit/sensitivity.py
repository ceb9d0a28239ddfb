"""The Jacobian of a loop's residual from directional derivatives: how each unknown moves the ends of a step.

A member near the end of the step is x' = A x + B u, y = C x + D u, of which FMI gives products with a vector. Where its
inputs' ends move by db and their slopes there by db', a smooth input moves over the step, with r = s / h, by (1), a
ramp by r db:

    du(s) = (3 r^2 - 2 r^3) db + h (r^3 - r^2) db'                                                        (1)
    dx(h) = sum over k = 0, 1, 2 of A^k B (m_k db + n_k db'),  m_k, n_k = integrals of (h - s)^k / k! in (1)  (2)
    dy = C dx + D db,  dx' = A dx + B db,  dy' = C dx' + D db'                                            (3)

(2) is the beginning of the series of e^(A (h - s)), (3) leaves out second derivatives: Broyden's updates do the rest.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from cosim.arrays import BoolArray, FloatArray, IntArray
from cosim.masters.layout import Layout
from cosim.slaves.slave import Slave
from cosim.system.wiring import Port, Wiring
from fmus.description.description import ModelDescription

SMOOTH_VALUE = (1 / 2, 3 / 20, 1 / 30)
SMOOTH_SLOPE = (-1 / 12, -1 / 30, -1 / 120)
RAMP_VALUE = (1 / 2, 1 / 6, 1 / 24)
"""m_k / h^(k+1) and n_k / h^(k+2) of (2)."""


@dataclass(frozen=True)
class Member:
    """One component of a loop: value references of its states, their rates, inputs and outputs, with their slots.

    Inputs are those whose sources are in the loop, `source` and `slope` slots of these (-1: a ramp), `factor` the unit
    conversion; outputs those that others of the loop take, `shown` and `rates` their slots (-1: nobody needs a slope).
    """

    name: str
    states: tuple[int, ...]
    derivatives: tuple[int, ...]
    inputs: tuple[int, ...]
    source: IntArray
    slope: IntArray
    factor: FloatArray
    outputs: tuple[int, ...]
    shown: IntArray
    rates: IntArray

    @property
    def smooth(self) -> BoolArray:
        """Which inputs are smooth."""
        return self.slope >= 0


def members(wiring: Wiring, layout: Layout, names: Sequence[str]) -> tuple[Member, ...]:
    """Return the members of a loop in their order; none where one of them does not give what this needs.

    What faults do to a connection or a component in flight is not in the equations: differences see it.
    """
    inner = [k for k in wiring.links if k.source.component in names and k.target.component in names]
    moving = [k for k in inner if k.timing in ("smooth", "ramp")]
    offered = all(_gives(wiring.descriptions[name]) for name in names)
    if any(k.target in wiring.faulty for k in inner) or not wiring.freezing.isdisjoint(names):
        return ()
    if not offered or any(not k.from_start and not k.step_mean and k not in moving for k in inner):
        return ()
    sources = dict.fromkeys(k.source for k in moving)
    return tuple(_member(wiring, layout, name, names, [p for p in sources if p.component == name]) for name in names)


def _gives(description: ModelDescription) -> bool:
    return description.provides_directional_derivative and not description.sampled


def _member(wiring: Wiring, layout: Layout, name: str, names: Sequence[str], outputs: Sequence[Port]) -> Member:
    description = wiring.descriptions[name]
    links = [k for k in wiring.into(name) if k.timing in ("smooth", "ramp") and k.source.component in names]
    variables = description.variables
    rates = [variables[der] for der in description.derivatives]
    return Member(
        name=name,
        states=tuple(variables[der.derivative or ""].value_reference for der in rates),
        derivatives=tuple(der.value_reference for der in rates),
        inputs=tuple(variables[k.target.variable].value_reference for k in links),
        source=np.array([layout.slots[k.source] for k in links], dtype=np.int64),
        slope=np.array(
            [layout.derivative_slots[k.source, 1] if k.timing == "smooth" else -1 for k in links], dtype=np.int64
        ),
        factor=np.array([k.conversion.factor for k in links], dtype=np.float64),
        outputs=tuple(variables[port.variable].value_reference for port in outputs),
        shown=np.array([layout.slots[port] for port in outputs], dtype=np.int64),
        rates=np.array([layout.derivative_slots.get((port, 1), -1) for port in outputs], dtype=np.int64),
    )


def jacobian(
    loop: Sequence[Member], unknowns: IntArray, size: int, slaves: Mapping[str, Slave], h: float
) -> FloatArray:
    """Return the Jacobian of F(x) - x at the ends of the members' steps of length h, shape (n, n); raises `CallFailed`.

    `unknowns`: their slots, of `size` in all.
    """
    matrix = np.zeros((len(unknowns), len(unknowns)))
    for j, slot in enumerate(unknowns):
        moved = np.zeros(size)
        moved[slot] = 1.0
        for member in loop:
            _step(member, slaves[member.name], moved, h)
        matrix[:, j] = moved[unknowns]
        matrix[j, j] -= 1.0
    return matrix


def _step(member: Member, slave: Slave, moved: FloatArray, h: float) -> None:
    """Move the ends of a member's outputs as those of its inputs move; `moved`: all slots."""
    db = member.factor * moved[member.source]
    dslope = np.where(member.smooth, member.factor * moved[member.slope], 0.0)
    dy = dy_dot = np.zeros(len(member.outputs))
    n = len(member.states)
    if db.any() or dslope.any():
        both = member.derivatives + member.outputs

        def along(knowns: tuple[int, ...], seed: FloatArray) -> FloatArray:
            return slave.directional_derivative(both, knowns, seed) if knowns else np.zeros(len(both))

        end, rate = along(member.inputs, db), along(member.inputs, dslope)  # B and D times db, db'
        dx = np.zeros(n)
        for k in (2, 1, 0):
            value = np.where(member.smooth, SMOOTH_VALUE[k], RAMP_VALUE[k]) * h ** (k + 1)
            given = along(member.inputs, value * db + SMOOTH_SLOPE[k] * h ** (k + 2) * dslope)[:n]
            dx = given + (along(member.states, dx)[:n] if k < 2 else 0.0)  # (2), by Horner's rule
        moving = along(member.states, dx)
        dy = moving[n:] + end[n:]  # (3)
        dy_dot = along(member.states, moving[:n] + end[:n])[n:] + rate[n:]  # (3)
    moved[member.shown] = dy
    needed = member.rates >= 0
    moved[member.rates[needed]] = dy_dot[needed]
