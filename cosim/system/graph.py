"""Who depends on whom, variable by variable: stepping order, initialization order, algebraic loops, refresh order."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TypeVar

from cosim.errors import CyclicOrder
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


def algebraic_loops(wiring: Wiring, *, initial: bool = False) -> list[list[str]]:
    """Return each loop of direct feedthrough, as the text lines of `loop_path`."""
    feedthrough = Feedthrough(wiring, initial=initial)
    return [loop_path(wiring, e.outputs, initial=initial) for e in _evaluations(wiring, feedthrough) if e.loop]


def loop_path(wiring: Wiring, outputs: Sequence[Port], *, initial: bool) -> list[str]:
    """Return a way round a loop against the signal, output, input, source, ... ; first = last."""
    feedthrough = Feedthrough(wiring, initial=initial)
    path = cycle(outputs, feedthrough.before)
    words = [str(path[0])]
    for output, source in pairwise(path):
        link = next(link for link in feedthrough.links(output) if link.source == source)
        words += [f"{link.target} (direct feedthrough)", str(source)]
    return words


def refresh_order(wiring: Wiring) -> Refresh:
    """Return what must be evaluated again once all components stand at a communication point.

    An output must if it follows directly from an input that ends a step with another value than its source has there:
    one that is held or extrapolated, or whose source was itself evaluated again. It can if its FMU carries the refresh
    mark and the output is in no algebraic loop.
    """
    feedthrough = Feedthrough(wiring, initial=False)
    fresh: set[Port] = set()
    evaluations: list[Evaluation] = []
    delayed: list[Delayed] = []
    for members in strong_components(feedthrough.outputs, feedthrough.before):
        loop = feedthrough.is_loop(members)
        for output in members:
            stale = [k for k in feedthrough.links(output) if not k.ends_fresh or k.source in fresh]
            if not stale:
                continue
            if loop or not wiring.descriptions[output.component].refresh:
                reason = "algebraic loop" if loop else f"{output.component} does not say that it can be refreshed"
                delayed += [Delayed(link, output, reason) for link in stale]
            else:
                fresh.add(output)
                evaluations.append(Evaluation((output,)))
    return Refresh(_merged(evaluations), tuple(delayed))


class Feedthrough:
    """The graph output <- source output, by direct feedthrough and links, at a communication point or initially."""

    def __init__(self, wiring: Wiring, *, initial: bool) -> None:
        self.outputs = [Port(c, v.name) for c, i in wiring.descriptions.items() for v in i.outputs]
        into: Mapping[Port, Link] = {link.target: link for link in wiring.links}
        self._links: dict[Port, list[Link]] = {}
        for port in self.outputs:
            description = wiring.descriptions[port.component]
            depends = description.initial_feedthrough if initial else description.feedthrough
            inputs = (Port(port.component, name) for name in depends(port.variable))
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
