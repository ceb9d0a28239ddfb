"""Components that step at different rates."""

import pytest
from numpy.testing import assert_allclose, assert_array_equal

from ..fakes import Clock, Integrator, Mass, Mean, Spring
from ..flights import run


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
