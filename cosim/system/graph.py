"""Who depends on whom, variable by variable: stepping order, initialization order, algebraic loops, refresh order.

A loop of direct feedthrough at a communication point is solved there where its outputs are Real and can be evaluated
again without a step. Another one is refused where its FMUs declare the dependencies that close it; where they do not,
it may be no loop at all, and is delayed.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TypeVar

from cosim.errors import AlgebraicLoop, CyclicOrder
from cosim.system.wiring import Link, Port, Wiring

Node = TypeVar("Node", Port, str)


@dataclass(frozen=True)
class Evaluation:
    """Outputs to be evaluated together; `loop`: they depend on each other. Without a loop they are of one component."""

    outputs: tuple[Port, ...]
    loop: bool = False


@dataclass(frozen=True)
class Delayed:
    """A path that is one communication step late: `output` follows its input `link.target` only at the next step."""

    link: Link
    output: Port
    reason: str

    def __str__(self) -> str:
        """Write the path and why."""
        return f"{self.link.source} -> {self.link.target} -> {self.output}: {self.reason}"


@dataclass(frozen=True)
class Refresh:
    """What is re-evaluated at each communication point, in this order, and which paths stay delayed."""

    evaluations: tuple[Evaluation, ...]
    delayed: tuple[Delayed, ...]


def strong_components(nodes: Iterable[Node], before: Callable[[Node], Sequence[Node]]) -> list[list[Node]]:
    """Return the strongly connected components of a graph, each after those it depends on (Tarjan 1972).

    Among what is free to choose, the order of `nodes` decides.
    """
    number: dict[Node, int] = {}
    low: dict[Node, int] = {}
    open_nodes: list[Node] = []
    is_open: set[Node] = set()
    result: list[list[Node]] = []
    for root in nodes:
        if root in number:
            continue
        number[root] = low[root] = len(number)
        open_nodes.append(root)
        is_open.add(root)
        work = [(root, iter(before(root)))]
        while work:
            node, rest = work[-1]
            child = next(rest, None)
            if child is not None:
                if child not in number:
                    number[child] = low[child] = len(number)
                    open_nodes.append(child)
                    is_open.add(child)
                    work.append((child, iter(before(child))))
                elif child in is_open:
                    low[node] = min(low[node], number[child])
                continue
            work.pop()
            if work:
                low[work[-1][0]] = min(low[work[-1][0]], low[node])
            if low[node] == number[node]:
                members: list[Node] = []
                while not members or members[-1] != node:
                    members.append(open_nodes.pop())
                    is_open.discard(members[-1])
                result.append(members[::-1])
    return result


def cycle(members: Sequence[Node], before: Callable[[Node], Sequence[Node]]) -> list[Node]:
    """Return one way round a strongly connected component, against the edges; first = last."""
    path = [members[0]]
    while path[-1] not in path[:-1]:
        path.append(next(n for n in before(path[-1]) if n in members))
    return path[path.index(path[-1]) :]


def stepping_order(wiring: Wiring) -> tuple[str, ...]:
    """Return the components so that each steps after the sources of inputs that need their values at its end.

    Raises `CyclicOrder` naming the connections of a cycle.
    """
    links = {c: [link for link in wiring.into(c) if not link.from_start] for c in wiring.components}

    def before(component: str) -> list[str]:
        return list(dict.fromkeys(link.source.component for link in links[component]))

    order = strong_components(wiring.components, before)
    for members in order:
        if len(members) > 1 or members[0] in before(members[0]):
            path = cycle(members, before)
            raise CyclicOrder(
                [
                    str(next(link for link in links[target] if link.source.component == source))
                    for target, source in pairwise(path)
                ]
            )
    return tuple(members[0] for members in order)


def initialization_order(wiring: Wiring) -> tuple[Evaluation, ...]:
    """Return all outputs in an order that makes one sweep of initialization mode enough, loops marked."""
    return _evaluations(wiring, Feedthrough(wiring, initial=True))


def evaluation_order(wiring: Wiring) -> tuple[Evaluation, ...]:
    """Return all outputs in an order in which each follows what it depends on directly at a communication point."""
    return _evaluations(wiring, Feedthrough(wiring, initial=False))


def algebraic_loops(wiring: Wiring, *, initial: bool = False) -> list[tuple[str, ...]]:
    """Return each loop of direct feedthrough, as the text lines of `loop_path`."""
    loops = Feedthrough(wiring, initial=initial).loops()
    return [loop_path(wiring, members, initial=initial) for members in loops]


def solved_loops(wiring: Wiring) -> list[tuple[str, ...]]:
    """Return each loop that is solved at communication points, likewise."""
    loops = [e.outputs for e in refresh_order(wiring).evaluations if e.loop]
    return [loop_path(wiring, outputs, initial=False) for outputs in loops]


def unsolved_loops(wiring: Wiring) -> list[AlgebraicLoop]:
    """Return what is wrong with each declared loop at communication points that cannot be solved there.

    A master that evaluates nothing again has none: each output is one step old.
    """
    found: list[AlgebraicLoop] = []
    if not wiring.refreshed:
        return found
    declared = Feedthrough(wiring, initial=False, declared=True)
    for members in declared.loops():
        fixed = [name for name in _components(members) if not wiring.descriptions[name].refresh]
        other = declared.not_real(members)
        if fixed:
            problem = f"{' and '.join(fixed)} cannot be evaluated again without a step"
        elif other:
            problem = f"{other[0]} is of type {wiring.variable(other[0]).type}, which no solver can vary"
        else:
            continue
        advice = "Put a component with a state into one of these connections."
        if not other and all(_repeats(wiring, name) for name in _components(members)):
            advice = f"Choose master=Iterated(). Or: {advice}"
        path = loop_path(wiring, members, initial=False)
        found.append(AlgebraicLoop(path, f"this algebraic loop cannot be solved, for {problem}", advice))
    return found


def _components(outputs: Iterable[Port]) -> list[str]:
    return list(dict.fromkeys(port.component for port in outputs))


def _repeats(wiring: Wiring, name: str) -> bool:
    """Whether the iterated master can repeat steps of a component."""
    description = wiring.descriptions[name]
    return description.can_get_and_set_state and (description.refresh or description.can_interpolate_inputs)


def loop_path(wiring: Wiring, outputs: Sequence[Port], *, initial: bool) -> tuple[str, ...]:
    """Return a way round a loop against the signal, output, input, source, ... ; first = last."""
    feedthrough = Feedthrough(wiring, initial=initial)
    path = cycle(outputs, feedthrough.before)
    words = [str(path[0])]
    for output, source in pairwise(path):
        link = next(link for link in feedthrough.links(output) if link.source == source)
        words += [f"{link.target} (direct feedthrough)", str(source)]
    return tuple(words)


def can_refresh(wiring: Wiring, component: str) -> bool:
    """Whether outputs of a component are evaluated again without a step."""
    return wiring.refreshed and wiring.descriptions[component].refresh


def refresh_order(wiring: Wiring) -> Refresh:
    """Return what must be evaluated again once all components stand at a communication point.

    An output must if it follows directly from an input that ends a step with another value than its source has there:
    one that is held or extrapolated, or whose source was itself evaluated again. It can if the master evaluates
    anything again and its FMU carries the refresh mark; the outputs of others stay what they were at the end of the
    step. What can and follows itself is a loop.
    """
    feedthrough = Feedthrough(wiring, initial=False)
    around = {port: members for members in feedthrough.loops() for port in members}
    fresh: set[Port] = set()
    evaluations: list[Evaluation] = []
    delayed: list[Delayed] = []

    def can(output: Port) -> bool:
        return can_refresh(wiring, output.component)

    def before(output: Port) -> list[Port]:
        return [source for source in feedthrough.before(output) if can(source) and can(output)]

    for members in strong_components(feedthrough.outputs, before):
        loop = len(members) > 1 or members[0] in before(members[0])
        stale = [(k, o) for o in members for k in feedthrough.links(o) if not k.ends_fresh or k.source in fresh]
        if not stale:
            continue
        if can(members[0]) and not (loop and feedthrough.not_real(members)):
            fresh.update(members)
            evaluations.append(Evaluation(tuple(members), loop))
        else:
            delayed += [Delayed(link, output, _reason(wiring, output, around.get(output))) for link, output in stale]
    return Refresh(_merged(evaluations), tuple(delayed))


def _reason(wiring: Wiring, output: Port, loop: Sequence[Port] | None) -> str:
    """Return why an output, in a `loop` or not, is delayed."""
    if not wiring.refreshed:
        return "the plain exchange evaluates nothing again"
    if loop is None:
        return f"{output.component} does not say that it can be refreshed"
    silent = _components(port for port in loop if not wiring.descriptions[port.component].declares(port.variable))
    doubt = f", if it is one: dependencies are not declared by {', '.join(silent)}" if silent else ""
    return f"algebraic loop{doubt}"


class Feedthrough:
    """The graph output <- source output, by direct feedthrough and links, at a communication point or initially.

    `declared`: only what the FMUs say at communication points; else an output whose dependencies are not said follows
    all inputs.
    """

    def __init__(self, wiring: Wiring, *, initial: bool, declared: bool = False) -> None:
        self._wiring = wiring
        self.outputs = [Port(c, v.name) for c, i in wiring.descriptions.items() for v in i.outputs]
        into: Mapping[Port, Link] = {link.target: link for link in wiring.links}
        self._links: dict[Port, list[Link]] = {}
        for port in self.outputs:
            description = wiring.descriptions[port.component]
            depends = description.initial_feedthrough if initial else description.feedthrough
            said = description.declares(port.variable) or not declared
            inputs = (Port(port.component, name) for name in (depends(port.variable) if said else ()))
            self._links[port] = [into[i] for i in inputs if i in into]

    def links(self, output: Port) -> list[Link]:
        """Return the links whose targets an output follows directly."""
        return self._links.get(output, [])

    def before(self, output: Port) -> list[Port]:
        """Return the sources of these links."""
        return [link.source for link in self.links(output)]

    def is_loop(self, members: Sequence[Port]) -> bool:
        """Whether a strong component is a loop, not a single output that stands alone."""
        return len(members) > 1 or members[0] in self.before(members[0])

    def loops(self) -> list[list[Port]]:
        """Return the outputs of each loop."""
        return [members for members in strong_components(self.outputs, self.before) if self.is_loop(members)]

    def not_real(self, members: Sequence[Port]) -> list[Port]:
        """Return the outputs of a loop, and the inputs within it, that are not Real."""
        inner = [link for output in members for link in self.links(output) if link.source in members]
        ports = [*members, *(link.target for link in inner)]
        return [port for port in ports if self._wiring.variable(port).type != "Real"]


def _evaluations(wiring: Wiring, feedthrough: Feedthrough) -> tuple[Evaluation, ...]:
    parts = strong_components(feedthrough.outputs, feedthrough.before)
    return _merged([Evaluation(tuple(members), feedthrough.is_loop(members)) for members in parts])


def _merged(evaluations: Sequence[Evaluation]) -> tuple[Evaluation, ...]:
    """Join neighbours of one component, so that one call serves them."""
    result: list[Evaluation] = []
    for e in evaluations:
        last = result[-1] if result else None
        same = last is not None and not last.loop and not e.loop
        if last is not None and same and last.outputs[0].component == e.outputs[0].component:
            result[-1] = Evaluation(last.outputs + e.outputs)
        else:
            result.append(e)
    return tuple(result)
