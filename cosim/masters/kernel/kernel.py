"""The kernel as an algorithm: the explicit master's turns in C, many steps at a time, with rows, flag and clock."""

import ctypes
import weakref
from collections.abc import Mapping, Sequence
from weakref import WeakKeyDictionary

import numpy as np

from cosim.errors import CallFailed, NotSupported, SimulationError, StepFailed, status_name
from cosim.masters.calls import refusal
from cosim.masters.culprit import blame
from cosim.masters.implicit.plan import Plan
from cosim.masters.kernel.library import callable_by_kernel, library
from cosim.masters.kernel.packed import Packed
from cosim.masters.kernel.structures import CALLS, MEMORY, NOT_FINITE, REFUSED, STEP
from cosim.masters.master import Outcome
from cosim.masters.point import Point
from cosim.masters.steps import failed_step, not_finite
from cosim.masters.turns import Turns
from cosim.masters.types import Kind, Texts
from cosim.masters.watch import LOOK, Watch
from cosim.slaves import breadcrumb
from cosim.slaves.pending import STOP_IS_ASKED, TIME_IS_UP
from cosim.slaves.slave import CInterface, Slave, note_warnings

USUAL = {
    **{f"fmi2{verb}Real": f"fmi3{verb}Float64" for verb in ("Set", "Get")},
    **{f"fmi2{verb}Integer": f"fmi3{verb}Int32" for verb in ("Set", "Get")},
    **{f"fmi2{verb}{kind}": f"fmi3{verb}{kind}" for verb in ("Set", "Get") for kind in ("Boolean", "String")},
    "fmi2DoStep": "fmi3DoStep",
    "fmi2GetRealOutputDerivatives": "fmi3GetOutputDerivatives",
    "fmi2GetFMUstate": "fmi3GetFMUState",
    "fmi2SetFMUstate": "fmi3SetFMUState",
}
"""Functions that returned a warning, as FMI 3.0 calls them."""

_kept: "WeakKeyDictionary[Slave, tuple[Turns, list[int], Packed]]" = WeakKeyDictionary()
"""By the first slave of a crew: the turns that it flew last, packed. A crew flies one flight at a time."""


def _pack(turns: Turns, slaves: Sequence[Slave], instances: Sequence[CInterface], plan: Plan | None) -> Packed:
    """Return turns in C structures, those of the last flight where it was of the same turns and instances."""
    addresses = [instance.component for instance in instances]
    kept = _kept.get(slaves[0]) if slaves else None
    if kept is not None and kept[0] is turns and kept[1] == addresses:
        kept[2].run.failed_call = kept[2].run.ended = 0
        return kept[2]
    packed = Packed(turns, instances, plan)
    if slaves:
        _kept[slaves[0]] = turns, addresses, packed
    return packed


def _function(call: int, kind: int, version: str = "2.0") -> str:
    """Return the function of a call; of FMI 3.0 that of the kind's most usual type."""
    name = CALLS[call].format(kind=Kind(kind).name.title())
    return name if version == "2.0" else USUAL.get(name, name)


class Kernel:
    """`Stepping` bit for bit, over slaves that offer C interfaces (library.obstacle).

    With a `plan` and its `tolerance` it is `Iterating`, but for steps at which it is `stuck`: these are left to Python.
    """

    records = True

    def __init__(
        self,
        turns: Turns,
        slaves: Mapping[str, Slave],
        watch: Watch,
        plan: Plan | None = None,
        tolerance: float = 0.0,
    ) -> None:
        self.turns, self.watch = turns, watch
        self._named, self.slaves = slaves, [slaves[turn.component.name] for turn in turns.all]
        found = [slave.c_interface() for slave in self.slaves]
        instances = [callable_by_kernel(interface) for interface in found if isinstance(interface, CInterface)]
        self._packed, self._library = _pack(turns, self.slaves, instances, plan), library()
        self._texts = self._library.kernel_texts()
        self._free = weakref.finalize(self, self._library.kernel_free_texts, self._texts)
        self._numbered = 0
        run = self._packed.run
        run.texts, run.stop_asked = self._texts, ctypes.addressof(watch.stop)
        run.tolerance = tolerance
        run.pending_timeout = self.slaves[0].patience.timeout if self.slaves else 0.0
        self._failure: SimulationError | KeyboardInterrupt | None = None

    def advance(self, point: Point, until: int) -> Outcome:
        """Go towards `until` and write rows; see `Algorithm`. Raises `StepFailed`, `ValueRefused`."""
        if self._failure is not None:
            raise self._failure
        run, block = self._packed.run, self.watch.block
        self._put(point)
        here = breadcrumb.here()
        here.run = ctypes.addressof(run)
        refused = self._library.kernel_run(
            ctypes.byref(run),
            until,
            LOOK,
            block.columns.ctypes.data,
            len(block.data),
            block.stride,
            block.count_address,
        )
        here.run, here.time = None, self.turns.schedule.time(run.done)
        if refused:
            raise NotSupported("the kernel cannot count this run", 'Choose kernel="never".')
        self.watch.last_row = run.last_row
        self._note_warnings()
        if run.failed_call:
            self._failure = self._told()
            if isinstance(self._failure, StepFailed):
                blame(self._failure, self._named)
            if run.done == point.index:
                raise self._failure  # else at the next call: what was reached before it counts
        return Outcome(self._reached(point.texts), None, run.evaluations if run.stages else run.done - point.index)

    def attempt(self, point: Point, t: float, h: float) -> Outcome:
        """Take one iterated step of length h from t, s, without more ado; the point keeps its index.

        Where it is `stuck` the outcome is the point itself. Raises `StepFailed` where an instance cannot be used more.
        """
        run = self._packed.run
        self._put(point)
        here = breadcrumb.here()
        here.run = ctypes.addressof(run)
        failed = self._library.kernel_attempt(ctypes.byref(run), t, h)
        here.run = None
        self._note_warnings()
        if self.stuck:
            return Outcome(point, None, 0)
        if failed:
            failure = self._told()
            if isinstance(failure, StepFailed):
                failure.time, failure.step = t, h
            raise failure
        reached = self._reached(point.texts)
        self.turns.layout.show_inputs(reached.values)
        return Outcome(reached, None, run.evaluations)

    @property
    def stuck(self) -> bool:
        """Whether the next step takes more than the kernel can do."""
        return bool(self._packed.run.stuck)

    def _put(self, point: Point) -> None:
        """Copy a point into the kernel's arrays."""
        packed, run = self._packed, self._packed.run
        packed.point[:], packed.newest[:], packed.begun[:] = point.values, point.newest, point.begun
        packed.memory[:] = point.memory
        run.memory, run.memory_next = packed.memory.ctypes.data, packed.memory_next.ctypes.data
        run.done, run.last_row, run.evaluations, run.stuck = point.index, self.watch.last_row, 0, 0
        for text in point.texts.all()[self._numbered :]:
            if self._library.kernel_text_number(self._texts, text) < 0:
                raise MemoryError("no memory for the texts of the run")
        self._numbered = len(point.texts)

    def _reached(self, texts: Texts) -> Point:
        """Return the point that the kernel has reached."""
        packed, run = self._packed, self._packed.run
        memory = packed.memory if run.memory == packed.memory.ctypes.data else packed.memory_next
        for number in range(self._numbered, self._library.kernel_text_count(self._texts)):
            texts.number(self._library.kernel_text(self._texts, number))
        self._numbered = len(texts)
        newest, begun = packed.newest.copy(), packed.begun.copy()
        return Point(run.done, packed.point.copy(), newest, begun, texts, memory.copy())

    def _note_warnings(self) -> None:
        """Tell the slaves of their calls that returned fmi2Warning."""
        warned = self._packed.warned
        if not warned.any():
            return
        for turn, call, kind in np.argwhere(warned[..., 0]).tolist():
            count, first = warned[turn, call, kind].tolist()
            function = _function(call, kind, self.slaves[turn].description.fmi_version)
            note_warnings(self.slaves[turn].warned, function, count, self.turns.schedule.time(first))
        warned[:] = 0

    def _told(self) -> SimulationError | KeyboardInterrupt:
        """Return what the Python loop would raise for the call that failed."""
        run, schedule = self._packed.run, self.turns.schedule
        turn, slave = self.turns.all[run.failed_component], self.slaves[run.failed_component]
        t = schedule.time(turn.start(run.done))
        h = schedule.time(turn.end(run.done, schedule)) - t
        if run.failed_call == MEMORY:
            raise MemoryError("no memory for the texts of the run")
        if run.failed_call == NOT_FINITE:
            return not_finite(turn, slave, t, h, run.failed_slot, float(self._packed.newest[run.failed_slot]))
        if run.failed_call == REFUSED:
            given = self._packed.given(run.failed_component, run.failed_slot)
            return refusal(turn.component.inputs, run.failed_slot, given, t + h if run.failed_kind else t)
        said = slave.failed(run.failed_status)
        function = said.function or _function(run.failed_call, run.failed_kind)
        if run.failed_call == STEP and run.failed_slot == STOP_IS_ASKED:
            return KeyboardInterrupt()
        waited = slave.patience.timeout if run.failed_call == STEP and run.failed_slot == TIME_IS_UP else None
        status = said.status or status_name(run.failed_status)
        messages = (*slave.messages, said.line) if said.line else tuple(slave.messages)
        told = said.last_successful_time, said.terminated
        return failed_step(CallFailed(turn.component.name, function, status, messages, *told, waited), t, h)
