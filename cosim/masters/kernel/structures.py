"""The structures of structures.h in ctypes."""

import ctypes
from collections.abc import Iterator
from typing import Any

from cosim.slaves.breadcrumb import Breadcrumb
from cosim.slaves.fmi3_kernel import Fmi3Structure, Scalar3Structure
from cosim.slaves.tabulated import ChannelStructure, FeedStructure

CALLS = {
    1: "fmi2Set{kind}",
    2: "fmi2SetRealInputDerivatives",
    3: "fmi2DoStep",
    4: "fmi2Get{kind}",
    5: "fmi2GetRealOutputDerivatives",
    6: "fmi2GetFMUstate",
    7: "fmi2SetFMUstate",
}
"""What failed by its number in structures.h, where a call of the FMU did."""

SET, STEP, GET = 1, 3, 4
NOT_FINITE, REFUSED, MEMORY = 8, 9, 10

FUNCTIONS = {
    "set_real": "fmi2SetReal",
    "get_real": "fmi2GetReal",
    "set_integer": "fmi2SetInteger",
    "get_integer": "fmi2GetInteger",
    "set_boolean": "fmi2SetBoolean",
    "get_boolean": "fmi2GetBoolean",
    "set_string": "fmi2SetString",
    "get_string": "fmi2GetString",
    "set_derivatives": "fmi2SetRealInputDerivatives",
    "get_derivatives": "fmi2GetRealOutputDerivatives",
    "do_step": "fmi2DoStep",
    "get_status": "fmi2GetStatus",
    "get_boolean_status": "fmi2GetBooleanStatus",
    "get_real_status": "fmi2GetRealStatus",
    "get_state": "fmi2GetFMUstate",
    "set_state": "fmi2SetFMUstate",
    "free_state": "fmi2FreeFMUstate",
}

_Fields = list[tuple[str, Any]]


def _integers(*names: str) -> _Fields:
    return [(name, ctypes.c_longlong) for name in names]


def _pointers(*names: str) -> _Fields:
    return [(name, ctypes.c_void_p) for name in names]


class GroupStructure(ctypes.Structure):
    """Variables of one component and kind that are set or read in one call."""

    _fields_ = [*_integers("kind", "count"), *_pointers("references", "slots"), *_integers("first", "finite")]
    _fields_ += _pointers("finite_slot", "value", "number", "text")


class WarnedStructure(ctypes.Structure):
    """How often a call has returned fmi2Warning, and in which communication step first."""

    _fields_ = _integers("count", "first")


class AllowedStructure(ctypes.Structure):
    """The values that an input can take."""

    _fields_ = [*_integers("position", "count"), *_pointers("values")]


class WireStructure(ctypes.Structure):
    """An input of what a slot shows: factor * value + addend."""

    _fields_ = [*_pointers("source"), ("factor", ctypes.c_double), ("addend", ctypes.c_double)]


class ComponentStructure(ctypes.Structure):
    """A component in its turn."""

    _fields_ = [
        *_pointers("name", "warned", "instance", *FUNCTIONS, "state"),
        *_integers("period", "at_end", "in_step", "inputs", "input_groups", "only_real"),
        *_pointers("input_references", "wire"),
        *_integers("mixed"),
        *_pointers("mixed_position", "input_group", "source", "slope_slot", "timing", "ahead", "source_component"),
        *_pointers("begun", "begun_slope", "value"),
        *_integers("restricted"),
        *_pointers("allowed"),
        *_integers("input_derivatives"),
        *_pointers("derivative_references", "derivative_orders", "position", "form", "slot", "slope"),
        *_integers("halfway", "moving"),
        *_pointers("moving_references", "moving_orders", "moving_position", "moving_slope"),
        *_integers("outputs", "offset", "owned", "output_groups", "output_derivatives"),
        *_pointers("output_group", "output_derivative_references", "output_derivative_orders"),
        *_integers("differences", "step_slot"),
        *_pointers("difference_value", "difference_slope", "difference_before", "held"),
        *_integers("passages", "freeze"),
        *_pointers("passage"),
    ]


class PassageStructure(ctypes.Structure):
    """A connection on which faults act."""

    _fields_ = [*_integers("first", "source", "slopes"), *_pointers("slope")]
    _fields_ += [("factor", ctypes.c_double), ("addend", ctypes.c_double), ("key", ctypes.c_ulonglong)]


class ReadingStructure(ctypes.Structure):
    """Outputs that are read again at a communication point."""

    _fields_ = [*_integers("component", "groups", "slopes"), *_pointers("group", "wire")]


class PassStructure(ctypes.Structure):
    """A straight turn or reading."""

    _fields_ = [
        *_integers("straight", "component"),
        *_pointers("instance", "set", "step", "get"),
        *_integers("inputs", "outputs", "finite"),
        *_pointers("input_references", "output_references", "wire", "input", "output", "finite_value"),
        *_integers("slopes", "kept"),
    ]


class CallStructure(ctypes.Structure):
    """A call of a wave."""

    _fields_ = [*_integers("place", "calling"), *_pointers("instance", "function", "references", "value")]
    _fields_ += _integers("count")


class WaveStructure(ctypes.Structure):
    """Passes that take nothing from one another."""

    _fields_ = _integers("first", "wires", "sets", "steps", "gets", "slots")
    _fields_ += _pointers("wire", "bare", "input", "set", "step", "get", "value", "finite")


class LoopStructure(ctypes.Structure):
    """Components that are repeated until their unknowns agree."""

    _fields_ = [*_integers("first", "members", "unknowns", "values", "memory")]
    _fields_ += _pointers("slots", "value", "slope", "partner", "nominal", "x", "residual", "change", "matrix")


class RunStructure(ctypes.Structure):
    """The whole run, where it stands, what ended it."""

    _fields_ = [
        *_integers("start", "stop", "step", "denominator", "every", "steps", "divisions", "events"),
        *_pointers("divided_at", "dividing", "event_point"),
        *_integers("components"),
        *_pointers("component"),
        *_integers("refreshes"),
        *_pointers("refresh"),
        *_integers("size", "owned"),
        *_pointers("point", "newest", "next"),
        *_integers("passes"),
        *_pointers("first_pass"),
        *_integers("all_step", "waves"),
        *_pointers("wave", "unrolled", "careful"),
        *_integers("inputs"),
        *_pointers("input_slot", "input_source", "input_factor", "input_addend"),
        *_integers("columns"),
        *_pointers("column_slot"),
        *_integers("stop_slot"),
        *_pointers("stop_asked", "texts"),
        ("pending_timeout", ctypes.c_double),
        *_integers("stages"),
        *_pointers("stage", "loop"),
        ("tolerance", ctypes.c_double),
        *_integers("memory_size"),
        *_pointers("memory", "memory_next"),
        *_integers("evaluations", "stuck"),
        *_integers("done", "last_row", "calling", "ended", "underway"),
        *_integers("failed_call", "failed_component", "failed_status", "failed_slot", "failed_kind"),
    ]


STRUCTURES = (
    GroupStructure,
    AllowedStructure,
    WarnedStructure,
    WireStructure,
    ComponentStructure,
    PassageStructure,
    ReadingStructure,
    PassStructure,
    CallStructure,
    WaveStructure,
    LoopStructure,
    RunStructure,
    Breadcrumb,
    ChannelStructure,
    FeedStructure,
    Scalar3Structure,
    Fmi3Structure,
)


def sizes_and_offsets() -> Iterator[int]:
    """Yield the size of each structure and the offsets of its fields, as kernel_layout lists those of structures.h."""
    for structure in STRUCTURES:
        yield ctypes.sizeof(structure)
        for name, *_ in structure._fields_:
            yield getattr(structure, name).offset
