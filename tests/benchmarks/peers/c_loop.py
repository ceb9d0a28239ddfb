"""A loop in C, written by hand: c_loop.py LOOP.json record; record 1: every output kept in memory, every step."""

import ctypes
import tempfile
from pathlib import Path

import numpy as np
from hand import initialized
from loop import Clock, Loop, report

from fmus.toolchain import compile_library


class Unit(ctypes.Structure):
    """As c_loop.c has it."""

    _fields_ = [(name, ctypes.c_void_p) for name in ("instance", "set", "get", "step", "inputs", "sources", "outputs")]
    _fields_ += [(name, ctypes.c_long) for name in ("n_inputs", "n_outputs", "first")]


loop, record = Loop.told()
units, ports = initialized(loop)
kept: list[object] = []


def address(kind, values) -> int:
    kept.append((kind * max(len(values), 1))(*values))
    return ctypes.addressof(kept[-1])


described = (Unit * len(units))()
for unit, made in zip(units, described, strict=True):
    library = ctypes.CDLL(unit.slave.dll._name)
    made.instance = unit.slave.component
    for field, name in (("set", "fmi2SetReal"), ("get", "fmi2GetReal"), ("step", "fmi2DoStep")):
        setattr(made, field, ctypes.cast(library[name], ctypes.c_void_p))
    made.inputs, made.outputs = address(ctypes.c_uint, unit.inputs), address(ctypes.c_uint, unit.outputs)
    made.sources = address(ctypes.c_long, unit.sources)
    made.n_inputs, made.n_outputs, made.first = len(unit.inputs), len(unit.outputs), unit.first
values, inputs = np.zeros(len(ports)), np.zeros(max(len(unit.inputs) for unit in units) or 1)
rows = np.empty((loop.steps, len(ports) + 1)) if record else None
with tempfile.TemporaryDirectory() as place:
    source = Path(__file__).with_suffix(".c")
    compile_library(source.parent, source.name, Path(place) / "loop.so")
    fly = ctypes.CDLL(f"{place}/loop.so").fly
vectors = [ctypes.c_void_p(a.ctypes.data if a is not None else None) for a in (values, inputs, rows)]
clock, shown, k = Clock(), [], 0
for _ in range(loop.samples):
    for part in loop.parts:
        steps = ctypes.c_long(k), ctypes.c_long(k + part)
        with clock.running():
            status = fly(described, len(units), *steps, ctypes.c_double(loop.step), len(ports), *vectors)
        assert status == 0, status
        k += part
    shown.append([values[ports.index(port)] for port in loop.shown])
report(loop, clock.seconds, shown)
