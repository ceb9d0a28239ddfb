"""The structures of structures.h in ctypes, and the turns of a run put into them."""

import ctypes
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cosim.arrays import FloatArray
from cosim.masters.implicit.plan import Loop, Plan
from cosim.masters.layout import Group, Inputs, Reading
from cosim.masters.slopes import Differences
from cosim.masters.turns import EXTRAPOLATED_MEAN, MEAN, SIGNAL, SIGNAL_MEAN, Turn, Turns
from cosim.masters.types import Kind
from cosim.slaves.breadcrumb import Breadcrumb
from cosim.slaves.fmi3_kernel import Fmi3Structure, Scalar3Structure
from cosim.slaves.slave import CInterface
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

STEP = 3
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


class ComponentStructure(ctypes.Structure):
    """A component in its turn."""

    _fields_ = [
        *_pointers("name", "warned", "instance", *FUNCTIONS, "state"),
        *_integers("period", "at_end", "in_step", "plain", "inputs", "input_groups", "only_real"),
        *_pointers("input_group", "source", "slope_slot", "signal_slot", "timing", "ahead", "source_component"),
        *_pointers("factor", "addend"),
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
        *_pointers("difference_value", "difference_slope", "difference_before"),
    ]


class ReadingStructure(ctypes.Structure):
    """Outputs that are read again at a communication point."""

    _fields_ = [*_integers("component", "groups", "slopes"), *_pointers("group")]


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
        *_integers("size"),
        *_pointers("point", "newest", "next"),
        *_integers("all_step", "inputs"),
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
        *_integers("done", "last_row", "calling", "ended", "failed_call", "failed_component", "failed_status"),
        *_integers("failed_slot", "failed_kind"),
    ]


STRUCTURES = (
    GroupStructure,
    AllowedStructure,
    WarnedStructure,
    ComponentStructure,
    ReadingStructure,
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


class Packed:
    """Turns in C structures; keeps every array alive that they point to.

    `point`, `newest`, `next` and `begun` are the arrays that the kernel works on. `warned` has for each turn, call and
    kind how often it returned fmi2Warning, and in which communication step first. `plan`: of the iterated master.
    """

    def __init__(self, turns: Turns, instances: Sequence[CInterface], plan: Plan | None = None) -> None:
        self._kept: list[Any] = []
        self.warned = np.zeros((len(turns.all), len(CALLS) + 1, len(Kind), 2), np.int64)
        self._given = [np.zeros(len(turn.component.inputs.links)) for turn in turns.all]
        layout, schedule, columns = turns.layout, turns.schedule, turns.layout.columns
        self.point, self.newest, self.next = (np.zeros(layout.size) for _ in range(3))
        self.begun = np.zeros((2, len(layout.inputs.links)))
        parts = zip(turns.all, instances, self._given, self.warned, strict=True)
        components = self._list(ComponentStructure, [self._component(*part) for part in parts])
        readings = [
            ReadingStructure(
                component=turns.turn_of(r), groups=len(r.groups), slopes=r.slopes, group=self._groups(r.groups)
            )
            for r in turns.refresh
            if isinstance(r, Reading)  # turns with loops do not fly in it
        ]
        inputs = layout.inputs
        self.run = RunStructure(
            **{name: getattr(schedule, name) for name in ("start", "stop", "step", "denominator", "every", "steps")},
            divisions=len(schedule.dividing),
            events=len(schedule.events),
            divided_at=self._array(schedule.divided_at, np.int64),
            dividing=self._array(schedule.dividing, np.int64),
            event_point=self._array(schedule.event_points, np.int64),
            components=len(turns.all),
            component=components,
            refreshes=len(readings),
            refresh=self._list(ReadingStructure, readings),
            size=layout.size,
            **{name: getattr(self, name).ctypes.data for name in ("point", "newest", "next")},
            all_step=all(turn.period == 1 for turn in turns.all),
            inputs=len(inputs.links),
            input_slot=self._array(inputs.slots, np.int64),
            input_source=self._array(inputs.source, np.int64),
            input_factor=self._array(inputs.factor, np.float64),
            input_addend=self._array(inputs.addend, np.float64),
            columns=len(columns.names),
            column_slot=self._array(columns.slots, np.int64),
            stop_slot=layout.stop_slot,
        )
        self.memory, self.memory_next = (np.zeros(plan.memory if plan else 0) for _ in range(2))
        if plan is not None:
            self._plan(plan)

    def _plan(self, plan: Plan) -> None:
        """Put the stages of the iterated master into the run."""
        run, loops = self.run, plan.loops
        stages = [-1 - loops.index(stage) if isinstance(stage, Loop) else stage for stage in plan.stages]
        run.stages, run.stage = len(stages), self._array(stages, np.int64)
        run.loop = self._list(LoopStructure, [self._loop(loop) for loop in loops])
        run.memory_size = len(self.memory)

    def _loop(self, loop: Loop) -> LoopStructure:
        n = loop.size
        work = {name: self._array(np.zeros(n), np.float64) for name in ("x", "residual", "change")}
        numbers = {name: self._array(getattr(loop, name), np.int64) for name in ("slots", "value", "slope", "partner")}
        return LoopStructure(
            first=loop.turns[0],
            members=len(loop.turns),
            unknowns=n,
            values=len(loop.partner),
            memory=loop.memory.start,
            nominal=self._array(loop.nominal, np.float64),
            matrix=self._array(np.zeros(n * n), np.float64),
            **numbers,
            **work,
        )

    def given(self, turn: int, place: int) -> float:
        """Return what an input, by its place, was to be set to last."""
        return float(self._given[turn][place])

    def _array(self, values: Any, kind: Any) -> int:
        """Return the address of a copy of some values."""
        array = np.array(values, dtype=kind)
        self._kept.append(array)
        return array.ctypes.data

    def _list(self, kind: type[ctypes.Structure], structures: Sequence[ctypes.Structure]) -> int:
        """Return the address of structures side by side."""
        array = (kind * max(1, len(structures)))(*structures)
        self._kept.append(array)
        return ctypes.addressof(array)

    def _groups(self, groups: Sequence[Group]) -> int:
        return self._list(GroupStructure, [self._group(group) for group in groups])

    def _group(self, group: Group) -> GroupStructure:
        n = len(group.references)
        consecutive = bool((np.diff(group.slots) == 1).all())
        return GroupStructure(
            kind=group.kind,
            count=n,
            references=self._array(group.references, np.uint32),
            slots=self._array(group.slots, np.int64),
            first=int(group.slots[0]) if consecutive else -1,
            finite=len(group.finite),
            finite_slot=self._array(group.finite, np.int64),
            value=self._array(np.zeros(n), np.float64),
            number=self._array(np.zeros(n), np.int32) if group.kind in (Kind.INTEGER, Kind.BOOLEAN) else 0,
            text=self._array(np.zeros(n), np.uintp) if group.kind == Kind.STRING else 0,
        )

    def _allowed(self, inputs: Inputs) -> int:
        found = [
            AllowedStructure(position=i, count=len(values), values=self._array(values, np.int64))
            for i, values in inputs.allowed.items()
        ]
        return self._list(AllowedStructure, found)

    def _component(
        self, turn: Turn, instance: CInterface, given: FloatArray, warned: NDArray[np.int64]
    ) -> ComponentStructure:
        inputs, outputs, derivatives = turn.component.inputs, turn.component.outputs, turn.derivatives
        n = len(inputs.links)
        in_step = turn.period == 1 and not turn.ahead.any()
        return ComponentStructure(
            name=self._array(bytearray(turn.component.name.encode() + b"\0"), np.uint8),
            warned=warned.ctypes.data,
            instance=instance.component,
            **{field: instance.functions.get(function, 0) for field, function in FUNCTIONS.items()},
            period=turn.period,
            at_end=turn.at_end,
            in_step=in_step,
            plain=in_step and not np.isin(turn.timing, (MEAN, EXTRAPOLATED_MEAN, SIGNAL, SIGNAL_MEAN)).any(),
            inputs=n,
            input_groups=len(inputs.groups),
            only_real=[group.kind for group in inputs.groups] == [Kind.REAL] and not inputs.allowed,
            input_group=self._groups(inputs.groups),
            source=self._array(inputs.source, np.int64),
            slope_slot=self._array(inputs.slope, np.int64),
            signal_slot=self._array(inputs.signal, np.int64),
            timing=self._array(turn.timing, np.int64),
            ahead=self._array(turn.ahead, np.int64),
            source_component=self._array(turn.source_turn, np.int64),
            factor=self._array(inputs.factor, np.float64),
            addend=self._array(inputs.addend, np.float64),
            begun=self.begun[0, turn.begun].ctypes.data,
            begun_slope=self.begun[1, turn.begun].ctypes.data,
            value=given.ctypes.data,
            restricted=len(inputs.allowed),
            allowed=self._allowed(inputs),
            input_derivatives=len(derivatives.references),
            derivative_references=self._array(derivatives.references, np.uint32),
            derivative_orders=self._array(derivatives.orders, np.int32),
            position=self._array(derivatives.position, np.int64),
            form=self._array(derivatives.form, np.int64),
            slot=self._array(derivatives.slot, np.int64),
            slope=self._array(np.zeros(len(derivatives.references)), np.float64),
            halfway=turn.halfway,
            moving=len(turn.moving),
            moving_references=self._array(turn.moving_references, np.uint32),
            moving_orders=self._array(np.ones(len(turn.moving)), np.int32),
            moving_position=self._array(turn.moving, np.int64),
            moving_slope=self._array(np.zeros(len(turn.moving)), np.float64),
            outputs=len(outputs.names),
            offset=outputs.offset,
            owned=outputs.slots.stop - outputs.slots.start,
            output_groups=len(outputs.groups),
            output_derivatives=len(outputs.derivative_references),
            output_group=self._groups(outputs.groups),
            output_derivative_references=self._array(outputs.derivative_references, np.uint32),
            output_derivative_orders=self._array(outputs.derivative_orders, np.int32),
            **self._differences(outputs.differences),
        )

    def _differences(self, differences: Differences | None) -> dict[str, int]:
        if differences is None:
            return {}
        slots = {"value": differences.value, "slope": differences.slope, "before": differences.before}
        arrays = {f"difference_{name}": self._array(array, np.int64) for name, array in slots.items()}
        return {"differences": len(differences.value), "step_slot": differences.step, **arrays}
