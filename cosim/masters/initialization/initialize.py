"""Exact initialization, the same for every master.

In initialization mode inputs are set and outputs read in the order of InitialUnknowns, again and again, until no bit
changes. Algebraic loops are solved (masters/algebraic_loop.py).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from cosim.arrays import FloatArray
from cosim.errors import AlgebraicLoop, CallFailed, InitializationFailed
from cosim.masters.algebraic_loop import Loop, same_bits
from cosim.masters.calls import Assignment, assign, assignments, read_groups
from cosim.masters.initialization import slopes
from cosim.masters.initialization.slopes import Asked
from cosim.masters.initialization.values import Values
from cosim.masters.layout import ComponentLayout, Layout, Reading
from cosim.masters.point import Point
from cosim.slaves import breadcrumb
from cosim.slaves.slave import Slave
from cosim.system import graph
from cosim.system.wiring import Port, Wiring
from fmus.description.annotations import COMMIT_SHOWN, INPUTS_REFUSED
from fmus.description.description import Scalar, ScalarVariable

Settings = Mapping[str, Sequence[Assignment]]
"""Instance -> its variables, each with its value."""


@dataclass(frozen=True)
class Initialization:
    """What is set before initialization mode and at its start, and in which order outputs are evaluated in it."""

    layout: Layout
    settings: Settings
    held: Settings
    parts: tuple[tuple[Reading, ...] | Loop, ...]
    slopes: tuple[Asked, ...] = ()

    @classmethod
    def of(cls, wiring: Wiring, layout: Layout) -> "Initialization":
        """Order the outputs of a wiring, its timings those that are flown."""
        evaluations = graph.initialization_order(wiring)
        parts: list[tuple[Reading, ...] | Loop] = []
        for e in evaluations:
            readings = layout.readings(wiring, e.outputs)
            parts.append(Loop(readings, graph.loop_path(wiring, e.outputs, initial=True)) if e.loop else readings)
        return cls(
            layout, _settings(wiring), _by_component(wiring, wiring.held), tuple(parts), slopes.asked(wiring, layout)
        )

    def with_settings(self, wiring: Wiring) -> "Initialization":
        """Return the same with the settings of a wiring that differs in nothing else."""
        return replace(self, settings=_settings(wiring))

    def start(
        self, slaves: Mapping[str, Slave], t: float, tolerance: float | None = None, stop: float | None = None
    ) -> Point:
        """Bring fresh slaves to the first communication point, at `t` s, and return it.

        `tolerance`: relative, None: each FMU's own of its DefaultExperiment. `stop`: a stop time to announce, s. Raises
        `InitializationFailed` (an FMU refused, an output is not finite), `AlgebraicLoop`, `ValueRefused`.
        """
        breadcrumb.here().time = t
        point = Point.start(self.layout)
        values = Values(self.layout, slaves, point, t)
        try:
            self._enter(slaves, t, tolerance, stop)
            self._settle(values)
            for place in range(len(self.layout.components)):
                values.set_inputs(place)
            for slave in slaves.values():
                _leave(slave)
            self._read(slaves, point, t)
        except CallFailed as error:
            raise self._refusal(values, slaves, error) from error
        self.layout.show_inputs(point.values)
        point.newest[:] = point.values
        return point

    def _enter(self, slaves: Mapping[str, Slave], t: float, tolerance: float | None, stop: float | None) -> None:
        for name, slave in slaves.items():
            slave.instantiate()
            own = slave.description.default_experiment.tolerance
            slave.setup_experiment(t, own if tolerance is None else tolerance, stop)
            # after it: an FMU may set its own start values there
            assign(slave, self.settings.get(name, ()))
        for slave in slaves.values():
            slave.enter_initialization_mode()
        for name, values in self.held.items():
            assign(slaves[name], values)

    def _settle(self, values: Values) -> None:
        """Sweep until no bit changes; n parts need at most n + 2 sweeps even where InitialUnknowns are wrong."""
        parts = [Round(values, part) if isinstance(part, Loop) else Chain(values, part) for part in self.parts]
        before = values.values.copy()
        for _ in range(len(parts) + 3):
            before, known = values.values.copy(), values.known.copy()
            for part in parts:
                part.evaluate()
            if same_bits(values.values, before) and (values.known == known).all():
                return
        changed = np.flatnonzero(values.values != before)
        changing = [str(port) for port, slot in self.layout.slots.items() if slot in changed]
        raise AlgebraicLoop(changing, "these values never settle, though InitialUnknowns show no loop")

    def _read(self, slaves: Mapping[str, Slave], point: Point, t: float) -> None:
        for c in self.layout.components:
            slave, outputs = slaves[c.name], c.outputs
            read_groups(slave, outputs.groups, point.values, point.texts)
            if not np.isfinite(point.values[outputs.finite]).all():
                raise _not_finite(c, point.values, slave)
            if outputs.differences is not None:
                outputs.differences.forget(point.values)
            for passage in outputs.passages:
                passage.show(point.values, t)
        outputs = {c.name: c.outputs for c in self.layout.components}
        for asked in self.slopes:
            slopes.read(asked, slaves[asked.component], point.values)
            for passage in outputs[asked.component].passages:
                passage.show(point.values, t)

    def _refusal(self, values: Values, slaves: Mapping[str, Slave], error: CallFailed) -> InitializationFailed:
        """Return what failed; where a value that is not finite was passed on, the words of the component that made it.

        Its parameters may be the reason, of which an FMU speaks when initialization mode ends; before, only its
        neighbour has refused the number.
        """
        for c in self.layout.components if error.function == "fmi2SetReal" else ():
            if not np.isfinite(values.values[c.outputs.finite]).all():
                try:
                    _leave(slaves[c.name])
                except CallFailed as reason:
                    error = reason
                    break
                return _not_finite(c, values.values, slaves[c.name])
        return InitializationFailed(error.component, error.what, error.messages)


def _leave(slave: Slave) -> None:
    """End initialization mode; raises `CallFailed` where an FMU waits for other inputs, too: there are no others."""
    slave.exit_initialization_mode()
    said = [message for message in slave.messages if INPUTS_REFUSED not in message]
    if len(said) < len(slave.messages):
        raise CallFailed(slave.name, "fmi2ExitInitializationMode", "fmi2Warning", tuple(said))


def _settings(wiring: Wiring) -> Settings:
    """Return what is set before initialization, and in our sampled FMUs which inputs a step takes (COMMIT_SHOWN)."""
    shown = {
        Port(name, COMMIT_SHOWN): 1.0
        for name, description in wiring.descriptions.items()
        if description.sampled and any(link.timing != "at_point" for link in wiring.into(name))
    }
    return _by_component(wiring, {**wiring.settings, **shown})


def _by_component(wiring: Wiring, values: Mapping[Port, Scalar]) -> Settings:
    found: dict[str, list[tuple[ScalarVariable, Scalar]]] = {}
    for port, value in values.items():
        found.setdefault(port.component, []).append((wiring.variable(port), value))
    return {name: assignments(pairs) for name, pairs in found.items()}


def _not_finite(c: ComponentLayout, values: FloatArray, slave: Slave) -> InitializationFailed:
    slot = next(slot for slot in c.outputs.finite if not np.isfinite(values[slot]))
    name = c.outputs.names[slot - c.outputs.offset]
    return InitializationFailed(c.name, f"{name} is {values[slot]} at the start", tuple(slave.messages))


class Chain:
    """Outputs of one component that depend on none of their own."""

    def __init__(self, values: Values, readings: tuple[Reading, ...]) -> None:
        self.values, self.readings = values, readings

    def evaluate(self) -> None:
        """Set the inputs, read the outputs."""
        for reading in self.readings:
            self.values.set_inputs(reading.component)
            self.values.store(reading)


class Round:
    """Outputs of an algebraic loop."""

    def __init__(self, values: Values, loop: Loop) -> None:
        self.values, self.loop, self.solved = values, loop, False

    def evaluate(self) -> None:
        """Solve the loop, starting from the values known or the FMUs' start values; raises `AlgebraicLoop`."""
        if not self.values.known[self.loop.slots].all():
            for reading in self.loop.readings:
                self.values.set_inputs(reading.component)
                self.values.store(reading)
        if not (self.solved and self.loop.fits(self.values)):
            self.solved = self.loop.solve(self.values)
