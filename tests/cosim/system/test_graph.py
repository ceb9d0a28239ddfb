"""Orders, loops and delayed paths, variable by variable."""

import pytest

from cosim.system.graph import cycle, initialization_order, refresh_order, stepping_order, strong_components
from cosim.system.wiring import Link, Port, Wiring
from fmus.description.description import ModelDescription

from ..fakes import Clock, Gain, Integrator, describe


def wiring(slaves, *links):
    """Links as "a.y b.u timing"."""
    ends = [text.split() for text in links]
    return Wiring(
        {s.name: s.description for s in slaves},
        tuple(Link(Port(*a.split(".")), Port(*b.split(".")), *timing) for a, b, *timing in ends),
    )


def strings(evaluations):
    return [" ".join(map(str, e.outputs)) for e in evaluations]


class TestStrongComponents:
    def test_order_and_cycles(self):
        edges = {"a": ["b"], "b": ["c"], "c": ["b", "d"], "d": [], "e": ["a"]}
        parts = strong_components("eabcd", edges.__getitem__)
        assert [sorted(p) for p in parts] == [["d"], ["b", "c"], ["a"], ["e"]]
        assert cycle(["b", "c"], edges.__getitem__) == ["b", "c", "b"]

    def test_what_is_free_keeps_its_order(self):
        assert strong_components("cab", lambda n: []) == [["c"], ["a"], ["b"]]

    def test_deep_chain(self):
        parts = strong_components(map(str, range(5000)), lambda n: [str(int(n) + 1)] if int(n) < 4999 else [])
        assert parts[0] == ["4999"]


def test_stepping_order_follows_all_but_at_point():
    slaves = [Integrator("a"), Integrator("b"), Clock("c"), Integrator("d")]
    assert stepping_order(wiring(slaves, "c.y a.u after_step", "d.y b.u at_point", "a.y d.u ramp")) == (
        "c",
        "a",
        "b",
        "d",
    )


def test_initialization_groups_neighbours_of_one_component():
    two = Gain("two")
    two.description = describe(inputs=["u"], outputs=["x", "y", "z"], feedthrough={"y": ("u",)})
    order = initialization_order(wiring([two, Gain("g")], "two.x g.u", "g.y two.u"))
    assert strings(order) == ["two.x", "g.y", "two.y two.z"]
    assert not any(e.loop for e in order)


def test_loop_is_marked():
    order = initialization_order(wiring([Gain("a"), Gain("b"), Gain("c")], "a.y b.u", "b.y a.u", "a.y c.u"))
    assert [(sorted(map(str, e.outputs)), e.loop) for e in order] == [(["a.y", "b.y"], True), (["c.y"], False)]


class TestRefresh:
    def test_only_what_is_stale(self):
        slaves = [Clock("c"), Gain("early"), Gain("late"), Integrator("i")]
        refresh = refresh_order(wiring(slaves, "c.y early.u at_point", "c.y late.u after_step", "c.y i.u at_point"))
        assert strings(refresh.evaluations) == ["early.y"]
        assert refresh.delayed == ()

    @pytest.mark.parametrize("timing", ["midpoint", "mean", "extrapolated", "extrapolated_mean"])
    def test_what_is_held_or_extrapolated_is_stale(self, timing):
        assert strings(refresh_order(wiring([Clock("c"), Gain("g")], f"c.y g.u {timing}")).evaluations) == ["g.y"]

    @pytest.mark.parametrize("timing", ["after_step", "ramp", "smooth"])
    def test_what_ends_at_the_source_s_value_is_fresh(self, timing):
        assert refresh_order(wiring([Clock("c"), Gain("g")], f"c.y g.u {timing}")).evaluations == ()

    def test_delayed_without_the_mark(self):
        (path,) = refresh_order(wiring([Clock("c"), Gain("g", refresh=False)], "c.y g.u at_point")).delayed
        assert str(path) == "c.y -> g.u -> g.y: g does not say that it can be refreshed"

    def test_a_loop_is_one_evaluation(self):
        refresh = refresh_order(wiring([Gain("a"), Gain("b")], "a.y b.u after_step", "b.y a.u at_point"))
        assert [(sorted(map(str, e.outputs)), e.loop) for e in refresh.evaluations] == [(["a.y", "b.y"], True)]
        assert refresh.delayed == ()

    def test_a_loop_is_delayed_without_the_mark(self):
        slaves = [Gain("a", refresh=False), Gain("b", refresh=False)]
        refresh = refresh_order(wiring(slaves, "a.y b.u after_step", "b.y a.u at_point"))
        assert refresh.evaluations == ()
        assert [str(d) for d in refresh.delayed] == ["b.y -> a.u -> a.y: algebraic loop"]

    def test_what_follows_a_delayed_output_is_not_refreshed_for_it(self):
        slaves = [Clock("c"), Gain("a", refresh=False), Gain("b")]
        refresh = refresh_order(wiring(slaves, "c.y a.u at_point", "a.y b.u after_step"))
        assert refresh.evaluations == ()


def test_step_mean_has_no_feedthrough():
    made: ModelDescription = describe(inputs=["u"], outputs=["y"], feedthrough={"y": None}, step_means={"y": ""})
    assert made.feedthrough("y") == ()
    assert made.initial_feedthrough("y") == ("u",)
