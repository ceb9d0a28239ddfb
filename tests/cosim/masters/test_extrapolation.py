"""Inputs that are extrapolated with output derivatives: where that is true, and nowhere else."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from cosim.masters.explicit import Explicit

from .. import both
from ..c_fmu import build, real
from ..fakes import Clock, Integrator
from ..flights import run


class TestExtrapolation:
    """A clock y = t whose slope is 1, into an integrator: with the slope t^2 / 2, without it the sum of rectangles."""

    def fly(self, order=1, can=True, extrapolation=1, steps=None, **timing):
        clock = Clock("clock", max_output_derivative_order=order)
        integrator = Integrator("i", can_interpolate_inputs=can)
        link = ("clock.y", "i.u", timing.get("timing", "at_point"))
        result = run(
            [clock, integrator],
            [link],
            stop=1.2,
            steps=steps,
            master=Explicit(extrapolation=extrapolation, kernel="never"),
        )
        return result, clock, integrator

    def test_with_the_slope(self):
        result, *_ = self.fly()
        assert_allclose(result["i.y"], result.time**2 / 2, rtol=1e-13)

    def test_a_target_that_cannot_interpolate_is_held_at_the_mean_of_the_line(self):
        result, _, integrator = self.fly(can=False)
        assert_allclose(integrator.inputs_at_steps("u"), result.time[:-1] + 0.05, rtol=1e-13)
        assert_allclose(result["i.y"], result.time**2 / 2, rtol=1e-13)

    @pytest.mark.parametrize("can", [True, False])
    def test_a_source_that_gives_no_slopes_is_followed_by_differences(self, can):
        """In the first step nothing is known of it, and the input is held: the integral lacks h^2 / 2."""
        result, *_ = self.fly(order=0, can=can)
        assert_allclose(result["i.y"], result.time**2 / 2 - 0.005 * (result.time > 0), atol=1e-13)

    def test_the_order_is_what_the_fmu_gives(self):
        """Order 2 asked for, order 1 given: no second slope is read or set."""
        asked = []

        class Curious(Clock):
            def get_output_derivatives(self, references, orders):
                asked.append(tuple(orders))
                return super().get_output_derivatives(references, orders)

        clock, integrator = (
            Curious("clock", max_output_derivative_order=1),
            Integrator("i", can_interpolate_inputs=True),
        )
        result = run([clock, integrator], [("clock.y", "i.u")], master=Explicit(extrapolation=2, kernel="never"))
        assert set(asked) == {(1,)}
        assert_allclose(result["i.y"], result.time**2 / 2, rtol=1e-13)

    def test_a_slower_source_is_not_extrapolated(self):
        """Its value may be old by whole steps of the target: the slope would begin at the wrong end."""
        result, *_ = self.fly(steps={"clock": 3})
        held = np.repeat([0.0, 0.3, 0.6, 0.9], 3)
        assert_allclose(result["i.y"], np.concatenate([[0.0], np.cumsum(0.1 * held)]), atol=1e-13)

    def test_a_faster_source_is(self):
        result, *_ = self.fly(steps={"i": 3})
        points = np.arange(0, 13, 3)
        assert_allclose(result["i.y"][points], result.time[points] ** 2 / 2, rtol=1e-13)

    @pytest.mark.parametrize("timing", ["after_step", "midpoint"])
    def test_other_timings_are_not(self, timing):
        _, _, integrator = self.fly(timing=timing)
        assert integrator.slopes == {}
        result, *_ = self.fly(timing=timing)
        assert_allclose(
            result["i.y"], result.time**2 / 2 + (0.05 * result.time if timing == "after_step" else 0.0), atol=1e-13
        )

    def test_in_both_loops(self, tmp_path):
        """A parabola y = t^2 with both derivatives, limited by what each FMU says: the sums are in closed form."""
        step = "double s = t + h; y = s * s; m->slopes_out[0] = 2 * s;"
        order = {n: build(tmp_path, f"Parabola{n}", [real("y")], step=step, maxOutputDerivativeOrder=n) for n in (0, 1)}
        variables = [real("u", "input"), real("y")]
        target = "y += h * (u + 0.5 * h * m->slope[0]);"
        able = build(tmp_path, "Able", variables, step=target)
        unable = build(tmp_path, "Unable", variables, step=target, canInterpolateInputs=False)
        h, n = 0.1, np.arange(10)
        # true slopes 2 t; differences: none after no step, a line after one, then exact of a parabola
        slope = {1: 2 * n * h, 0: np.concatenate([[0.0, h], 2 * n[2:] * h])}
        for told, reader in ((1, able), (0, able), (1, unable), (0, unable)):
            system = both.of({"p": order[told], "i": reader}, [("p.y", "i.u")])
            expected = np.cumsum(h * ((n * h) ** 2 + 0.5 * h * slope[told]))
            assert_allclose(both.fly(system, extrapolation=2)["i.y"][1:], expected, rtol=1e-12)
        slow = both.of({"p": order[1], "i": able}, [("p.y", "i.u")], steps={"p": 2})
        expected = np.cumsum((n // 2 * 2 * h) ** 2 * h)
        assert_allclose(both.fly(slow, extrapolation=2)["i.y"][1:], expected, rtol=1e-12)
