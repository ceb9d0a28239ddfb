"""Events: tunable parameters that change at given times, checked and in the variables' own units.

A parameter may change if its FMU says that it is tunable (variability, FMI 2.0 section 2.2.7), and if a master can let
it at that time: an instance with its own, slower rate only where one of its steps ends, and a time within a
communication step only where every FMU can take the two parts of that step.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any

from cosim.errors import EventError, SimulationError
from cosim.system.parameters import Parameters
from cosim.system.system import At, System
from cosim.system.wiring import Port, Wiring
from cosim.time import Schedule, exact_seconds, written
from fmus.description.description import Scalar
from fmus.description.names import split_element


@dataclass(frozen=True)
class Change:
    """What changes at a communication point, at `time` s."""

    point: int
    time: float
    values: Mapping[Port, Scalar]

    def told(self, wiring: Wiring) -> dict[str, Any]:
        """Return what run.json says of it."""
        units = {port: wiring.variable(port).unit for port in self.values}
        return {
            "time": self.time,
            "values": {str(port): {"value": v, "unit": units[port]} for port, v in self.values.items()},
        }


def resolve(
    wiring: Wiring, system: System, schedule: Schedule, events: Sequence[At]
) -> tuple[tuple[Change, ...], list[SimulationError]]:
    """Return the changes of some events in the order of their times, those of one time together, and all mistakes."""
    mistakes: list[SimulationError] = []
    found: dict[Fraction, dict[Port, Scalar]] = {}
    for event in events:
        time = exact_seconds(event.time, "the time of an event")
        at = found.setdefault(time, {})
        values = _values(wiring, system, event, time, mistakes)
        mistakes += _fixed(wiring, values, time)
        for port, value in values.items():
            before = at.setdefault(port, value)
            if before != value:
                problem = f"{port} is set twice, to {before} and to {value}"
                mistakes.append(EventError(written(time), problem, "Leave one of them out."))
    changes: list[Change] = []
    for (time, values), point in zip(sorted(found.items()), schedule.event_points, strict=True):
        changes.append(Change(point, schedule.time(point), values))
        mistakes += _between_steps(wiring, schedule, changes[-1], time)
    return tuple(changes), mistakes


def _values(
    wiring: Wiring, system: System, event: At, time: Fraction, mistakes: list[SimulationError]
) -> dict[Port, Scalar]:
    """Return what an event sets, by single variables."""
    alone = replace(system, parameters=event.values, vehicle={}, held={})
    parameters = Parameters(alone, wiring.fmus)
    values = parameters.settings()
    mistakes += [EventError(written(time), str(mistake).rstrip(".")) for mistake in parameters.mistakes]
    if not event.values:
        mistakes.append(EventError(written(time), "it changes nothing", 'Write At(50, {"controller.kp": 30}).'))
    return values


def _fixed(wiring: Wiring, values: Mapping[Port, Scalar], time: Fraction) -> Iterator[EventError]:
    """Find what cannot change after the start, whole arrays at a time."""
    for component, name in dict.fromkeys((p.component, split_element(p.variable)[0]) for p in values):
        description = wiring.descriptions[component]
        port = next(p for p in values if (p.component, split_element(p.variable)[0]) == (component, name))
        variable = wiring.variable(port)
        if variable.causality == "parameter" and variable.variability == "tunable":
            continue
        kinds = {"parameter": f"a {variable.variability} parameter", "structuralParameter": "a structural parameter"}
        kind = kinds.get(variable.causality, "an initial state")
        tunable = [
            base
            for base, g in description.groups.items()
            if (v := description.variables[g.elements[0]]).causality == "parameter" and v.variability == "tunable"
        ]
        problem = f"{component}.{name} is {kind}, which cannot change after the start"
        yield EventError(written(time), problem, f"Tunable in {component}: {', '.join(tunable) or 'none'}.")


def _between_steps(wiring: Wiring, schedule: Schedule, change: Change, time: Fraction) -> Iterator[EventError]:
    """Find what cannot be at the time of a change."""
    slow = {name: wiring.period(name) for name in wiring.fmus if wiring.period(name) > 1}
    step = schedule.step_size
    first = Fraction(schedule.start, schedule.denominator)
    if change.point in schedule.divided_at:
        below = first + (time - first) // step * step
        points = f"{written(below)} or {written(below + step)}"
        where = f"it lies between the communication points {written(below)} and {written(below + step)}"
        for name, description in wiring.fmus.items():
            if not description.can_handle_variable_step:
                problem = f"{where}, and {name} needs a constant step (canHandleVariableCommunicationStepSize=false)"
                yield EventError(written(time), problem, f"Choose {points}.")
        for name, period in slow.items():
            problem = f"{where}, and {name} takes {period} of these steps in one, which cannot be divided"
            yield EventError(written(time), problem, f"Choose {points}.")
        return
    for name in dict.fromkeys(port.component for port in change.values):
        period = slow.get(name, 1)
        if ((time - first) / step) % period:
            own = step * period
            below = first + (time - first) // own * own
            problem = f"{name} is within a step of its own then, from {written(below)} to {written(below + own)}"
            yield EventError(written(time), problem, f"Choose {written(below)} or {written(below + own)}.")
