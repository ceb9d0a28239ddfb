"""Exact initialization, the same for every master.

In initialization mode inputs are set and outputs read in the order of InitialUnknowns, again and again, until no bit
changes. Algebraic loops are solved (algebraic_loop.py).
"""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from cosim.errors import AlgebraicLoop, CallFailed, InitializationFailed
from cosim.masters.algebraic_loop import Loop, same_bits
from cosim.masters.exchange import Exchange
from cosim.masters.plan import AT_POINT, ComponentPlan, Plan, Reading
from cosim.slaves.slave import Slave
from cosim.system.wiring import Wiring
from cosim.time import to_seconds

FloatArray = NDArray[np.float64]


def initialize(plan: Plan, wiring: Wiring, slaves: Mapping[str, Slave]) -> FloatArray:
    """Bring fresh slaves to the first communication point; return the values of the plan's slots, shape (size,).

    Raises `InitializationFailed` (an FMU refused, an output is not finite) and `AlgebraicLoop`.
    """
    exchange = Exchange(plan, slaves)
    try:
        _enter(plan, wiring, slaves)
        _settle(plan, exchange)
        for place in range(len(plan.components)):
            exchange.set_inputs(place)
        for slave in slaves.values():
            slave.exit_initialization_mode()
        return _read(plan, slaves, exchange.values)
    except CallFailed as error:
        raise _refusal(plan, exchange, error) from error


def _refusal(plan: Plan, exchange: Exchange, error: CallFailed) -> InitializationFailed:
    """Return what failed; where a number that is none was passed on, the words of the component that made it.

    Its parameters may be the reason, of which an FMU speaks when initialization mode ends; before, only its neighbour
    has refused the number.
    """
    for c in plan.components if error.function == "fmi2SetReal" else ():
        values, slave = exchange.values[c.outputs.values], exchange.slaves[c.name]
        if not np.isfinite(values).all():
            try:
                slave.exit_initialization_mode()
            except CallFailed as reason:
                error = reason
                break
            return _not_finite(c, values, slave)
    return InitializationFailed(error.component, f"{error.function} returned {error.status}", error.messages)


COMMIT_SHOWN = "solver.commit_shown"
"""Parameter of our sampled FMUs: 1 where the inputs set before a step are those of its end, not of a sample due now."""


def _enter(plan: Plan, wiring: Wiring, slaves: Mapping[str, Slave]) -> None:
    for slave in slaves.values():
        slave.instantiate()
    for port, value in wiring.settings.items():
        slaves[port.component].set(slaves[port.component].description.variables[port.variable], value)
    for c in plan.components:
        slave = slaves[c.name]
        if slave.description.sampled and (c.inputs.timing != AT_POINT).any():
            slave.set(slave.description.variables[COMMIT_SHOWN], 1.0)
    for slave in slaves.values():
        slave.setup_experiment(to_seconds(plan.schedule.start))
    for slave in slaves.values():
        slave.enter_initialization_mode()
    for port, value in wiring.held.items():
        slaves[port.component].set(slaves[port.component].description.variables[port.variable], value)


def _settle(plan: Plan, exchange: Exchange) -> None:
    """Sweep until no bit changes; n parts need at most n + 2 sweeps even where InitialUnknowns are wrong."""
    parts = [Loop(exchange, e.readings, e.loop) if e.loop else Chain(exchange, e.readings) for e in plan.initialization]
    before = exchange.values.copy()
    for _ in range(len(parts) + 3):
        before, known = exchange.values.copy(), exchange.known.copy()
        for part in parts:
            part.evaluate()
        if same_bits(exchange.values, before) and (exchange.known == known).all():
            return
    names = [f"{c.name}.{n}" for c in plan.components for n in c.outputs.names]
    slots = [s for c in plan.components for s in range(c.outputs.values.start, c.outputs.values.stop)]
    changing = [n for n, s in zip(names, slots, strict=True) if exchange.values[s] != before[s]]
    raise AlgebraicLoop(changing, "these values never settle, though InitialUnknowns show no loop")


def _read(plan: Plan, slaves: Mapping[str, Slave], values: FloatArray) -> FloatArray:
    for c in plan.components:
        slave, outputs = slaves[c.name], c.outputs
        values[outputs.values] = slave.get_real(outputs.references)
        if not np.isfinite(values[outputs.values]).all():
            raise _not_finite(c, values[outputs.values], slave)
        if outputs.derivative_references:
            values[outputs.derivatives] = slave.get_output_derivatives(
                outputs.derivative_references, outputs.derivative_orders
            )
    return values


def _not_finite(c: ComponentPlan, values: FloatArray, slave: Slave) -> InitializationFailed:
    i = int(np.flatnonzero(~np.isfinite(values))[0])
    return InitializationFailed(c.name, f"{c.outputs.names[i]} is {values[i]} at the start", tuple(slave.messages))


class Chain:
    """Outputs of one component that depend on none of their own."""

    def __init__(self, exchange: Exchange, readings: tuple[Reading, ...]) -> None:
        self.exchange, self.readings = exchange, readings

    def evaluate(self) -> None:
        """Set the inputs, read the outputs."""
        for reading in self.readings:
            self.exchange.set_inputs(reading.component)
            self.exchange.store(reading, self.exchange.read(reading))
