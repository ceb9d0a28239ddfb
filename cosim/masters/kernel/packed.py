"""The turns of a run put into the structures of the kernel: where each value comes from and goes to is an address."""

import ctypes
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from cosim.arrays import BoolArray, FloatArray, IntArray
from cosim.masters.faults import Passage
from cosim.masters.implicit.plan import Loop, Plan
from cosim.masters.kernel import unrolled
from cosim.masters.kernel.kept import Kept
from cosim.masters.kernel.structures import (
    CALLS,
    FUNCTIONS,
    AllowedStructure,
    ComponentStructure,
    GroupStructure,
    LoopStructure,
    PassageStructure,
    PassStructure,
    ReadingStructure,
    RunStructure,
    WaveStructure,
)
from cosim.masters.kernel.waves import together, wave_structure
from cosim.masters.layout import Group, Inputs, Reading
from cosim.masters.slopes import Differences
from cosim.masters.turns import (
    AFTER_STEP,
    AT_POINT,
    EXTRAPOLATED_MEAN,
    MEAN,
    MIDPOINT,
    SIGNAL,
    SIGNAL_MEAN,
    STEP_MEAN,
    Turn,
    Turns,
)
from cosim.masters.types import Kind
from cosim.slaves.slave import CInterface


class Packed:
    """Turns in C structures; keeps every array alive that they point to.

    `point`, `newest`, `next` and `begun` are the arrays that the kernel works on. `warned` has for each turn, call and
    kind how often it returned fmi2Warning, and in which communication step first. `plan`: of the iterated master.
    """

    def __init__(self, turns: Turns, instances: Sequence[CInterface], plan: Plan | None = None) -> None:
        self._kept = Kept()
        self.warned = np.zeros((len(turns.all), len(CALLS) + 1, len(Kind), 2), np.int64)
        self._given = [np.zeros(len(turn.component.inputs.links)) for turn in turns.all]
        layout, schedule, columns = turns.layout, turns.schedule, turns.layout.columns
        self.point, self.newest, self.next = (np.zeros(layout.size) for _ in range(3))
        self.begun = np.zeros((2, len(layout.inputs.links)))
        self._all_step = all(turn.period == 1 for turn in turns.all)
        parts = zip(turns.all, instances, self._given, self.warned, strict=True)
        components = [self._component(*part) for part in parts]
        again = [r for r in turns.refresh if isinstance(r, Reading)]  # turns with loops do not fly in it
        places = [turns.turn_of(reading) for reading in again]
        readings = [self._reading(r, place, turns.all[place]) for r, place in zip(again, places, strict=True)]
        passes = [self._turn(*part) for part in enumerate(components)]
        passes += [self._again(reading, components[reading.component]) for reading in readings]
        for place in set_already(turns, again, places):
            passes[place].kept = not passes[place].slopes
        even = self._all_step and not schedule.dividing and plan is None
        straight = even and all(each.straight and not each.slopes for each in passes)
        waves = list(together(passes)) if straight else []
        inputs, addresses = layout.inputs, (self.point.ctypes.data, self.newest.ctypes.data)
        self.run = RunStructure(
            **{name: getattr(schedule, name) for name in ("start", "stop", "step", "denominator", "every", "steps")},
            divisions=len(schedule.dividing),
            events=len(schedule.events),
            divided_at=self._kept.array(schedule.divided_at, np.int64),
            dividing=self._kept.array(schedule.dividing, np.int64),
            event_point=self._kept.array(schedule.event_points, np.int64),
            components=len(turns.all),
            component=self._kept.structures(ComponentStructure, components),
            passes=len(passes),
            first_pass=self._kept.structures(PassStructure, passes),
            refreshes=len(readings),
            refresh=self._kept.structures(ReadingStructure, readings),
            size=layout.size,
            owned=layout.held,
            point=addresses[0],
            newest=addresses[1],
            next=self.next.ctypes.data,
            all_step=self._all_step,
            waves=len(waves),
            wave=self._kept.structures(WaveStructure, [wave_structure(wave, self._kept) for wave in waves]),
            unrolled=unrolled.function(waves, schedule.steps, *addresses, layout.held),
            inputs=len(inputs.links),
            input_slot=self._kept.array(inputs.slots, np.int64),
            input_source=self._kept.array(inputs.source, np.int64),
            input_factor=self._kept.array(inputs.factor, np.float64),
            input_addend=self._kept.array(inputs.addend, np.float64),
            columns=len(columns.names),
            column_slot=self._kept.array(columns.slots, np.int64),
            stop_slot=layout.stop_slot,
        )
        self.memory, self.memory_next = (np.zeros(plan.memory if plan else 0) for _ in range(2))
        if plan is not None:
            self._plan(plan)

    def _plan(self, plan: Plan) -> None:
        """Put the stages of the iterated master into the run."""
        run, loops = self.run, plan.loops
        stages = [-1 - loops.index(stage) if isinstance(stage, Loop) else stage for stage in plan.stages]
        run.stages, run.stage = len(stages), self._kept.array(stages, np.int64)
        run.loop = self._kept.structures(LoopStructure, [self._loop(loop) for loop in loops])
        run.memory_size = len(self.memory)

    def _loop(self, loop: Loop) -> LoopStructure:
        n = loop.size
        work = {name: self._kept.array(np.zeros(n), np.float64) for name in ("x", "residual", "change")}
        numbers = {
            name: self._kept.array(getattr(loop, name), np.int64) for name in ("slots", "value", "slope", "partner")
        }
        return LoopStructure(
            first=loop.turns[0],
            members=len(loop.turns),
            unknowns=n,
            values=len(loop.partner),
            memory=loop.memory.start,
            nominal=self._kept.array(loop.nominal, np.float64),
            matrix=self._kept.array(np.zeros(n * n), np.float64),
            **numbers,
            **work,
        )

    def given(self, turn: int, place: int) -> float:
        """Return what an input, by its place, was to be set to last."""
        return float(self._given[turn][place])

    def _wires(self, inputs: Inputs, values: FloatArray, newest: BoolArray, slots: IntArray) -> int:
        """Return the address of the wires of some inputs: from slots of `values`, of the newest ones where told so."""
        wires = np.empty((len(inputs.links), 3))  # as WireStructure has it
        begin = np.where(newest, self.newest.ctypes.data, values.ctypes.data)
        wires.view(np.int64)[:, 0] = begin + values.itemsize * slots
        wires[:, 1], wires[:, 2] = inputs.factor, inputs.addend
        return self._kept.array(wires, np.float64)

    def _groups(self, groups: Sequence[Group]) -> int:
        return self._kept.structures(GroupStructure, [self._group(group) for group in groups])

    def _group(self, group: Group) -> GroupStructure:
        n = len(group.references)
        consecutive = bool((np.diff(group.slots) == 1).all())
        return GroupStructure(
            kind=group.kind,
            count=n,
            references=self._kept.array(group.references, np.uint32),
            slots=self._kept.array(group.slots, np.int64),
            first=int(group.slots[0]) if consecutive else -1,
            finite=len(group.finite),
            finite_slot=self._kept.array(group.finite, np.int64),
            value=self._kept.array(np.zeros(n), np.float64),
            number=self._kept.array(np.zeros(n), np.int32) if group.kind in (Kind.INTEGER, Kind.BOOLEAN) else 0,
            text=self._kept.array(np.zeros(n), np.uintp) if group.kind == Kind.STRING else 0,
        )

    def _turn(self, place: int, c: ComponentStructure) -> PassStructure:
        """Return the step of a component as a pass, if it is straight."""
        groups = GroupStructure * c.output_groups
        found = self._pass(place, c, groups.from_address(c.output_group))
        found.straight = found.straight and not c.mixed
        found.wire, found.step = c.wire, c.do_step
        found.slopes = bool(c.input_derivatives or c.output_derivatives or c.differences)
        return found

    def _again(self, r: ReadingStructure, c: ComponentStructure) -> PassStructure:
        """Return a reading as a pass, if it is straight."""
        found = self._pass(r.component, c, (GroupStructure * r.groups).from_address(r.group))
        found.wire = r.wire
        found.slopes = r.slopes
        found.straight = found.straight and (r.slopes or not c.differences)
        return found

    def _pass(self, place: int, c: ComponentStructure, groups: Sequence[GroupStructure]) -> PassStructure:
        """Return what a turn and a reading of a component have in common, `straight` as far as that goes."""
        found = PassStructure(component=place, instance=c.instance, set=c.set_real, get=c.get_real, inputs=c.inputs)
        found.input_references, found.input = c.input_references, c.value
        faulty = c.held or c.passages or c.freeze >= 0
        found.straight = (c.only_real or not c.inputs) and not faulty
        for group in groups:
            found.straight = found.straight and len(groups) == 1 and group.kind == Kind.REAL and group.first >= 0
            found.outputs, found.output_references = group.count, group.references
            found.output = self.newest.ctypes.data + self.newest.itemsize * group.first
            slots = np.array((ctypes.c_longlong * group.finite).from_address(group.finite_slot))
            found.finite = group.finite
            found.finite_value = self._kept.array(self.newest.ctypes.data + self.newest.itemsize * slots, np.uintp)
        return found

    def _reading(self, reading: Reading, place: int, turn: Turn) -> ReadingStructure:
        inputs, mean = turn.component.inputs, turn.timing == STEP_MEAN
        return ReadingStructure(
            component=place,
            groups=len(reading.groups),
            slopes=reading.slopes,
            group=self._groups(reading.groups),
            wire=self._wires(inputs, self.newest if self._all_step else self.next, mean, inputs.source),
        )

    def _passage(self, passage: Passage) -> PassageStructure:
        numbers = {name: getattr(passage, name) for name in ("first", "source", "factor", "addend", "key")}
        slopes = self._kept.array(passage.slopes, np.int64)
        return PassageStructure(**numbers, slopes=len(passage.slopes), slope=slopes)

    def _allowed(self, inputs: Inputs) -> int:
        found = [
            AllowedStructure(position=i, count=len(values), values=self._kept.array(values, np.int64))
            for i, values in inputs.allowed.items()
        ]
        return self._kept.structures(AllowedStructure, found)

    def _component(
        self, turn: Turn, instance: CInterface, given: FloatArray, warned: NDArray[np.int64]
    ) -> ComponentStructure:
        inputs, outputs, derivatives = turn.component.inputs, turn.component.outputs, turn.derivatives
        n, timing = len(inputs.links), turn.timing
        in_step = turn.period == 1 and not turn.ahead.any()
        signal, late = np.isin(timing, (SIGNAL, SIGNAL_MEAN)), np.isin(timing, (AFTER_STEP, STEP_MEAN))
        mixed = np.flatnonzero(np.isin(timing, (MIDPOINT, MEAN, EXTRAPOLATED_MEAN)) if in_step else ~signal)
        return ComponentStructure(
            name=self._kept.array(bytearray(turn.component.name.encode() + b"\0"), np.uint8),
            warned=warned.ctypes.data,
            instance=instance.component,
            **{field: instance.functions.get(function, 0) for field, function in FUNCTIONS.items()},
            period=turn.period,
            at_end=turn.at_end,
            in_step=in_step,
            inputs=n,
            input_groups=len(inputs.groups),
            only_real=[group.kind for group in inputs.groups] == [Kind.REAL] and not inputs.allowed,
            input_references=self._kept.array(inputs.references, np.uint32),
            wire=self._wires(inputs, self.point, signal | late, np.where(signal, inputs.signal, inputs.source)),
            mixed=len(mixed),
            mixed_position=self._kept.array(mixed, np.int64),
            input_group=self._groups(inputs.groups),
            source=self._kept.array(inputs.source, np.int64),
            slope_slot=self._kept.array(inputs.slope, np.int64),
            timing=self._kept.array(timing, np.int64),
            ahead=self._kept.array(turn.ahead, np.int64),
            source_component=self._kept.array(turn.source_turn, np.int64),
            begun=self.begun[0, turn.begun].ctypes.data,
            begun_slope=self.begun[1, turn.begun].ctypes.data,
            value=given.ctypes.data,
            restricted=len(inputs.allowed),
            allowed=self._allowed(inputs),
            input_derivatives=len(derivatives.references),
            derivative_references=self._kept.array(derivatives.references, np.uint32),
            derivative_orders=self._kept.array(derivatives.orders, np.int32),
            position=self._kept.array(derivatives.position, np.int64),
            form=self._kept.array(derivatives.form, np.int64),
            slot=self._kept.array(derivatives.slot, np.int64),
            slope=self._kept.array(np.zeros(len(derivatives.references)), np.float64),
            halfway=turn.halfway,
            moving=len(turn.moving),
            moving_references=self._kept.array(turn.moving_references, np.uint32),
            moving_orders=self._kept.array(np.ones(len(turn.moving)), np.int32),
            moving_position=self._kept.array(turn.moving, np.int64),
            moving_slope=self._kept.array(np.zeros(len(turn.moving)), np.float64),
            outputs=len(outputs.names),
            offset=outputs.offset,
            owned=outputs.slots.stop - outputs.slots.start,
            output_groups=len(outputs.groups),
            output_derivatives=len(outputs.derivative_references),
            output_group=self._groups(outputs.groups),
            output_derivative_references=self._kept.array(outputs.derivative_references, np.uint32),
            output_derivative_orders=self._kept.array(outputs.derivative_orders, np.int32),
            held=self._kept.array(inputs.held, np.int64) if inputs.faulty.size else 0,
            passages=len(outputs.passages),
            freeze=outputs.freeze,
            passage=self._kept.structures(PassageStructure, [self._passage(passage) for passage in outputs.passages]),
            **self._differences(outputs.differences),
        )

    def _differences(self, differences: Differences | None) -> dict[str, int]:
        if differences is None:
            return {}
        slots = {"value": differences.value, "slope": differences.slope, "before": differences.before}
        arrays = {f"difference_{name}": self._kept.array(array, np.int64) for name, array in slots.items()}
        return {"differences": len(differences.value), "step_slot": differences.step, **arrays}


def set_already(turns: Turns, readings: Sequence[Reading], places: Sequence[int]) -> Iterator[int]:
    """Yield the turns whose inputs at the start of a step are those of the reading at the end of the step before.

    They show the communication point, at which nothing that they come from is read again after them. An FMU that is
    read again keeps its inputs: it is ours.
    """
    newer: set[int] = set()
    for reading, place in reversed([*zip(readings, places, strict=True)]):
        turn = turns.all[place]
        newer.update(slot for group in reading.groups for slot in group.slots.tolist())
        if (turn.timing == AT_POINT).all() and newer.isdisjoint(turn.component.inputs.source.tolist()):
            yield place
