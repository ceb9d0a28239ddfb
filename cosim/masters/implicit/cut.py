"""Which components of a loop step first, so that as few outputs as possible have to be guessed.

Components that need each other's values at the end of a step are one stage, a strong component of the graph of their
connections. In an order of its members, an output is cut where a member that steps no later than its own component
takes it. Its value at the end of the step is an unknown of the iteration. A step mean cannot be guessed: its source
steps first.

Up to `EXACT` members the order with the fewest cut outputs is found by dynamic programming over their subsets (Held and
Karp 1962): the cost of a component after a set of others is how many of its outputs these, or it itself, take.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

from cosim.errors import CyclicOrder
from cosim.system import graph
from cosim.system.wiring import Link, Port, Wiring

EXACT = 12
"""Largest number of members whose best order is found; of more, one that is good."""


@dataclass(frozen=True)
class Stage:
    """Components that step together, in their order, and the outputs that are cut; none where nothing is repeated."""

    members: tuple[str, ...]
    cut: tuple[Port, ...] = ()


def stages(wiring: Wiring) -> tuple[Stage, ...]:
    """Return the stages of a step, each after those whose values it needs; raises `CyclicOrder` for step means."""
    links = [link for link in wiring.links if not link.from_start]
    sources: dict[str, list[str]] = {name: [] for name in wiring.components}
    for link in links:
        if link.source.component not in sources[link.target.component]:
            sources[link.target.component].append(link.source.component)
    found: list[Stage] = []
    for members in graph.strong_components(wiring.components, sources.__getitem__):
        inner = [k for k in links if k.source.component in members and k.target.component in members]
        found.append(Stage(tuple(members)) if not inner else _ordered(members, inner))
    return tuple(found)


def _ordered(members: Sequence[str], links: Sequence[Link]) -> Stage:
    order = _best(members, links) if len(members) <= EXACT else _good(members, links)
    place = {name: i for i, name in enumerate(order)}
    back = [k for k in links if place[k.target.component] <= place[k.source.component]]
    means = [str(k) for k in back if k.step_mean]
    if means:
        raise CyclicOrder(means)
    return Stage(tuple(order), tuple(dict.fromkeys(k.source for k in back)))


def _cost(name: str, before: frozenset[str], links: Sequence[Link]) -> int:
    """Return how many outputs of a component are cut where others step before it; a step mean costs more than all."""
    taken = [
        k for k in links if k.source.component == name and (k.target.component in before or k.target.component == name)
    ]
    return len({k.source for k in taken}) + sum(k.step_mean for k in taken) * len(links)


def _best(members: Sequence[str], links: Sequence[Link]) -> Sequence[str]:
    best: dict[frozenset[str], tuple[int, tuple[str, ...]]] = {frozenset(): (0, ())}
    for size in range(len(members)):
        for names in combinations(members, size):
            before = frozenset(names)
            cost, order = best[before]
            for name in members:
                if name not in before:
                    whole, total = before | {name}, cost + _cost(name, before, links)
                    if whole not in best or total < best[whole][0]:
                        best[whole] = total, (*order, name)
    return best[frozenset(members)][1]


def _good(members: Sequence[str], links: Sequence[Link]) -> Sequence[str]:
    """Return the order in which each component is, of those left, the one that makes the fewest more outputs be cut.

    These are the outputs that it takes of those left, itself among them: a ring is cut once. Of equals that one comes
    which takes most of those that have stepped.
    """
    taken: dict[str, list[Link]] = {name: [] for name in members}
    for link in links:
        taken[link.target.component].append(link)
    order: list[str] = []
    left, cut = dict.fromkeys(members), set[Port]()
    while left:
        costs: dict[str, tuple[int, int]] = {}
        for name in left:
            more = [k for k in taken[name] if k.source.component in left and k.source not in cut]
            cost = len({k.source for k in more}) + sum(k.step_mean for k in more) * len(links)
            costs[name] = cost, len(more) - len(taken[name])
        name = min(costs, key=costs.__getitem__)
        cut |= {k.source for k in taken[name] if k.source.component in left}
        del left[name]
        order.append(name)
    return order
