"""Components that step at different rates."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from cosim.masters.rates import waiting

from .. import both
from ..c_fmu import build, real
from ..fakes import Clock, Integrator, Mass, Mean, Spring
from ..flights import run
from ..wired import wired


class TestRates:
    def test_slow_reader_of_a_fast_source_at_point(self):
        slow, clock = Integrator("slow"), Clock("c")
        run([slow, clock], [("c.y", "slow.u")], stop=0.8, steps={"slow": 4})
        assert slow.stepped() == [(0.0, 0.4), (0.4, 0.4)]
        assert slow.inputs_at_steps("u") == [0.0, 0.4]

    def test_fast_reader_sees_the_latest_communication_point_of_a_slow_source(self):
        fast = Integrator("fast")
        result = run([fast, Clock("slow")], [("slow.y", "fast.u")], stop=0.6, steps={"slow": 3})
        assert_allclose(fast.inputs_at_steps("u"), [0.0, 0.0, 0.0, 0.3, 0.3, 0.3])
        assert_allclose(result["slow.y"], [0.0, 0.0, 0.0, 0.3, 0.3, 0.3, 0.6])

    @pytest.mark.parametrize("timing", ["midpoint", "ramp"])
    def test_line_over_the_step_of_a_slow_source(self, timing):
        result = run(
            [Integrator("fast", can_interpolate_inputs=True), Clock("slow")],
            [("slow.y", "fast.u", timing)],
            stop=0.7,
            steps={"slow": 3},
        )
        assert_allclose(result["fast.y"], result.time**2 / 2, rtol=1e-14)

    @pytest.mark.parametrize("timing", ["midpoint", "ramp"])
    def test_slow_target_waits_for_a_fast_source(self, timing):
        slow = Integrator("slow", can_interpolate_inputs=True)
        result = run([slow, Clock("c")], [("c.y", "slow.u", timing)], stop=0.7, steps={"slow": 2})
        assert_allclose(slow.stepped(), [(0.0, 0.2), (0.2, 0.2), (0.4, 0.2), (0.6, 0.1)])
        points = [0, 2, 4, 6, 7]
        assert_allclose(result["slow.y"][points], result.time[points] ** 2 / 2, rtol=1e-14)
        assert_array_equal(result["slow.y"][[1, 3, 5]], result["slow.y"][[0, 2, 4]])

    def test_slow_target_after_step(self):
        slow = Integrator("slow")
        run([slow, Clock("c")], [("c.y", "slow.u", "after_step")], stop=0.4, steps={"slow": 2})
        assert_allclose(slow.inputs_at_steps("u"), [0.2, 0.4])

    def test_mean_of_a_slow_source_is_held_over_its_own_step(self):
        result = run([Integrator("i"), Mean("m")], [("m.y", "i.u")], stop=0.6, steps={"m": 3})
        assert_allclose(result["i.y"][[0, 3, 6]], result.time[[0, 3, 6]] ** 2, rtol=1e-14)

    def test_all_slow_is_like_a_longer_step(self):
        def flight(step, steps):
            return run(
                [Mass("a", 1.0, 1.0), Mass("b", 0.0, 1.0), Spring("s", 0.7)],
                [("a.x", "s.x_1"), ("b.x", "s.x_2"), ("s.f_1", "a.f", "after_step"), ("s.f_2", "b.f", "after_step")],
                step=step,
                steps=steps,
            )

        slow, long = flight(0.1, {"a": 2, "b": 2, "s": 2}), flight(0.2, {})
        assert_allclose(slow["a.x"][::2], long["a.x"], rtol=1e-13)


class TestChainOfWaitingRates:
    """fast, every step -> b every 2nd -> a every 4th, each after_step: b waits for fast, a for b."""

    LINKS = (("fast.y", "b.u", "after_step"), ("b.y", "a.u", "after_step"))

    @pytest.mark.parametrize("declared", [("fast", "b", "a"), ("a", "b", "fast")])
    def test_who_waits(self, declared):
        slaves = {"fast": Clock("fast"), "b": Integrator("b"), "a": Integrator("a")}
        for rates, expected in (
            ({"b": 2, "a": 4}, {"a", "b"}),
            ({"b": 2, "a": 2}, {"a", "b"}),
            ({"a": 2}, {"a"}),
            ({}, set()),
        ):
            wiring = wired(self.LINKS, [slaves[name] for name in declared], held={}, steps=rates)
            assert waiting(wiring) == expected, rates

    @pytest.mark.parametrize("declared", [("fast", "b", "a"), ("a", "b", "fast")])
    @pytest.mark.parametrize("a_steps", [2, 4])
    def test_each_sees_the_end_of_its_own_step(self, declared, a_steps):
        """b integrates the clock by rectangles at the end of its steps; a sees what b is at the end of a's."""
        slaves = {"fast": Clock("fast"), "b": Integrator("b"), "a": Integrator("a")}
        result = run([slaves[name] for name in declared], self.LINKS, stop=1.2, steps={"b": 2, "a": a_steps})
        assert_allclose(slaves["b"].inputs_at_steps("u"), 0.2 * np.arange(1, 7))
        b = 0.2 * np.cumsum(0.2 * np.arange(1, 7))  # at 0.2, 0.4, ... s
        assert_allclose(result["b.y"][2::2], b)
        seen = b[a_steps // 2 - 1 :: a_steps // 2]
        assert_allclose(slaves["a"].inputs_at_steps("u"), seen)
        assert_allclose(result["a.y"][a_steps::a_steps], np.cumsum(0.1 * a_steps * seen))
        assert_array_equal(result["a.u"], result["b.y"])

    def test_in_the_kernel(self, tmp_path):
        """The same with FMUs; a ramp to a reads b at both ends of a's step."""
        clock = build(tmp_path, "Clock", [real("y")], step="y = t + h;")
        variables = [real("u", "input"), real("y")]
        integrator = build(tmp_path, "Integrator", variables, step="y += h * (u + 0.5 * h * m->slope[0]);")
        for timing in ("after_step", "midpoint", "ramp"):
            system = both.of(
                {"a": integrator, "b": integrator, "fast": clock},
                [("fast.y", "b.u", timing), ("b.y", "a.u", timing)],
                steps={"b": 2, "a": 4},
            )
            result = both.fly(system, stop=1.2)
            if timing != "after_step":
                assert_allclose(result["b.y"][::2], result.time[::2] ** 2 / 2, rtol=1e-12)
                line = (result["b.y"][:-4:4] + result["b.y"][4::4]) / 2  # the trapezoid over a's own step
                assert_allclose(result["a.y"][4::4], np.cumsum(0.4 * line), rtol=1e-12)
