"""The cut of a loop against all orders of its members, by brute force."""

from itertools import permutations

import numpy as np
import pytest

from cosim.errors import CyclicOrder
from cosim.masters.implicit.cut import EXACT, stages

from ...fakes import Fake, describe
from ...wired import wired


def system(n, connections, outputs=1, means=()):
    """The wiring of n components "c0", ..., each with outputs y0, ...; connections: (source, output, target), all ends.

    An input a connection. `means`: components whose outputs are step means.
    """
    taken = {i: [k for k, (_, _, target) in enumerate(connections) if target == i] for i in range(n)}
    slaves = [
        Fake(
            f"c{i}",
            describe(
                inputs=[f"u{k}" for k in taken[i]],
                outputs=[f"y{j}" for j in range(outputs)],
                step_means={f"y{j}": "" for j in range(outputs)} if i in means else {},
            ),
        )
        for i in range(n)
    ]
    links = [(f"c{a}.y{j}", f"c{b}.u{k}", "after_step") for k, (a, j, b) in enumerate(connections)]
    return wired(links, slaves, held={})


def cut(order, connections):
    """The outputs that somebody takes who steps no later than their component."""
    place = {name: i for i, name in enumerate(order)}
    return {(a, j) for a, j, b in connections if a in place and b in place and place[b] <= place[a]}


def drawn(rng, n, outputs, count):
    return [(int(rng.integers(n)), int(rng.integers(outputs)), int(rng.integers(n))) for _ in range(count)]


@pytest.mark.parametrize("seed", range(30))
def test_it_is_the_smallest_of_all_orders(seed):
    rng = np.random.default_rng(seed)
    n, outputs = int(rng.integers(2, 7)), int(rng.integers(1, 4))
    connections = drawn(rng, n, outputs, int(rng.integers(n, 3 * n)))
    found = stages(system(n, connections, outputs))
    for stage in found:
        members = [int(name[1:]) for name in stage.members]
        said = {(int(port.component[1:]), int(port.variable[1:])) for port in stage.cut}
        assert said == cut(members, connections)
        assert len(said) == min(len(cut(order, connections)) for order in permutations(members))


@pytest.mark.parametrize("seed", range(10))
def test_each_stage_comes_after_those_that_it_needs(seed):
    rng = np.random.default_rng(100 + seed)
    n = 7
    connections = drawn(rng, n, 2, 9)
    found = stages(system(n, connections, 2))
    place = {int(name[1:]): i for i, stage in enumerate(found) for name in stage.members}
    assert sorted(place) == list(range(n))
    assert all(place[a] <= place[b] for a, _, b in connections)
    for a, _, b in connections:  # of two in one stage each reaches the other
        if place[a] == place[b] and a != b:
            assert found[place[a]].cut


def test_two_loops_and_what_lies_between():
    found = stages(system(5, [(0, 0, 1), (1, 0, 0), (1, 0, 2), (2, 0, 3), (3, 0, 4), (4, 0, 3)]))
    assert [set(stage.members) for stage in found] == [{"c0", "c1"}, {"c2"}, {"c3", "c4"}]
    assert [len(stage.cut) for stage in found] == [1, 0, 1]


def test_an_output_that_its_own_component_takes():
    (stage,) = stages(system(1, [(0, 0, 0)]))
    assert list(map(str, stage.cut)) == ["c0.y0"]


@pytest.mark.parametrize("seed", range(10))
def test_a_step_mean_is_never_cut(seed):
    """It costs others their place: of the orders in which it comes before its targets the smallest."""
    rng = np.random.default_rng(200 + seed)
    n = 5
    connections = [(0, 0, 1), (0, 0, 2), *((a, 0, b) for a, _, b in drawn(rng, n, 1, 8) if a), (1, 0, 0), (2, 0, 0)]
    found = stages(system(n, connections, means=(0,)))
    for stage in found:
        assert "c0.y0" not in map(str, stage.cut)
        members = [int(name[1:]) for name in stage.members]
        allowed = [order for order in permutations(members) if (0, 0) not in cut(order, connections)]
        assert len(stage.cut) == min(len(cut(order, connections)) for order in allowed)


def test_step_means_that_need_each_other_are_refused():
    with pytest.raises(CyclicOrder, match=r"c[01]\.y0 -> c[01]\.u"):
        stages(system(2, [(0, 0, 1), (1, 0, 0)], means=(0, 1)))


def test_a_loop_of_many_members():
    """Of more than `EXACT` no order is promised to be the best: a ring is cut once, with a chord no more than twice."""
    n = 4 * EXACT
    ring = [(i, 0, (i + 1) % n) for i in range(n)]
    (stage,) = stages(system(n, ring))
    assert len(stage.cut) == 1 and len(stage.members) == n
    (stage,) = stages(system(n, [*ring, (n // 2, 0, 3)]))
    members = [int(name[1:]) for name in stage.members]
    assert {(int(p.component[1:]), 0) for p in stage.cut} == cut(members, [*ring, (n // 2, 0, 3)])
    assert len(stage.cut) <= 2


def test_a_loop_of_many_members_with_a_step_mean():
    """The source of a step mean comes before who takes it, wherever it was declared."""
    n = 2 * EXACT
    ring = [(i, 0, (i + 1) % n) for i in range(n)]
    (stage,) = stages(system(n, ring, means=(n - 1,)))
    assert len(stage.cut) == 1 and f"c{n - 1}.y0" not in map(str, stage.cut)
