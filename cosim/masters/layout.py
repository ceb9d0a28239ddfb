"""Where every value of a run has its place: one vector of doubles with a slot for each. The same for every master.

A component owns the slots from the `offset` of its outputs on: what is read from it, type by type, its output
derivatives, what slopes by differences need (slopes.py), what passes connections with faults, and whether it is frozen
(faults.py). Held inputs have slots, and every connected input has one
of its own, which shows at a communication point what the input is given: input = factor * source + addend. There is no
order in it: who steps when is an algorithm's business.

Real, Integer, Boolean and Enumeration values are doubles in it, exactly. Of a String the slot holds the number of its
text in the run's `Texts`.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from cosim.arrays import FloatArray, IntArray
from cosim.masters import faults, slopes
from cosim.masters.columns import Columns, flag, recorded
from cosim.masters.faults import FREEZING, FROZEN, LAG, Passage
from cosim.masters.slopes import Differences
from cosim.masters.types import Kind, kind_of
from cosim.system.feeds import polynomial
from cosim.system.wiring import Link, Port, Wiring


@dataclass(frozen=True)
class Group:
    """Variables of one component and one kind that are set or read in one call; slots have shape (n,).

    `finite`: the slots of those whose values must be finite, shape (m,).
    """

    kind: Kind
    references: tuple[int, ...]
    slots: IntArray
    finite: IntArray


@dataclass(frozen=True)
class Reading:
    """Outputs of one component, by its place in the layout, that are read together, with slopes or without."""

    component: int
    groups: tuple[Group, ...]
    slopes: bool = False


@dataclass(frozen=True)
class Outputs:
    """What is read from a component: `groups` fill consecutive slots from `offset` on, derivatives follow.

    `names` are those of the values, in the order of their slots. `differences`: whose slopes the FMU does not tell.
    `passages`: connections from here on which faults act. `freeze`: the first of the slots of one that may freeze, -1:
    it may not. `end`: the first slot that is not its own any more.
    """

    offset: int
    groups: tuple[Group, ...]
    names: tuple[str, ...]
    derivative_references: tuple[int, ...]
    derivative_orders: tuple[int, ...]
    differences: Differences | None
    passages: tuple[Passage, ...]
    freeze: int
    end: int

    @property
    def values(self) -> slice:
        """Slots of the values."""
        return slice(self.offset, self.offset + len(self.names))

    @property
    def derivatives(self) -> slice:
        """Slots of the output derivatives."""
        return slice(self.values.stop, self.values.stop + len(self.derivative_references))

    @cached_property
    def slopes(self) -> IntArray:
        """Slots of those that are of first order."""
        return self.derivatives.start + np.flatnonzero(np.array(self.derivative_orders) == 1)

    @property
    def slots(self) -> slice:
        """Slots of all of these."""
        return slice(self.offset, self.end)

    def frozen(self, values: FloatArray) -> bool:
        """Whether the component takes no steps, in a vector of slots."""
        return self.freeze >= 0 and values[self.freeze + FROZEN] != 0.0

    def pass_on(self, begun: FloatArray, newest: FloatArray, t: float) -> None:
        """Let faults act on what the component has at t, s, the end of its step; `begun`: the slots before it."""
        for passage in self.passages:
            passage.take(begun, newest, t)

    def lag(self, values: FloatArray) -> float:
        """Return by how much the component's clock is late, s."""
        return float(values[self.freeze + LAG]) if self.freeze >= 0 else 0.0

    @cached_property
    def finite(self) -> IntArray:
        """Slots of the values that must be finite."""
        return np.concatenate([np.zeros(0, dtype=np.int64), *(group.finite for group in self.groups)])


@dataclass(frozen=True)
class Inputs:
    """The connected inputs of a component, all arrays of length n: input = factor * values[source] + addend.

    `groups` are the own slots of all inputs, in the order of `links`. `slope`: slots of the sources' slopes, -1: not
    known to the master. `signal`: slots where the polynomial of a signal (feeds.py) begins, its value and then its
    derivatives, -1: none. `allowed`: place of an input -> the values that it can take, where its source has others.
    `held`: slots that are not 0 where a fault makes what passes move in steps, -1: none.
    """

    links: tuple[Link, ...]
    groups: tuple[Group, ...]
    slots: IntArray
    source: IntArray
    factor: FloatArray
    addend: FloatArray
    slope: IntArray
    signal: IntArray
    allowed: Mapping[int, tuple[int, ...]]
    held: IntArray

    @property
    def references(self) -> tuple[int, ...]:
        """Value references of the inputs."""
        return tuple(r for group in self.groups for r in group.references)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the inputs."""
        return tuple(link.target.variable for link in self.links)

    @cached_property
    def faulty(self) -> IntArray:
        """Places of the inputs on whose connections faults act."""
        return np.flatnonzero(self.held >= 0)

    def stepping(self, values: FloatArray) -> IntArray:
        """Return the places of the inputs whose connections a fault makes move in steps, in a vector of slots."""
        return self.faulty[values[self.held[self.faulty]] != 0.0]


@dataclass(frozen=True)
class ComponentLayout:
    """The slots of one component."""

    name: str
    inputs: Inputs
    outputs: Outputs


@dataclass(frozen=True)
class Layout:
    """All slots: of `components` in the order of declaration, then held inputs, then connected inputs, `size` in all.

    `constants`: the values of held inputs, in the slots from `held` on; of Strings their texts. `stop_slot`: the slot
    of the flag that ends a run; -1: none. `passages`: connections on which faults act, by their targets.
    """

    components: tuple[ComponentLayout, ...]
    size: int
    held: int
    constants: tuple[float | bytes, ...]
    slots: Mapping[Port, int]
    derivative_slots: Mapping[tuple[Port, int], int]
    inputs: Inputs
    columns: Columns
    stop_slot: int
    passages: Mapping[Port, Passage]

    @classmethod
    def of(
        cls,
        wiring: Wiring,
        record: Sequence[str] = ("*",),
        stop_when: str = "",
    ) -> "Layout":
        """Lay out a wiring, with the slopes that the timings of its links need.

        `record`, `stop_when`: as in `Experiment`. Raises `UnknownName` for a pattern that matches nothing, or a flag
        that there is not.
        """
        ports = recorded(wiring, record)
        slots: dict[Port, int] = {}
        derivative_slots: dict[tuple[Port, int], int] = {}
        highest: dict[Port, int] = {}
        for link in wiring.links:
            highest[link.source] = max(link.slopes, highest.get(link.source, 0))
        outputs: dict[str, Outputs] = {}
        passages: dict[Port, Passage] = {}
        offset = 0
        for name in wiring.components:
            mine = _outputs(wiring, name, ports)
            slots |= {port: offset + i for i, port in enumerate(mine)}
            wanted = {port: highest[port] for port in mine if highest.get(port)}
            known = {port: min(order, slopes.told(wiring, port)) for port, order in wanted.items()}
            orders = [(port, n) for port, order in known.items() for n in range(1, order + 1)]
            first = offset + len(mine)
            derivative_slots |= {key: first + i for i, key in enumerate(orders)}
            unknown = [port for port, order in known.items() if not order]
            first += len(orders)
            derivative_slots |= {(port, 1): first + i for i, port in enumerate(unknown)}
            differences = _differences([slots[p] for p in unknown], first) if unknown else None
            first = differences.step + 1 if differences else first
            passing = faults.passages(wiring, name, slots, derivative_slots, first)
            first = max([first, *(passage.slots.stop for passage in passing.values())])
            freezing = name in wiring.freezing
            passages |= passing
            outputs[name] = Outputs(
                offset,
                groups_of(wiring, mine, [slots[p] for p in mine]),
                tuple(p.variable for p in mine),
                tuple(wiring.variable(p).value_reference for p, _ in orders),
                tuple(n for _, n in orders),
                differences,
                tuple(passing.values()),
                first if freezing else -1,
                first + FREEZING if freezing else first,
            )
            offset = outputs[name].end
        held = offset
        slots |= {port: held + i for i, port in enumerate(wiring.held)}
        first = held + len(wiring.held)
        slots |= {link.target: first + i for i, link in enumerate(wiring.links)}
        places = slots, derivative_slots, passages
        inputs = {name: _inputs(wiring, wiring.into(name), *places) for name in wiring.components}
        return cls(
            components=tuple(ComponentLayout(n, inputs[n], outputs[n]) for n in wiring.components),
            size=first + len(wiring.links),
            held=held,
            constants=tuple(v.encode() if isinstance(v, str) else float(v) for v in wiring.held.values()),
            slots=slots,
            derivative_slots=derivative_slots,
            inputs=_inputs(wiring, wiring.links, *places),
            columns=Columns.of(wiring, ports, slots),
            stop_slot=slots[flag(wiring, stop_when)] if stop_when else -1,
            passages=passages,
        )

    def slope(self, link: Link, n: int = 1) -> int:
        """Return the slot of the n-th derivative of what a link passes on, -1: not known to the master."""
        passage = self.passages.get(link.target)
        return passage.derivative(n) if passage else self.derivative_slots.get((link.source, n), -1)

    def factor(self, link: Link) -> float:
        """Return the factor between that and the slope of the input."""
        return 1.0 if link.target in self.passages else link.conversion.factor

    def readings(self, wiring: Wiring, outputs: Sequence[Port]) -> tuple[Reading, ...]:
        """Return some outputs as readings, one for each of their components, in the order of first appearance."""
        places = {c.name: i for i, c in enumerate(self.components)}
        found: list[Reading] = []
        for name in dict.fromkeys(port.component for port in outputs):
            mine = [port for port in outputs if port.component == name]
            told = bool(self.components[places[name]].outputs.derivative_references)
            sloping = told and any((port, 1) in self.derivative_slots for port in mine)
            found.append(Reading(places[name], groups_of(wiring, mine, [self.slots[p] for p in mine]), sloping))
        return tuple(found)

    def without_slopes(self, wiring: Wiring) -> "Layout":
        """Return the same slots for the same connections in timings that need no slopes, of which none are read."""
        links = {link.target: link for link in wiring.links}

        def carried(inputs: Inputs) -> Inputs:
            return replace(
                inputs,
                links=tuple(links[link.target] for link in inputs.links),
                slope=np.full(len(inputs.links), -1, dtype=np.int64),
            )

        components = tuple(
            replace(
                c,
                inputs=carried(c.inputs),
                outputs=replace(c.outputs, derivative_references=(), derivative_orders=(), differences=None),
            )
            for c in self.components
        )
        return replace(self, components=components, derivative_slots={}, inputs=carried(self.inputs))

    def show_inputs(self, values: FloatArray) -> None:
        """Put into the own slot of every connected input what its source gives it, in a vector of slots."""
        inputs = self.inputs
        values[inputs.slots] = inputs.factor * values[inputs.source] + inputs.addend


def _outputs(wiring: Wiring, component: str, recorded: Sequence[Port]) -> list[Port]:
    """Return what is read from a component, type by type: its outputs, and others that are recorded."""
    extra = set(recorded)
    ports = [
        port
        for v in wiring.descriptions[component].variables.values()
        if v.causality == "output" or (v.causality != "input" and Port(component, v.name) in extra)
        for port in (Port(component, v.name),)
    ]
    return sorted(ports, key=lambda port: kind_of(wiring.variable(port)))


def _differences(values: Sequence[int], first: int) -> Differences:
    """Return the slots of slopes by differences, which fill those from `first` on."""
    n = len(values)
    slope, before = np.arange(first, first + n), np.arange(first + n, first + 2 * n)
    return Differences(np.array(values, dtype=np.int64), slope, before, first + 2 * n)


def _inputs(
    wiring: Wiring,
    links: Sequence[Link],
    slots: Mapping[Port, int],
    derivative_slots: Mapping[tuple[Port, int], int],
    passages: Mapping[Port, Passage],
) -> Inputs:
    ordered = tuple(sorted(links, key=lambda link: kind_of(wiring.variable(link.target))))
    own = [slots[link.target] for link in ordered]
    passing = [passages.get(link.target) for link in ordered]
    ends = list(zip(ordered, passing, strict=True))
    slopes = [p.derivative(1) if p else derivative_slots.get((k.source, 1), -1) for k, p in ends]
    return Inputs(
        links=ordered,
        groups=groups_of(wiring, [link.target for link in ordered], own),
        slots=np.array(own, dtype=np.int64),
        source=np.array([p.first if p else slots[k.source] for k, p in ends], dtype=np.int64),
        factor=np.array([1.0 if p else k.conversion.factor for k, p in ends], dtype=np.float64),
        addend=np.array([0.0 if p else k.conversion.offset for k, p in ends], dtype=np.float64),
        slope=np.array([s if k.slopes else -1 for s, k in zip(slopes, ordered, strict=True)], dtype=np.int64),
        signal=np.array([_signal(link, slots) for link in ordered], dtype=np.int64),
        allowed={i: link.allowed for i, link in enumerate(ordered) if link.allowed is not None},
        held=np.array([p.held if p else -1 for p in passing], dtype=np.int64),
    )


def _signal(link: Link, slots: Mapping[Port, int]) -> int:
    """Return the slot where the polynomial of a signal begins, -1 of a link that has none."""
    return slots[Port(link.source.component, polynomial(link.source.variable, 0))] if link.fed else -1


def groups_of(wiring: Wiring, ports: Sequence[Port], slots: Sequence[int]) -> tuple[Group, ...]:
    """Return some variables of one component in groups of a kind, those of a kind in their order."""
    kinds = [kind_of(wiring.variable(port)) for port in ports]
    return tuple(
        Group(
            kind,
            tuple(wiring.variable(p).value_reference for p, k in zip(ports, kinds, strict=True) if k == kind),
            np.array([s for s, k in zip(slots, kinds, strict=True) if k == kind], dtype=np.int64),
            np.array(
                [s for p, s, k in zip(ports, slots, kinds, strict=True) if k == kind and wiring.must_be_finite(p)],
                dtype=np.int64,
            ),
        )
        for kind in sorted(set(kinds))
    )
