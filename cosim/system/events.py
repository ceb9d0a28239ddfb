"""Events: tunable parameters that change at given times, checked and in the variables' own units.

A parameter may change if its FMU says that it is tunable (variability, FMI 2.0 section 2.2.7), and if a master can let
it at that time: an instance with its own, slower rate only where one of its steps ends, and a time within a
communication step only where every FMU can take the two parts of that step.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from typing import Any

from cosim.errors import EventError, SimulationError
from cosim.system.fault import Passing
from cosim.system.parameters import Parameters
from cosim.system.system import At, System
from cosim.system.wiring import Port, Wiring
from cosim.time import Schedule, exact_seconds, written
from fmus.description.description import Scalar
from fmus.description.names import split_element

Mistake = tuple[str, str]
"""Problem and advice."""


@dataclass(frozen=True)
class Change:
    """What changes at a communication point, at `time` s: parameters, and by faults connections, by their targets.

    `frozen`: of components whether they are from then on, and by how much their clocks are late, s.
    """

    point: int
    time: float
    values: Mapping[Port, Scalar]
    passing: Mapping[Port, Passing] = field(default_factory=dict[Port, Passing])
    frozen: Mapping[str, tuple[bool, float]] = field(default_factory=dict[str, tuple[bool, float]])

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
        values, wrong = values_of(wiring, system, event)
        mistakes += [EventError(written(time), problem, advice) for problem, advice in wrong]
        for port, value in values.items():
            before = at.setdefault(port, value)
            if before != value:
                problem = f"{port} is set twice, to {before} and to {value}"
                mistakes.append(EventError(written(time), problem, "Leave one of them out."))
    changes: list[Change] = []
    points = schedule.points_of_events
    for time, values in sorted(found.items()):
        changes.append(Change(points[time], schedule.time(points[time]), values))
        components = dict.fromkeys(port.component for port in values)
        mistakes += [EventError(written(time), *why) for why in between_steps(wiring, schedule, components, time)]
    return tuple(changes), mistakes


def values_of(wiring: Wiring, system: System, event: At) -> tuple[dict[Port, Scalar], list[Mistake]]:
    """Return what an event sets, by single variables, and what is wrong with it."""
    parameters = Parameters(replace(system, parameters=event.values, vehicle={}, held={}), wiring.fmus)
    values = parameters.settings()
    wrong = [(str(mistake).rstrip("."), "") for mistake in parameters.mistakes]
    if not event.values:
        wrong.append(("it changes nothing", 'Write At(50, {"controller.kp": 30}).'))
    return values, [*wrong, *_fixed(wiring, values)]


def _fixed(wiring: Wiring, values: Mapping[Port, Scalar]) -> Iterator[Mistake]:
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
        yield problem, f"Tunable in {component}: {', '.join(tunable) or 'none'}."


def between_steps(wiring: Wiring, schedule: Schedule, components: Iterable[str], time: Fraction) -> Iterator[Mistake]:
    """Find what keeps some components from a change at a time, which is a communication point."""
    slow = {name: wiring.period(name) for name in wiring.fmus if wiring.period(name) > 1}
    step = schedule.step_size
    first = Fraction(schedule.start, schedule.denominator)
    if schedule.points_of_events[time] in schedule.divided_at:
        below = first + (time - first) // step * step
        points = f"{written(below)} or {written(below + step)}"
        where = f"it lies between the communication points {written(below)} and {written(below + step)}"
        for name, description in wiring.fmus.items():
            if not description.can_handle_variable_step:
                problem = f"{where}, and {name} needs a constant step (canHandleVariableCommunicationStepSize=false)"
                yield problem, f"Choose {points}."
        for name, period in slow.items():
            problem = f"{where}, and {name} takes {period} of these steps in one, which cannot be divided"
            yield problem, f"Choose {points}."
        return
    for name in components:
        period = slow.get(name, 1)
        if ((time - first) / step) % period:
            own = step * period
            below = first + (time - first) // own * own
            problem = f"{name} is within a step of its own then, from {written(below)} to {written(below + own)}"
            yield problem, f"Choose {written(below)} or {written(below + own)}."
