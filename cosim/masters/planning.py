"""From a checked wiring to the plan."""

from collections.abc import Sequence
from fnmatch import fnmatchcase

import numpy as np

from cosim.errors import UnknownName, WiringErrors
from cosim.masters import rates
from cosim.masters.plan import (
    STEP_MEAN,
    TIMING_CODES,
    Columns,
    ComponentPlan,
    Evaluation,
    InputDerivatives,
    Inputs,
    Outputs,
    Plan,
    Reading,
    floats,
    ints,
)
from cosim.system import graph
from cosim.system.wiring import Link, Port, Wiring
from cosim.time import Schedule
from fmus.description.description import ScalarVariable
from fmus.description.names import canonical, split_element
from fmus.description.units import IDENTITY, Conversion


def build(
    wiring: Wiring, schedule: Schedule, record: Sequence[str], extrapolation: int = 0, stop_when: str = ""
) -> Plan:
    """Make the plan of a wiring.

    Raises `CyclicOrder`, `WiringErrors` for rates that do not fit, `UnknownName` for a pattern that matches nothing or
    a flag that there is not.
    """
    if mistakes := rates.mistakes(wiring, schedule):
        raise WiringErrors(wiring.system, mistakes)
    planner = _Planner(wiring, recorded(wiring, record), extrapolation)
    return planner.plan(schedule, flag(wiring, stop_when) if stop_when else None)


def flag(wiring: Wiring, name: str) -> Port:
    """Return the Real output that a name means; raises `UnknownName`."""
    outputs = [Port(component, v.name) for component, fmu in wiring.descriptions.items() for v in fmu.real_outputs]
    for port in outputs:
        if str(port) == canonical(name):
            return port
    raise UnknownName("output", name, "stop_when", list(map(str, outputs)))


def recorded(wiring: Wiring, patterns: Sequence[str]) -> list[Port]:
    """Return the variables that the patterns choose, in the order of declaration.

    A pattern is matched with whole arrays and elements of Real inputs and outputs; any other Real variable must be
    named in full. Raises `UnknownName` for a pattern without match.
    """
    unmatched = {p for p in patterns if p != "*"}
    ports: list[Port] = []
    known: list[str] = []
    for component, description in wiring.descriptions.items():
        known += [f"{component}.{base}" for base in description.groups]
        for variable in description.variables.values():
            if variable.type != "Real":
                continue
            names = {f"{component}.{variable.name}", f"{component}.{split_element(variable.name)[0]}"}
            exchanged = variable.causality in ("input", "output")
            matching = {p for p in patterns if any(_matches(p, name, exchanged) for name in names)}
            unmatched -= matching
            if matching:
                ports.append(Port(component, variable.name))
    for pattern in sorted(unmatched):
        raise UnknownName("variable", pattern, "record", known)
    return ports


def _matches(pattern: str, name: str, exchanged: bool) -> bool:
    if canonical(pattern) == name:
        return True
    return exchanged and fnmatchcase(name, pattern.replace("[", "[[]"))


class _Planner:
    """Slots first, then everything that refers to them."""

    def __init__(self, wiring: Wiring, columns: list[Port], extrapolation: int) -> None:
        self.wiring = wiring
        self.columns = columns
        self.order = graph.stepping_order(wiring)
        self.waiting = rates.waiting(wiring)
        self.orders = {link: self._extrapolated(link, extrapolation) for link in wiring.links}
        self.slots: dict[Port, int] = {}
        self.derivative_slots: dict[tuple[Port, int], int] = {}
        self.outputs = {name: self._outputs(name) for name in self.order}
        self.held = {port: v for port, v in wiring.held.items() if self._variable(port).type == "Real"}
        self.slots |= {port: self._next_slot + i for i, port in enumerate(self.held)}

    def plan(self, schedule: Schedule, ending: Port | None = None) -> Plan:
        evaluations = graph.initialization_order(self.wiring)
        refresh = graph.refresh_order(self.wiring).evaluations
        return Plan(
            schedule=schedule,
            components=tuple(self._component(name) for name in self.order),
            size=self._next_slot,
            constants=floats([float(v) for v in self.held.values()]),
            initialization=tuple(
                Evaluation(
                    self._readings(e.outputs),
                    tuple(graph.loop_path(self.wiring, e.outputs, initial=True)) if e.loop else (),
                )
                for e in evaluations
            ),
            refresh=tuple(reading for e in refresh for reading in self._readings(e.outputs)),
            columns=self._columns(),
            stop_slot=-1 if ending is None else self.slots[ending],
        )

    @property
    def _next_slot(self) -> int:
        return len(self.slots) + len(self.derivative_slots)

    def _variable(self, port: Port) -> ScalarVariable:
        return self.wiring.descriptions[port.component].variables[port.variable]

    def _references(self, ports: Sequence[Port]) -> tuple[int, ...]:
        return tuple(self._variable(p).value_reference for p in ports)

    def _extrapolated(self, link: Link, extrapolation: int) -> int:
        """Return up to which order an at_point input is extrapolated; the value of a slower source may be too old."""
        if link.timing != "at_point" or not self.wiring.descriptions[link.target.component].can_interpolate_inputs:
            return 0
        if self.wiring.period(link.source.component) > self.wiring.period(link.target.component):
            return 0
        return min(extrapolation, self.wiring.descriptions[link.source.component].max_output_derivative_order)

    def _outputs(self, name: str) -> Outputs:
        """Give slots to what is read from a component: its Real outputs, and others that are recorded."""
        offset = self._next_slot
        extra = {p for p in self.columns if p.component == name and self._variable(p).causality != "input"}
        ports = [
            Port(name, v.name)
            for v in self.wiring.descriptions[name].variables.values()
            if v.type == "Real" and (v.causality == "output" or Port(name, v.name) in extra)
        ]
        self.slots |= {port: offset + i for i, port in enumerate(ports)}
        highest: dict[Port, int] = {}
        for link, order in self.orders.items():
            highest[link.source] = max(order, highest.get(link.source, 0))
        derivatives = [(port, n) for port in ports for n in range(1, highest.get(port, 0) + 1)]
        for key in derivatives:
            self.derivative_slots[key] = self._next_slot
        return Outputs(
            offset=offset,
            references=self._references(ports),
            names=tuple(p.variable for p in ports),
            derivative_references=self._references([p for p, _ in derivatives]),
            derivative_orders=tuple(n for _, n in derivatives),
        )

    def _component(self, name: str) -> ComponentPlan:
        links = self.wiring.into(name)
        period = self.wiring.period(name)
        slower = [
            self.wiring.period(k.source.component) > period and k.source.component not in self.waiting for k in links
        ]
        ramps = [(i, 1, -1) for i, k in enumerate(links) if k.timing == "ramp"]
        extrapolated = [
            (i, n, self.derivative_slots[k.source, n])
            for i, k in enumerate(links)
            for n in range(1, self.orders[k] + 1)
        ]
        derivatives = ramps + extrapolated
        references = self._references([k.target for k in links])
        return ComponentPlan(
            name=name,
            period=period,
            at_end=name in self.waiting,
            inputs=Inputs(
                references=references,
                source=ints([self.slots[k.source] for k in links]),
                timing=ints([STEP_MEAN if k.step_mean else TIMING_CODES[k.timing] for k in links]),
                factor=floats([k.conversion.factor for k in links]),
                addend=floats([k.conversion.offset for k in links]),
                ahead=np.array(slower, dtype=np.bool_),
                source_component=ints([self.order.index(k.source.component) for k in links]),
            ),
            derivatives=InputDerivatives(
                references=tuple(references[i] for i, _, _ in derivatives),
                orders=tuple(n for _, n, _ in derivatives),
                position=ints([i for i, _, _ in derivatives]),
                slot=ints([slot for _, _, slot in derivatives]),
            ),
            outputs=self.outputs[name],
        )

    def _readings(self, outputs: Sequence[Port]) -> tuple[Reading, ...]:
        result: list[Reading] = []
        for place, name in enumerate(self.order):
            mine = [p for p in outputs if p.component == name]
            if mine:
                result.append(Reading(place, self._references(mine), ints([self.slots[p] for p in mine])))
        return tuple(result)

    def _columns(self) -> Columns:
        links = {link.target: link for link in self.wiring.links}

        def origin(port: Port) -> tuple[int, Conversion]:
            link = links.get(port)
            return (self.slots[port], IDENTITY) if link is None else (self.slots[link.source], link.conversion)

        origins = [origin(port) for port in self.columns]
        return Columns(
            names=tuple(map(str, self.columns)),
            units=tuple(self._variable(p).unit for p in self.columns),
            source=ints([slot for slot, _ in origins]),
            factor=floats([c.factor for _, c in origins]),
            addend=floats([c.offset for _, c in origins]),
        )
