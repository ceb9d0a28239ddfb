"""A loop on fmpy as a Python programmer writes it for speed: FMI functions by ctypes, arrays made once, Jacobi.

fmpy_loop.py LOOP.json record; record 1: every output that is wired or shown, in a NumPy array, every step.
"""

import ctypes

import numpy as np
from hand import initialized
from loop import Clock, Loop, report

loop, record = Loop.told()
units, ports = initialized(loop)
MANY = (ctypes.c_void_p, ctypes.c_void_p, ctypes.c_size_t, ctypes.c_void_p)
DO_STEP = (ctypes.c_void_p, ctypes.c_double, ctypes.c_double, ctypes.c_int)


def function(unit, name, types):
    found = ctypes.CDLL(unit.slave.dll._name)[name]
    found.argtypes, found.restype = types, ctypes.c_int
    return found


values = np.zeros(len(ports))
sets, steps, gets = [], [], []
for unit in units:
    component = ctypes.c_void_p(unit.slave.component)
    buffer = np.zeros(len(unit.inputs))
    if unit.inputs:
        own = (ctypes.c_uint * len(unit.inputs))(*unit.inputs)
        set_real = function(unit, "fmi2SetReal", MANY)
        sets.append((set_real, component, own, len(buffer), buffer.ctypes.data, buffer, np.array(unit.sources)))
    if unit.outputs:
        own = (ctypes.c_uint * len(unit.outputs))(*unit.outputs)
        address = values[unit.first :].ctypes.data
        gets.append((function(unit, "fmi2GetReal", MANY), component, own, len(unit.outputs), address))
    steps.append((function(unit, "fmi2DoStep", DO_STEP), component))
for get_real, *arguments in gets:
    get_real(*arguments)
rows = np.empty((loop.steps, len(ports) + 1)) if record else None
h = loop.step


def fly(first: int, end: int) -> None:
    for k in range(first, end):
        t, status = k * h, 0
        for set_real, component, own, count, address, buffer, sources in sets:
            values.take(sources, out=buffer)
            status |= set_real(component, own, count, address)
        for step, component in steps:
            status |= step(component, t, h, 1)
        for get_real, component, own, count, address in gets:
            status |= get_real(component, own, count, address)
        if rows is not None:
            rows[k, 0] = t + h
            rows[k, 1:] = values
        if status > 1:
            raise RuntimeError(f"an FMU fails at step {k}")


clock, shown, k = Clock(), [], 0
for _ in range(loop.samples):
    for part in loop.parts:
        with clock.running():
            fly(k, k + part)
        k += part
    shown.append([values[ports.index(port)] for port in loop.shown])
report(loop, clock.seconds, shown)
