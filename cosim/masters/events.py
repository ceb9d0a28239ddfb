"""Changes in a run, each at a communication point: of parameters, and of what faults do (faults.py).

From there on the run goes on as from a new start. At the point, before the next step: the parameters are set, the
faults that begin are in force and those that end are not; the outputs are evaluated again, in the order of direct
feedthrough, as initialization does it, where FMUs allow that (`refresh`); slopes are asked for anew, and what has been
made of points before (differences, predictions, lengths of steps) is forgotten. So the next step begins with what holds
after the change, and the point's row shows that: values from the right.

The outputs of other FMUs stay what they were at the end of the step before until their next one, and so do those of
frozen ones.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from cosim.errors import AlgebraicLoop, CallFailed, EventError
from cosim.masters.algebraic_loop import Loop
from cosim.masters.calls import Assignment, assign, assignments
from cosim.masters.faults import freeze
from cosim.masters.initialization import slopes
from cosim.masters.initialization.initialize import Chain, Round
from cosim.masters.initialization.slopes import Asked
from cosim.masters.initialization.values import Values
from cosim.masters.layout import Layout, Reading
from cosim.masters.point import Point
from cosim.slaves.slave import Slave
from cosim.system import graph
from cosim.system.events import Change
from cosim.system.wiring import Wiring


@dataclass(frozen=True)
class Plan:
    """The changes of a run in their order, and what is evaluated again after each, in that order."""

    layout: Layout
    changes: tuple[Change, ...]
    settings: tuple[Mapping[str, Sequence[Assignment]], ...]
    parts: tuple[tuple[Reading, ...] | Loop, ...]
    slopes: tuple[Asked, ...]
    periods: Mapping[str, int]

    @classmethod
    def of(cls, wiring: Wiring, layout: Layout, changes: tuple[Change, ...]) -> "Plan":
        """Work out the calls of the changes for a wiring, its timings those that are flown."""
        if not changes:
            return cls(layout, (), (), (), (), {})
        parts: list[tuple[Reading, ...] | Loop] = []
        for e in graph.evaluation_order(wiring):
            can = tuple(port for port in e.outputs if graph.can_refresh(wiring, port.component))
            readings = layout.readings(wiring, can)
            if e.loop and len(can) == len(e.outputs):
                parts.append(Loop(readings, graph.loop_path(wiring, e.outputs, initial=False)))
            elif readings:
                parts.append(readings)
        settings = tuple(_settings(wiring, change) for change in changes)
        periods = {name: wiring.period(name) for name in wiring.components}
        return cls(layout, changes, settings, tuple(parts), slopes.asked(wiring, layout), periods)


class Events:
    """The changes of one flight, over its instances."""

    def __init__(self, plan: Plan, slaves: Mapping[str, Slave]) -> None:
        self._plan, self._slaves = plan, slaves
        self._next = 0

    def last(self, end: int) -> int:
        """Return the communication point that may be gone to: where the next change waits, else the end."""
        waiting = self._plan.changes[self._next :]
        return waiting[0].point if waiting else end

    def due(self, point: Point) -> bool:
        """Whether a change waits at a point."""
        return self.last(-1) == point.index

    def memory(self) -> Any:
        """Return how many changes have happened; see `Part`."""
        return self._next

    def recall(self, memory: Any) -> None:
        """Let so many have happened: the FMUs have them in their states."""
        self._next = memory

    def apply(self, point: Point) -> Point:
        """Change what is due at a point, and return it as it is then; raises `EventError`."""
        change, settings = self._plan.changes[self._next], self._plan.settings[self._next]
        self._next += 1
        here = replace(point.copy(), memory=np.zeros(0), texts=point.texts)  # which the recorder reads
        try:
            for name, groups in settings.items():
                assign(self._slaves[name], groups)
            self._fail(here, change)
            self._evaluate(here, change)
        except CallFailed as error:
            what = ", ".join(f"{port} = {value}" for port, value in change.values.items()) or "a fault"
            raise EventError(
                f"{change.time:.12g} s", f"{what} was refused: {error}", component=error.component
            ) from error
        except AlgebraicLoop as error:
            error.time = change.time
            raise
        return here

    def _fail(self, here: Point, change: Change) -> None:
        """Put in force what faults change at the point."""
        layout, values = self._plan.layout, here.values
        for target, passing in change.passing.items():
            layout.passages[target].change(values, passing.settings, passing.stuck)
        for c in layout.components:
            if c.name in change.frozen:
                freeze(values, c.outputs.freeze, *change.frozen[c.name])
                if c.outputs.frozen(values):
                    still = [c.outputs.differences.slope] if c.outputs.differences else []
                    for slots in (c.outputs.derivatives, *still):
                        values[slots] = 0.0

    def _evaluate(self, here: Point, change: Change) -> None:
        """Evaluate again what stands at the point; a slower component may be ahead of it, a frozen one stays."""
        plan, values = self._plan, Values(self._plan.layout, self._slaves, here, change.time)
        values.known[:] = True
        components = plan.layout.components
        standing = [place for place, c in enumerate(components) if here.index % plan.periods[c.name] == 0]
        moving = [place for place in standing if not components[place].outputs.frozen(here.values)]
        self._show(here, standing, change.time)
        for part in plan.parts:
            if isinstance(part, Loop):
                if (loop := part.part(moving)).readings:
                    Round(values, loop).evaluate()
            else:
                Chain(values, tuple(r for r in part if r.component in moving)).evaluate()
        names = {components[place].name for place in moving}
        for asked in plan.slopes:
            if asked.component in names:
                slopes.read(asked, self._slaves[asked.component], here.values)
                self._show(here, standing, change.time)
        for c in (components[place] for place in moving):
            if c.outputs.differences is not None:
                c.outputs.differences.forget(here.values)
        self._show(here, standing, change.time)
        for c in (components[place] for place in standing):
            here.newest[c.outputs.slots] = here.values[c.outputs.slots]
        plan.layout.show_inputs(here.values)

    def _show(self, here: Point, places: Sequence[int], t: float) -> None:
        """Let faults act on what components have at the point."""
        for place in places:
            for passage in self._plan.layout.components[place].outputs.passages:
                passage.show(here.values, t)


def _settings(wiring: Wiring, change: Change) -> Mapping[str, Sequence[Assignment]]:
    names = dict.fromkeys(port.component for port in change.values)
    return {
        name: assignments((wiring.variable(p), v) for p, v in change.values.items() if p.component == name)
        for name in names
    }
