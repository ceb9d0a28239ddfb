"""The slopes at the first communication point, right after initialization: true, or none.

An output derivative is dy/dt + dy/dx x' + dy/du u', so the slopes u' of the inputs are set before it is asked for, in
the order of direct feedthrough. FMI 2.0 allows that only for FMUs that say so (`refresh`); the slope of another one's
output that follows a moving input directly, of an output in an algebraic loop, and of one that waits for such a slope
is none.
"""

from dataclasses import dataclass

import numpy as np

from cosim.arrays import FloatArray, IntArray
from cosim.masters.layout import Layout
from cosim.masters.slopes import MOVING, UNKNOWN
from cosim.slaves.slave import Slave
from cosim.system import graph
from cosim.system.timing import between
from cosim.system.wiring import Port, Wiring


@dataclass(frozen=True)
class Asked:
    """Output derivatives of one component that are asked for at once, and the input slopes that are set before.

    `slots`: of the derivatives, shape (n,). `needs`: for each of them the slots of the slopes that it follows, -1 for
    one that nobody knows; None: it cannot be known. The input slopes are factor * slope, arrays of shape (m,).
    """

    component: str
    references: tuple[int, ...]
    orders: tuple[int, ...]
    slots: IntArray
    needs: tuple[tuple[int, ...] | None, ...]
    inputs: tuple[int, ...]
    slopes: IntArray
    factor: FloatArray


def asked(wiring: Wiring, layout: Layout) -> tuple[Asked, ...]:
    """Return what is asked for, in this order."""
    differences = {
        int(slot) for c in layout.components if c.outputs.differences for slot in c.outputs.differences.slope
    }
    rows: list[Asked] = []
    for evaluation in graph.evaluation_order(wiring):
        told = [p for p in evaluation.outputs if layout.derivative_slots.get((p, 1), -1) not in differences | {-1}]
        for name in dict.fromkeys(port.component for port in told):
            mine = [port for port in told if port.component == name]
            rows.append(_asked(wiring, layout, name, mine, loop=evaluation.loop))
    return tuple(rows)


def _asked(wiring: Wiring, layout: Layout, name: str, ports: list[Port], *, loop: bool) -> Asked:
    description = wiring.descriptions[name]
    links = [
        link for link in wiring.into(name) if link.timing in MOVING and (link.source, 1) in layout.derivative_slots
    ]
    into = {link.target.variable: link for link in wiring.into(name)}
    keys = [(port, n) for port in ports for n in range(1, 9) if (port, n) in layout.derivative_slots]

    def needs(port: Port) -> tuple[int, ...] | None:
        followed = [into[v] for v in description.feedthrough(port.variable) if v in into]
        moving = [link for link in followed if between(wiring, link)]
        if moving and (loop or not description.refresh):
            return None
        return tuple(layout.slope(link) for link in moving)

    return Asked(
        component=name,
        references=tuple(wiring.variable(port).value_reference for port, _ in keys),
        orders=tuple(n for _, n in keys),
        slots=np.array([layout.derivative_slots[key] for key in keys], dtype=np.int64),
        needs=tuple(needs(port) for port, _ in keys),
        inputs=tuple(wiring.variable(link.target).value_reference for link in links),
        slopes=np.array([layout.slope(link) for link in links], dtype=np.int64),
        factor=np.array([layout.factor(link) for link in links], dtype=np.float64),
    )


def read(asked: Asked, slave: Slave, values: FloatArray) -> None:
    """Put slopes into their slots; raises `CallFailed`."""
    if asked.inputs and any(asked.needs):
        slope = values[asked.slopes]
        slave.set_input_derivatives(
            asked.inputs, (1,) * len(asked.inputs), asked.factor * np.where(np.isnan(slope), 0.0, slope)
        )
    values[asked.slots] = slave.get_output_derivatives(asked.references, asked.orders)
    for slot, needs in zip(asked.slots, asked.needs, strict=True):
        if needs is None or any(needed < 0 or np.isnan(values[needed]) for needed in needs):
            values[slot] = UNKNOWN
