"""The explicit loop in Python: the readable reference of the kernel, with the same arithmetic in the same order."""

import time
from collections.abc import Callable, Generator, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from cosim.errors import CallFailed, StepFailed
from cosim.masters.master import Block
from cosim.masters.plan import AFTER_STEP, AT_POINT, CENTRED, MIDPOINT, RAMP, STEP_MEAN, ComponentPlan, Plan, Reading
from cosim.slaves.slave import Slave
from cosim.time import to_seconds

FloatArray = NDArray[np.float64]

LOOK = 0.1
"""Seconds of wall time after which the caller gets a look."""


def steps(
    plan: Plan, slaves: Mapping[str, Slave], values: FloatArray, block: Block, stop: Callable[[], bool]
) -> Generator[int]:
    """Run the plan; see `Master.steps`. Raises `StepFailed`."""
    schedule = plan.schedule
    run = Run(plan, slaves, values)
    block.append(to_seconds(schedule.start), plan.row(run.point))
    done = last_row = 0
    try:
        look = time.perf_counter() + LOOK
        while done < schedule.steps and not stop() and not plan.ends(run.point):
            if block.full or time.perf_counter() > look:
                yield done
                look = time.perf_counter() + LOOK
            run.step(done)
            done += 1
            if schedule.recorded(done):
                block.append(to_seconds(schedule.point(done)), plan.row(run.point))
                last_row = done
    finally:
        if last_row != done:
            block.append(to_seconds(schedule.point(done)), plan.row(run.point))
    yield done


class Run:
    """Slaves at a communication point.

    `point` has every slot as it is seen at that point; `newest` what the components returned last. They differ while
    components step, and where a slow component is ahead of the others. `point` is replaced as a whole at the end of a
    step: whatever interrupts the step, it stays the last communication point reached.
    """

    def __init__(self, plan: Plan, slaves: Mapping[str, Slave], values: FloatArray) -> None:
        self.plan = plan
        self.slaves = [slaves[c.name] for c in plan.components]
        self.point = values.copy()
        self.newest = values.copy()
        self.at_period_start: dict[str, FloatArray] = {}

    def step(self, k: int) -> None:
        """Take communication step k, from point k to point k + 1."""
        schedule = self.plan.schedule
        for c in self.plan.components:
            if c.at_end and k == c.start(k):
                self.at_period_start[c.name] = self._sources_at_start(c, k)
        for c, slave in zip(self.plan.components, self.slaves, strict=True):
            if c.due(k, schedule):
                self._advance(c, slave, k)
        point = self.point.copy()
        for c in self.plan.components:
            if c.end(k, schedule) == k + 1:
                point[c.outputs.slots] = self.newest[c.outputs.slots]
        for reading in self.plan.refresh:
            if self.plan.components[reading.component].end(k, schedule) == k + 1:
                self._refresh(reading, point, k)
        self.point = point

    def _advance(self, c: ComponentPlan, slave: Slave, k: int) -> None:
        schedule = self.plan.schedule
        begin, end = schedule.point(c.start(k)), schedule.point(c.end(k, schedule))
        t, h = to_seconds(begin), to_seconds(end - begin)
        outputs = c.outputs
        try:
            ends = self._set_inputs(c, slave, k, h)
            slave.do_step(t, h)
            self._set_centred(c, slave, ends)
            values = slave.get_real(outputs.references)
            self.newest[outputs.values] = values
            if outputs.derivative_references:
                self.newest[outputs.derivatives] = slave.get_output_derivatives(
                    outputs.derivative_references, outputs.derivative_orders
                )
        except CallFailed as error:
            raise failed_step(error, t, h) from error
        _refuse_not_finite(c, slave, t, h, outputs.names, values)

    def _set_inputs(self, c: ComponentPlan, slave: Slave, k: int, h: float) -> FloatArray:
        """Set what the step takes; return b, the sources' values at its end."""
        inputs, derivatives = c.inputs, c.derivatives
        if not inputs.references:
            return np.zeros(0)
        a = self.at_period_start[c.name] if c.at_end else self._sources_at_start(c, k)
        b = self._sources_at_end(c, k)
        value = a.copy()
        held = (inputs.timing == AFTER_STEP) | (inputs.timing == STEP_MEAN)
        value[held] = b[held]
        middle = (inputs.timing == MIDPOINT) | (inputs.timing == CENTRED)
        value[middle] = 0.5 * (a[middle] + b[middle])
        slave.set_real(inputs.references, inputs.factor * value + inputs.addend)
        if derivatives.references:
            slope = (b[derivatives.position] - a[derivatives.position]) / h
            slope = np.where(derivatives.slot < 0, slope, self.point[derivatives.slot])
            slave.set_input_derivatives(
                derivatives.references, derivatives.orders, inputs.factor[derivatives.position] * slope
            )
        return b

    @staticmethod
    def _set_centred(c: ComponentPlan, slave: Slave, ends: FloatArray) -> None:
        """Set the centred inputs to their values at the end of the step, for the outputs that are read next."""
        inputs, at = c.inputs, c.inputs.centred
        if inputs.centred_references:
            slave.set_real(inputs.centred_references, inputs.factor[at] * ends[at] + inputs.addend[at])

    def _sources_at_start(self, c: ComponentPlan, k: int) -> FloatArray:
        """Return a: the sources' values where the target's period begins, shape (n_in,)."""
        a = self.point[c.inputs.source]
        for i in np.flatnonzero(c.inputs.ahead & ((c.inputs.timing == MIDPOINT) | (c.inputs.timing == RAMP))):
            a[i] = self._between(c.inputs.source[i], c.inputs.source_component[i], k, c.start(k))
        return a

    def _sources_at_end(self, c: ComponentPlan, k: int) -> FloatArray:
        """Return b: the sources' values where the target's period ends, shape (n_in,)."""
        schedule = self.plan.schedule
        b = self.newest[c.inputs.source]
        for i in np.flatnonzero(c.inputs.ahead & (c.inputs.timing != STEP_MEAN)):
            source = self.plan.components[c.inputs.source_component[i]]
            if source.end(k, schedule) > c.end(k, schedule):
                if c.inputs.timing[i] in (AT_POINT, AFTER_STEP, CENTRED):
                    b[i] = self.point[c.inputs.source[i]]
                else:
                    b[i] = self._between(c.inputs.source[i], c.inputs.source_component[i], k, c.end(k, schedule))
        return b

    def _between(self, slot: int, place: int, k: int, at: int) -> float:
        """Return a slow source's value at communication point `at`, on the line over its own step."""
        schedule, source = self.plan.schedule, self.plan.components[place]
        begin, end = schedule.point(source.start(k)), schedule.point(source.end(k, schedule))
        fraction = (schedule.point(at) - begin) / (end - begin)
        return self.point[slot] + (self.newest[slot] - self.point[slot]) * fraction

    def _refresh(self, reading: Reading, point: FloatArray, k: int) -> None:
        c, slave = self.plan.components[reading.component], self.slaves[reading.component]
        begin, end = self.plan.schedule.point(c.start(k)), self.plan.schedule.point(k + 1)
        t, h = to_seconds(begin), to_seconds(end - begin)
        inputs = c.inputs
        value = np.where(inputs.timing == STEP_MEAN, self.newest[inputs.source], point[inputs.source])
        try:
            slave.set_real(inputs.references, inputs.factor * value + inputs.addend)
            values = slave.get_real(reading.references)
        except CallFailed as error:
            raise failed_step(error, t, h) from error
        names = [c.outputs.names[slot - c.outputs.offset] for slot in reading.slots]
        _refuse_not_finite(c, slave, t, h, names, values)
        self.newest[reading.slots] = point[reading.slots] = values


def failed_step(error: CallFailed, t: float, h: float) -> StepFailed:
    """Return a failed call as the failed step that it is; t, h: start and size of the component's step, s."""
    status = error.status if error.function == "fmi2DoStep" else f"{error.status} from {error.function}"
    return StepFailed(error.component, status, t, h, error.last_successful_time, error.messages)


def not_finite(component: str, slave: Slave, t: float, h: float, variable: str, value: float) -> StepFailed:
    """Return the failure of a step after which an output is no finite number."""
    return StepFailed(component, "fmi2OK", t, h, None, tuple(slave.messages), variable, value)


def _refuse_not_finite(
    c: ComponentPlan, slave: Slave, t: float, h: float, names: Sequence[str], values: FloatArray
) -> None:
    if not np.isfinite(values).all():
        i = int(np.flatnonzero(~np.isfinite(values))[0])
        raise not_finite(c.name, slave, t, h, names[i], float(values[i]))
