"""What faults begin and end, at which communication point; that, and all mistakes, from an experiment and a wiring.

Every begin and every end is a communication point, as the time of an event is, so that no step passes over one.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction

from cosim.errors import SimulationError, UnknownName, WiringErrors
from cosim.system.events import Change, between_steps, values_of
from cosim.system.fault import Fault, FaultError, Passing
from cosim.system.passing import NEUTRAL, acting, refuse_value
from cosim.system.system import At, Experiment, System
from cosim.system.wiring import Faulty, Port, Wiring
from cosim.time import Schedule, exact_seconds, written
from fmus.description.description import Scalar

HOLDING = ("stuck", "dropout")


def times(experiment: Experiment, system: str) -> list[Fraction]:
    """Return when faults begin and end within a flight, s; raises `WiringErrors` for times outside it."""
    start = exact_seconds(experiment.start_time, "start_time")
    stop = exact_seconds(experiment.stop_time, "stop_time")
    flight = f"the flight is from {written(start)} to {written(stop)}"
    found: list[Fraction] = []
    mistakes: list[SimulationError] = []
    for fault in experiment.faults:
        begin, end = fault.begins, fault.ends
        if not start <= begin < stop:
            problem, advice = f"it begins at {written(begin)}, {flight}", "Choose a time in it, before its end."
            mistakes.append(FaultError(str(fault), problem, advice))
        if end is not None and end <= begin:
            problem = f"it ends at {written(end)}, and begins at {written(begin)}"
            mistakes.append(FaultError(str(fault), problem, "Let it end later."))
        elif end is not None and end > stop:
            mistakes.append(FaultError(str(fault), f"it ends at {written(end)}, {flight}", "Leave out its end."))
        found += [begin] if end is None or end >= stop else [begin, end]
    if mistakes:
        raise WiringErrors(system, mistakes)
    return found


@dataclass
class _At:
    """What faults change at one time."""

    values: dict[Port, Scalar] = field(default_factory=dict[Port, Scalar])
    passing: dict[Port, Passing] = field(default_factory=dict[Port, Passing])
    frozen: dict[str, tuple[bool, float]] = field(default_factory=dict[str, tuple[bool, float]])

    def components(self, wiring: Wiring) -> list[str]:
        """Return the components at whose ends of steps this can be."""
        links = [link for link in wiring.links if link.target in self.passing]
        ends = [port.component for link in links for port in (link.source, link.target)]
        return list(dict.fromkeys([*ends, *(port.component for port in self.values), *self.frozen]))


class Onsets:
    """Resolves the faults of a flight; every mistake is put into `mistakes` instead of raised.

    `changes`: those of its events, whose times and those of the faults are the events of the schedule.
    """

    def __init__(
        self,
        wiring: Wiring,
        system: System,
        schedule: Schedule,
        faults: Sequence[Fault],
        changes: Sequence[Change],
    ) -> None:
        self.mistakes: list[SimulationError] = []
        self._wiring, self._system, self._schedule = wiring, system, schedule
        self._changes = {self._time(change): change for change in changes}
        self._at: dict[Fraction, _At] = {}
        self._faulty: dict[Port, Faulty] = {}
        self._met: dict[object, list[Fault]] = {}
        self._accepted: list[Fault] = []
        self._frozen: dict[str, list[Fault]] = {}
        for fault in sorted(faults, key=lambda fault: fault.begins):  # of two, one that ends comes first
            try:
                self._add(fault)
            except (FaultError, UnknownName) as mistake:
                self.mistakes.append(mistake)
        for name, mine in self._frozen.items():
            self._freeze(name, mine)
        self._between_steps()

    @property
    def wiring(self) -> Wiring:
        """The wiring with what faults need in a flight."""
        return replace(self._wiring, faulty=self._faulty, freezing=frozenset(self._frozen))

    @property
    def changes(self) -> tuple[Change, ...]:
        """What changes at each time, by events and by faults."""
        points = self._schedule.points_of_events
        found: list[Change] = []
        for time in sorted({*self._changes, *self._at}):
            at = self._at.get(time, _At())
            given = self._changes.get(time, Change(points[time], self._schedule.time(points[time]), {}))
            found.append(replace(given, values={**at.values, **given.values}, passing=at.passing, frozen=at.frozen))
        return tuple(found)

    def _time(self, change: Change) -> Fraction:
        return next(time for time, point in self._schedule.points_of_events.items() if point == change.point)

    def _add(self, fault: Fault) -> None:
        if fault.kind == "freeze":
            refuse_value(fault)
            if fault.on not in self._wiring.fmus:
                raise UnknownName("component", fault.on, f"fault {fault}", list(self._wiring.fmus))
            self._refuse_meeting(fault, fault.on, fault.on)
            self._frozen.setdefault(fault.on, []).append(fault)
        elif fault.kind == "parameter":
            self._set(fault)
        else:
            self._pass(fault)

    def _refuse_meeting(self, fault: Fault, key: object, what: str) -> None:
        """Refuse a fault that is there together with one of the same meaning."""
        for other in self._met.setdefault(key, []):
            if fault.meets(other):
                problem = f"{what} has another one at that time, {other}"
                raise FaultError(str(fault), problem, f"Let one end where the other begins{_until(other)}.")
        self._met[key].append(fault)
        if fault not in self._accepted:
            self._accepted.append(fault)

    def _pass(self, fault: Fault) -> None:
        for act in acting(self._wiring, self._system, fault):
            target = act.link.target
            self._refuse_meeting(fault, (target, "hold" if fault.kind in HOLDING else fault.kind), str(target))
            if fault.kind == "delay" and self._schedule.dividing:
                there = written(Fraction(self._schedule.dividing[0], self._schedule.denominator))
                problem = f"it counts steps, and one is divided at {there}"
                raise FaultError(str(fault), problem, "Let all faults and events be at communication points.")
            known = self._faulty.get(target, Faulty(frozenset(), 0))
            longest = max(known.longest, int(act.begin.settings.get("steps", 0)))
            self._faulty[target] = Faulty(known.kinds | {fault.kind}, longest)
            self._put(target, fault.begins, act.begin)
            self._put(target, self._end(fault), Passing(NEUTRAL[fault.kind]))

    def _put(self, target: Port, time: Fraction | None, passing: Passing) -> None:
        """Change a connection at a time; what begins there comes after what ends there, and counts."""
        if time is None:
            return
        at = self._at.setdefault(time, _At()).passing
        before = at.get(target, Passing({}))
        stuck = before.stuck if passing.stuck is None else passing.stuck
        at[target] = Passing({**before.settings, **passing.settings}, stuck)

    def _set(self, fault: Fault) -> None:
        if fault.value is None:
            raise FaultError(str(fault), "it has no value", "Give it a value.")
        values, wrong = values_of(self._wiring, self._system, At(fault.start, {fault.on: fault.value}))
        for problem, advice in wrong:
            raise FaultError(str(fault), problem, advice)
        for port, value in values.items():
            self._refuse_meeting(fault, port, str(port))
            self._at.setdefault(fault.begins, _At()).values[port] = value
            end = self._end(fault)
            before = self._before(fault, port)
            if end is None:
                continue
            if before is None:
                problem = f"what {port} was before is not known (its FMU gives no start value)"
                raise FaultError(str(fault), problem, "Leave out its end, and set it by an event.")
            self._at.setdefault(end, _At()).values[port] = before

    def _before(self, fault: Fault, port: Port) -> Scalar | None:
        """Return what a parameter is before a fault; refuse events that set it while that is there."""
        found = self._wiring.settings.get(port, self._wiring.variable(port).start)
        for time, change in self._changes.items():
            if port not in change.values:
                continue
            if time < fault.begins:
                found = change.values[port]
            elif fault.ends is None or time < fault.ends:
                problem = f"an event sets {port} at {written(time)}, while it is there"
                raise FaultError(str(fault), problem, "Leave out one of them.")
        return found

    def _freeze(self, name: str, mine: Iterable[Fault]) -> None:
        late = Fraction(0)
        for fault in mine:
            self._at.setdefault(fault.begins, _At()).frozen[name] = (True, float(late))
            end = self._end(fault)
            if end is not None:
                late += end - fault.begins
                self._at.setdefault(end, _At()).frozen[name] = (False, float(late))

    def _end(self, fault: Fault) -> Fraction | None:
        """Return when a fault ends within the flight, None: it does not."""
        end, stop = fault.ends, Fraction(self._schedule.stop, self._schedule.denominator)
        return None if end is None or end >= stop else end

    def _between_steps(self) -> None:
        for time, at in self._at.items():
            names = ", ".join(str(fault) for fault in self._accepted if time in (fault.begins, fault.ends))
            wrong = between_steps(self._wiring, self._schedule, at.components(self._wiring), time)
            self.mistakes += [FaultError(names, f"at {written(time)} {problem}", advice) for problem, advice in wrong]


def _until(fault: Fault) -> str:
    return "" if fault.ends is None else f" ({written(fault.ends)})"
