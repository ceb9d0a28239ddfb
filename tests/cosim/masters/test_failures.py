"""Runs that end early: what is told, and what is kept."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from cosim.errors import CyclicOrder, StepFailed

from ..fakes import Clock, Failing, Integrator
from ..flights import run


class TestFailures:
    def test_status(self):
        with pytest.raises(StepFailed) as caught:
            run([Failing("wheels", 0.3, "fmi2Error")], [], held={"wheels.u": 0.0})
        error = caught.value
        assert (error.component, error.status, error.time, error.step) == ("wheels", "fmi2Error", 0.3, 0.4 - 0.3)
        assert str(error) == (
            "wheels returned fmi2Error at communication point 0.3 s, step 0.1 s\n    the wheel came off"
        )
        assert_array_equal(error.result.time, [0.0, 0.1, 0.2, 0.3])
        assert error.result.info["status"] == "failed"
        assert error.result.info["failure"]["component"] == "wheels"
        assert error.result.info["reached_time"] == 0.3

    def test_discard_says_how_far_it_came(self):
        with pytest.raises(StepFailed, match=r"fmi2Discard at .* \(last successful time 0.325 s\)"):
            run([Failing("w", 0.3, "fmi2Discard")], [], held={"w.u": 0.0})

    def test_nan_names_component_variable_and_time(self):
        with pytest.raises(StepFailed, match=r"w.y became nan in the step from communication point 0.3 s") as caught:
            run([Failing("w", 0.3, "nan")], [], held={"w.u": 0.0})
        assert (caught.value.component, caught.value.variable) == ("w", "y")
        assert np.isfinite(caught.value.result["w.y"]).all()
        assert len(caught.value.result) == 4

    def test_last_point_reached_is_recorded_whatever_every_says(self):
        with pytest.raises(StepFailed) as caught:
            run([Failing("w", 0.7, "nan")], [], held={"w.u": 1.0}, every=5)
        assert_array_equal(caught.value.result.time, [0.0, 0.5, 0.7])
        assert_allclose(caught.value.result["w.y"], [1.0, 1.5, 1.7])

    def test_interrupt_in_a_step(self):
        result = run([Failing("w", 0.3, "interrupt"), Clock("c")], [], held={"w.u": 0.0}, every=2)
        assert result.info["status"] == "interrupted"
        assert_array_equal(result.time, [0.0, 0.2, 0.3])
        assert_array_equal(result["c.y"], result.time)

    def test_cycle_names_its_connections(self):
        with pytest.raises(CyclicOrder, match=r"a.y -> b.u \(after_step\).*timing=\"at_point\"") as caught:
            run([Integrator("a"), Integrator("b")], [("a.y", "b.u", "after_step"), ("b.y", "a.u", "midpoint")])
        assert sorted(caught.value.connections) == ["a.y -> b.u (after_step)", "b.y -> a.u (midpoint)"]
