"""What a digital actuator makes of a command, and what its limits ask of it.

    y = command within lower..upper, then moved from the last value by at most rate T             (1)
    n = floor(y/q + 1/2), within the whole numbers from lower/q to upper/q: quantised y = n q     (2)
    no multiple of q in lower..upper: the limit that is nearer to y; q = 0: y                     (3)

Source: none needed. Elementwise, all columns.
Invariants: (1) is within lower..upper if the last value is; (2), (3) are, exactly.
Limits: rate = 0: no limit of the rate. (2) rounds halves up; a command of less than q/2 is lost. A limit is taken for a
multiple of q within 1e-9 q, since a quotient is rounded.
"""

from typing import Any

import casadi as ca

from ..framework import Component, Condition
from .limits import within


def slewed(command: Any, last: Any, lower: Any, upper: Any, rate: Any, period: Any) -> Any:
    """Return the command within its limits, no farther than the rate allows from the last one."""
    wanted = within(command, lower, upper)
    step = rate * period
    return ca.if_else(rate > 0, within(wanted, last - step, last + step), wanted)  # (1)


def quanta(y: Any, quantum: Any) -> Any:
    """Return the whole number of quanta that is nearest to y, halves up; quantum > 0."""
    return ca.floor(y / quantum + 0.5)  # (2)


def quantised(y: Any, quantum: Any, lower: Any, upper: Any) -> Any:
    """Return y rounded to a whole number of quanta, within its limits."""
    some = quantum > 0
    q = ca.if_else(some, quantum, 1)
    first, last = ca.ceil(lower / q - 1e-9), ca.floor(upper / q + 1e-9)
    rounded = within(q * within(quanta(y, q), first, last), lower, upper)  # (2)
    nearer = ca.if_else(y - lower < upper - y, lower, upper)
    return ca.if_else(some, ca.if_else(first > last, nearer, rounded), y)  # (3)


def start_conditions(component: Component, name: str, last: Any, lower: Any, upper: Any) -> list[Condition]:
    """Return the conditions that the state `name`, from which (1) moves on, starts within its limits."""
    state = next(v for v in component.states if v.name == name)
    conditions: list[Condition] = []
    for i, element in enumerate(state.elements()):
        text = f"{element} = {{}} {state.unit} at the start: it must be within its limits, {{}} to {{}} {state.unit}."
        inside = ca.logic_and(last[i] >= lower[i], last[i] <= upper[i])
        conditions.append(Condition(inside, text, (last[i], lower[i], upper[i])))
    return conditions
