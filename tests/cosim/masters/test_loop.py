"""The explicit loop: timings, rows, order of convergence, refresh."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from cosim.errors import NotSupported, UnknownName, WiringErrors
from cosim.masters.explicit import Explicit

from ..fakes import Clock, Gain, Integrator, Mass, Mean, Spring, describe
from ..flights import run


class TestTimings:
    """A clock y = t into an integrator: each timing has its own sum, known exactly."""

    @pytest.mark.parametrize(
        ("timing", "inputs"),
        [
            ("at_point", [0.0, 0.25, 0.5, 0.75]),
            ("after_step", [0.25, 0.5, 0.75, 1.0]),
            ("midpoint", [0.125, 0.375, 0.625, 0.875]),
            ("ramp", [0.0, 0.25, 0.5, 0.75]),
        ],
    )
    def test_inputs(self, timing, inputs):
        integrator = Integrator("i", can_interpolate_inputs=True)
        run([integrator, Clock("clock")], [("clock.y", "i.u", timing)], step=0.25)
        assert integrator.inputs_at_steps("u") == inputs

    @pytest.mark.parametrize("timing", ["midpoint", "ramp"])
    def test_second_order_timings_integrate_a_line_exactly(self, timing):
        result = run(
            [Integrator("i", can_interpolate_inputs=True), Clock("clock")], [("clock.y", "i.u", timing)], step=0.25
        )
        assert_allclose(result["i.y"], result.time**2 / 2, rtol=1e-15)

    def test_extrapolation_integrates_a_line_exactly(self):
        clock = Clock("clock", max_output_derivative_order=1)
        result = run(
            [clock, Integrator("i", can_interpolate_inputs=True)],
            [("clock.y", "i.u")],
            master=Explicit(extrapolation=1),
        )
        assert_allclose(result["i.y"], result.time**2 / 2, rtol=1e-14)

    def test_recorded_inputs_show_their_source_whatever_the_timing(self):
        for timing in ("at_point", "after_step", "midpoint", "ramp"):
            result = run([Integrator("i", can_interpolate_inputs=True), Clock("c")], [("c.y", "i.u", timing)])
            assert_array_equal(result["i.u"], result["c.y"])

    def test_step_mean_is_after_step_in_every_preset(self):
        for preset in ("declared", "jacobi", "gauss_seidel"):
            result = run([Integrator("i"), Mean("m")], [("m.y", "i.u")], master=Explicit(preset=preset))
            assert_allclose(result["i.y"], result.time**2, rtol=1e-14)

    def test_step_mean_is_not_extrapolated(self):
        mean = Mean("m")
        mean.description = describe(outputs=["y", "x"], step_means={"y": ""}, max_output_derivative_order=1)
        result = run(
            [Integrator("i", can_interpolate_inputs=True), mean], [("m.y", "i.u")], master=Explicit(extrapolation=2)
        )
        assert_allclose(result["i.y"], result.time**2, rtol=1e-14)


class TestPresets:
    @pytest.mark.parametrize(
        ("preset", "declared", "first"),
        [("jacobi", "after_step", 0.0), ("gauss_seidel", "at_point", 0.1), ("declared", "after_step", 0.1)],
    )
    def test_preset_decides(self, preset, declared, first):
        integrator = Integrator("i")
        run([Clock("c"), integrator], [("c.y", "i.u", declared)], master=Explicit(preset=preset))
        assert integrator.inputs_at_steps("u")[0] == first

    def test_gauss_seidel_only_forwards(self):
        integrator = Integrator("i")
        run([integrator, Clock("c")], [("c.y", "i.u", "after_step")], master=Explicit(preset="gauss_seidel"))
        assert integrator.inputs_at_steps("u")[0] == 0.0

    def test_unknown_settings(self):
        with pytest.raises(UnknownName, match=r'unknown preset "jacob" in Explicit. Did you mean "jacobi"'):
            Explicit(preset="jacob")  # pyright: ignore
        with pytest.raises(UnknownName, match="kernel"):
            Explicit(kernel="yes")  # pyright: ignore
        with pytest.raises(NotSupported, match=r"extrapolation of order 3. Choose 0, 1 or 2"):
            Explicit(extrapolation=3)  # pyright: ignore


@pytest.mark.parametrize("preset", ["jacobi", "gauss_seidel"])
def test_two_masses_converge_with_slope_one(preset):
    """Equal masses on equal walls' springs: in phase at sqrt(k), out of phase at sqrt(k + 2 c)."""
    k, c = 1.0, 0.7

    def error(step):
        result = run(
            [Mass("a", 1.0, k), Mass("b", 0.0, k), Spring("spring", c)],
            [("a.x", "spring.x_1"), ("b.x", "spring.x_2"), ("spring.f_1", "a.f"), ("spring.f_2", "b.f")],
            stop=4.0,
            step=step,
            master=Explicit(preset=preset),
        )
        t = result.time
        exact = 0.5 * np.cos(math.sqrt(k) * t) + 0.5 * np.cos(math.sqrt(k + 2 * c) * t)
        return np.max(np.abs(result["a.x"] - exact))

    errors = [error(h) for h in (0.02, 0.01, 0.005)]
    assert_allclose(np.log2(np.divide(errors[:-1], errors[1:])), 1.0, atol=0.05)


class TestRows:
    def test_rows_at_start_and_after_each_step(self):
        result = run([Clock("c")], [], stop=0.3)
        assert_array_equal(result.time, [0.0, 0.1, 0.2, 0.3])
        assert_array_equal(result["c.y"], [0.0, 0.1, 0.2, 0.3])

    def test_last_step_is_shortened(self):
        clock = Clock("c")
        result = run([clock], [], stop=0.25)
        assert_array_equal(result.time, [0.0, 0.1, 0.2, 0.25])
        assert clock.stepped() == [(0.0, 0.1), (0.1, 0.1), (0.2, 0.25 - 0.2)]

    def test_constant_step_refuses_a_shortened_one(self):
        clock = Clock("c", can_handle_variable_step=False)
        assert len(run([clock], [], stop=0.3)) == 4
        with pytest.raises(
            WiringErrors, match=r"c needs a constant communication step, 0.1 s, but the last would be 0.05 s"
        ):
            run([clock], [], stop=0.25)

    def test_ramp_over_a_shortened_step(self):
        result = run([Integrator("i", can_interpolate_inputs=True), Clock("c")], [("c.y", "i.u", "ramp")], stop=0.25)
        assert_allclose(result["i.y"][-1], 0.25**2 / 2, rtol=1e-14)

    def test_every_keeps_first_and_last(self):
        assert_array_equal(run([Clock("c")], [], stop=1.0, every=4).time, [0.0, 0.4, 0.8, 1.0])
        assert_array_equal(run([Clock("c")], [], stop=0.3, every=9).time, [0.0, 0.3])

    def test_start_time(self):
        result = run([Clock("c")], [], start_time=5.0, stop=5.2)
        assert_array_equal(result.time, [5.0, 5.1, 5.2])
        assert result["c.y"][0] == 5.0

    def test_time_is_counted(self):
        """100,000 steps of 1 ms end at 100 s, not near it."""
        clock = Clock("c")
        run([clock], [], stop=100.0, step=0.001, every=100_000)
        assert clock.stepped()[-1] == (99.999, 100.0 - 99.999)

    def test_record_patterns(self):
        slaves = [Clock("c"), Integrator("i")]
        links = [("c.y", "i.u")]
        assert run(slaves, links, record=("i.*",)).names == ["i.u", "i.y"]
        assert run([Clock("c"), Integrator("i")], links, record=("*.y",)).names == ["c.y", "i.y"]

    def test_record_other_variables_by_their_full_name(self):
        result = run([Gain("g", k=3.0)], [], held={"g.u": 2.0}, record=("g.k", "g.u"))
        assert result.names == ["g.u", "g.k"]
        assert set(result["g.k"]) == {3.0}
        assert set(result["g.u"]) == {2.0}

    def test_record_pattern_without_match(self):
        with pytest.raises(UnknownName, match=r'unknown variable "c.z" in record'):
            run([Clock("c")], [], record=("c.z",))

    def test_two_runs_are_bitwise_equal(self):
        def once():
            return run(
                [Mass("a", 1.0, 1.0), Mass("b", 0.1, 1.3), Spring("s", 0.7)],
                [("a.x", "s.x_1"), ("b.x", "s.x_2"), ("s.f_1", "a.f", "after_step"), ("s.f_2", "b.f", "after_step")],
            )["a.x"].tobytes()

        assert once() == once()


class TestStopWhen:
    """The clock's output is a flag that goes up after 0.5 s: above it at the point 0.6 s."""

    def test_the_run_ends_where_the_flag_is_up(self):
        result = run([Clock("c")], [], stop=2.0, stop_when="c.y")
        assert result.time[-1] == 0.6
        assert (result.info["status"], result.info["reached_time"]) == ("finished", 0.6)
        assert (result.info["event"]["time"], result.info["event"]["variable"]) == (0.6, "c.y")

    def test_its_row_is_recorded_whatever_every_says(self):
        assert_array_equal(run([Clock("c")], [], stop=2.0, every=4, stop_when="c.y").time, [0.0, 0.4, 0.6])

    def test_a_flag_that_is_up_at_the_start_ends_the_run_there(self):
        result = run([Clock("c")], [], start_time=5.0, stop=6.0, stop_when="c.y")
        assert_array_equal(result.time, [5.0])
        assert result.info["event"]["time"] == 5.0

    def test_a_flag_that_stays_down_is_no_event(self):
        result = run([Clock("c")], [], stop=0.5, stop_when="c.y")
        assert (result.info["status"], "event" in result.info) == ("finished", False)

    def test_an_interrupted_run_is_no_event(self):
        class Pressed(Clock):
            def advance(self, t, h, v, slopes):
                super().advance(t, h, v, slopes)
                if t > 0.25:
                    raise KeyboardInterrupt

        result = run([Pressed("c")], [], stop=2.0, stop_when="c.y")
        assert (result.info["status"], "event" in result.info) == ("interrupted", False)

    def test_an_unknown_flag(self):
        with pytest.raises(UnknownName, match=r'unknown output "c.z" in stop_when. Did you mean "c.y"'):
            run([Clock("c")], [], stop_when="c.z")


class TestRefresh:
    """c -> gain at_point: the gain's output at t_k+1 shows t_k+1 only if it can be evaluated again."""

    def test_feedthrough_is_consistent_at_each_point(self):
        result = run([Gain("g", k=2.0), Clock("c")], [("c.y", "g.u")])
        assert_array_equal(result["g.y"], 2.0 * result.time)

    def test_chain_is_refreshed_in_order(self):
        result = run([Gain("b", k=3.0), Gain("a", k=2.0), Clock("c")], [("c.y", "a.u"), ("a.y", "b.u")])
        assert_array_equal(result["b.y"], 6.0 * result["c.y"])

    def test_after_step_target_of_a_refreshed_source_is_refreshed(self):
        result = run([Gain("a", k=2.0), Gain("b", k=3.0), Clock("c")], [("c.y", "a.u"), ("a.y", "b.u", "after_step")])
        assert_array_equal(result["b.y"], 6.0 * result["c.y"])

    def test_after_step_needs_none(self):
        gain = Gain("g", refresh=False)
        result = run([gain, Clock("c")], [("c.y", "g.u", "after_step")])
        assert_array_equal(result["g.y"], result.time)

    def test_without_mark_it_stays_delayed(self):
        result = run([Gain("g", refresh=False), Clock("c")], [("c.y", "g.u")])
        assert_array_equal(result["g.y"][1:], result.time[:-1])

    def test_integrators_are_not_set_again(self):
        integrator = Integrator("i")
        run([integrator, Clock("c")], [("c.y", "i.u")], stop=1.0)
        calls = [call[0] for call in integrator.calls]
        assert calls[calls.index("exit") + 1 : -2] == ["set", "step"] * 10
