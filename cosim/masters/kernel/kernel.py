"""The compiled loop for Python: compile kernel.c once, lay out a plan in C structures, run it in chunks.

With the library of FMUs one of the two places of this package that reach into `fmus`: for the compiler.
"""

import ctypes
import hashlib
import os
import time
from collections.abc import Callable, Generator, Mapping
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cosim.errors import STATUS, CallFailed
from cosim.masters.loop import failed_step, not_finite
from cosim.masters.master import Block
from cosim.masters.plan import ComponentPlan, Plan, Reading
from cosim.slaves.fmi2 import FmuSlave
from cosim.slaves.slave import Slave
from cosim.time import to_seconds
from fmus.errors import BuildError
from fmus.export.build import build_folder
from fmus.toolchain import compile_library, compiler_name

FloatArray = NDArray[np.float64]

SOURCE = Path(__file__).with_name("kernel.c")
CALLS = ("", "fmi2SetReal", "fmi2SetRealInputDerivatives", "fmi2DoStep", "fmi2GetReal", "fmi2GetRealOutputDerivatives")
NOT_FINITE = 6
LOOK = 0.05
"""Seconds of wall time after which the caller gets a look, about."""


class _Component(ctypes.Structure):
    _fields_ = [
        *(
            (name, ctypes.c_void_p)
            for name in ("instance", "set", "get", "set_derivatives", "get_derivatives", "do_step")
        ),
        *((name, ctypes.c_longlong) for name in ("period", "at_end", "inputs")),
        *((name, ctypes.c_void_p) for name in ("input_references", "source", "timing", "ahead", "source_component")),
        *((name, ctypes.c_void_p) for name in ("factor", "addend", "begin_values", "value")),
        ("centred", ctypes.c_longlong),
        *((name, ctypes.c_void_p) for name in ("centred_references", "centred_position", "centred_value")),
        ("input_derivatives", ctypes.c_longlong),
        *(
            (name, ctypes.c_void_p)
            for name in ("derivative_references", "derivative_orders", "position", "slot", "slope")
        ),
        *((name, ctypes.c_longlong) for name in ("outputs", "offset", "output_derivatives")),
        *(
            (name, ctypes.c_void_p)
            for name in ("output_references", "output_derivative_references", "output_derivative_orders")
        ),
    ]


class _Reading(ctypes.Structure):
    _fields_ = [
        *((name, ctypes.c_longlong) for name in ("component", "count")),
        *((name, ctypes.c_void_p) for name in ("references", "slots", "value")),
    ]


class _Run(ctypes.Structure):
    _fields_ = [
        *((name, ctypes.c_longlong) for name in ("start", "stop", "step", "every", "steps", "components")),
        ("component", ctypes.c_void_p),
        ("refreshes", ctypes.c_longlong),
        ("refresh", ctypes.c_void_p),
        ("size", ctypes.c_longlong),
        *((name, ctypes.c_void_p) for name in ("point", "newest", "next")),
        ("columns", ctypes.c_longlong),
        *((name, ctypes.c_void_p) for name in ("column_source", "column_factor", "column_addend")),
        *((name, ctypes.c_longlong) for name in ("stop_slot", "done", "last_row")),
        *((name, ctypes.c_longlong) for name in ("failed_call", "failed_component", "failed_status", "failed_slot")),
    ]


@cache
def library() -> Any:
    """Return the compiled kernel; raises BuildError where it cannot be compiled. Compiled once, then kept on disk."""
    key = hashlib.sha256(SOURCE.read_bytes() + compiler_name().encode()).hexdigest()[:16]
    path = build_folder() / "kernel" / f"kernel-{key}{'.dll' if os.name == 'nt' else '.so'}"
    if not path.is_file():
        compile_library(SOURCE.parent, SOURCE.name, path)
    loaded = ctypes.CDLL(str(path))
    loaded.kernel_run.restype = ctypes.c_longlong
    loaded.kernel_run.argtypes = [
        ctypes.c_void_p,
        ctypes.c_longlong,
        ctypes.c_void_p,
        ctypes.c_longlong,
        ctypes.c_longlong,
    ]
    return loaded


def obstacle(slaves: Mapping[str, Slave]) -> str:
    """Return why these slaves cannot fly in the kernel, "" if they can."""
    other = [name for name, slave in slaves.items() if not isinstance(slave, FmuSlave)]
    if other:
        return f"{other[0]} is no FMU"
    try:
        library()
    except BuildError as error:
        return str(error)
    return ""


def steps(
    plan: Plan, slaves: Mapping[str, Slave], values: FloatArray, block: Block, stop: Callable[[], bool]
) -> Generator[int]:
    """Run the plan as `masters.loop.steps` does, bit for bit; see `Master.steps`. Raises `StepFailed`.

    The slaves must be FMUs, see `obstacle`.
    """
    fmus = {name: slave for name, slave in slaves.items() if isinstance(slave, FmuSlave)}
    flight = _Flight(plan, fmus, values)
    run, schedule = flight.run, plan.schedule
    block.append(to_seconds(schedule.start), plan.row(values))
    chunk = 1
    try:
        while run.done < schedule.steps and not stop() and not plan.ends(flight.point()):
            if block.full:
                yield run.done
            before, began = run.done, time.perf_counter()
            block.count = library().kernel_run(
                ctypes.byref(run), chunk, block.data.ctypes.data, len(block.data), block.count
            )
            if run.failed_call:
                raise flight.failure()
            took = time.perf_counter() - began
            if run.done - before == chunk:
                chunk = max(1, min(4 * chunk, int(chunk * LOOK / max(took, 1e-9))))
            yield run.done
    finally:
        if run.last_row != run.done:
            block.append(to_seconds(schedule.point(run.done)), plan.row(flight.point()))
    yield run.done


class _Flight:
    """A plan in C structures; keeps every array alive that they point to."""

    def __init__(self, plan: Plan, slaves: Mapping[str, FmuSlave], values: FloatArray) -> None:
        self.plan = plan
        self.slaves = [slaves[c.name] for c in plan.components]
        self._kept: list[Any] = []
        schedule, columns = plan.schedule, plan.columns
        components = (_Component * max(1, len(plan.components)))(*map(self._component, plan.components, self.slaves))
        readings = (_Reading * max(1, len(plan.refresh)))(*map(self._reading, plan.refresh))
        self._kept += [components, readings]
        self.run = _Run(
            **{name: getattr(schedule, name) for name in ("start", "stop", "step", "every", "steps")},
            components=len(plan.components),
            component=ctypes.addressof(components),
            refreshes=len(plan.refresh),
            refresh=ctypes.addressof(readings),
            size=plan.size,
            **{name: self._array(values, np.float64) for name in ("point", "newest", "next")},
            columns=len(columns.names),
            column_source=self._array(columns.source, np.int64),
            column_factor=self._array(columns.factor, np.float64),
            column_addend=self._array(columns.addend, np.float64),
            stop_slot=plan.stop_slot,
        )

    def _array(self, values: Any, kind: Any) -> int:
        """Return the address of a copy of some values."""
        array = np.array(values, dtype=kind)
        self._kept.append(array)
        return array.ctypes.data

    def _component(self, c: ComponentPlan, slave: FmuSlave) -> _Component:
        inputs, derivatives, outputs = c.inputs, c.derivatives, c.outputs
        references, integers, work = np.uint32, np.int64, np.zeros(len(inputs.references))
        return _Component(
            instance=slave.address,
            set=slave.entry("fmi2SetReal"),
            get=slave.entry("fmi2GetReal"),
            set_derivatives=slave.entry("fmi2SetRealInputDerivatives"),
            get_derivatives=slave.entry("fmi2GetRealOutputDerivatives"),
            do_step=slave.entry("fmi2DoStep"),
            period=c.period,
            at_end=c.at_end,
            inputs=len(inputs.references),
            input_references=self._array(inputs.references, references),
            **{
                name: self._array(getattr(inputs, name), integers)
                for name in ("source", "timing", "ahead", "source_component")
            },
            factor=self._array(inputs.factor, np.float64),
            addend=self._array(inputs.addend, np.float64),
            begin_values=self._array(work, np.float64),
            value=self._array(work, np.float64),
            centred=len(inputs.centred_references),
            centred_references=self._array(inputs.centred_references, references),
            centred_position=self._array(inputs.centred, integers),
            centred_value=self._array(np.zeros(len(inputs.centred_references)), np.float64),
            input_derivatives=len(derivatives.references),
            derivative_references=self._array(derivatives.references, references),
            derivative_orders=self._array(derivatives.orders, np.int32),
            position=self._array(derivatives.position, integers),
            slot=self._array(derivatives.slot, integers),
            slope=self._array(np.zeros(len(derivatives.references)), np.float64),
            outputs=len(outputs.references),
            offset=outputs.offset,
            output_derivatives=len(outputs.derivative_references),
            output_references=self._array(outputs.references, references),
            output_derivative_references=self._array(outputs.derivative_references, references),
            output_derivative_orders=self._array(outputs.derivative_orders, np.int32),
        )

    def _reading(self, reading: Reading) -> _Reading:
        return _Reading(
            component=reading.component,
            count=len(reading.references),
            references=self._array(reading.references, np.uint32),
            slots=self._array(reading.slots, np.int64),
            value=self._array(np.zeros(len(reading.references)), np.float64),
        )

    def _vector(self, address: int) -> FloatArray:
        pointer = ctypes.cast(address, ctypes.POINTER(ctypes.c_double))
        return np.ctypeslib.as_array(pointer, (self.plan.size,))

    def point(self) -> FloatArray:
        """Return the slots as they are seen at the last communication point reached."""
        return self._vector(self.run.point)

    def failure(self) -> Exception:
        """Return what the Python loop would raise for the call that failed."""
        run, schedule = self.run, self.plan.schedule
        c, slave = self.plan.components[run.failed_component], self.slaves[run.failed_component]
        begin, end = schedule.point(c.start(run.done)), schedule.point(c.end(run.done, schedule))
        t, h = to_seconds(begin), to_seconds(end - begin)
        if run.failed_call == NOT_FINITE:
            slot = run.failed_slot
            value = float(self._vector(run.newest)[slot])
            return not_finite(c.name, slave, t, h, c.outputs.names[slot - c.outputs.offset], value)
        function = CALLS[run.failed_call]
        status = STATUS.get(run.failed_status, f"the illegal status {run.failed_status}")
        last = slave.lost(run.failed_status)
        return failed_step(CallFailed(c.name, function, status, tuple(slave.messages), last), t, h)
