"""Centred stepping: states of second order, outputs as fresh as after_step, also through a chain of units."""

import numpy as np
from numpy.testing import assert_allclose

from cosim.masters.explicit import Explicit

from ..fakes import Clock, Gain, Integrator
from ..flights import run

CHAIN = [("clock.y", "gain.u", "after_step"), ("gain.y", "integrator.u", "after_step")]


def fly(master: Explicit, **integrator):
    slaves = [Clock("clock"), Gain("gain", k=2.0), Integrator("integrator", **integrator)]
    return run(slaves, CHAIN, stop=1.0, step=0.1, master=master)


def test_a_state_behind_feedthrough_is_integrated_to_second_order():
    result = fly(Explicit(centred=True, kernel="never"))
    assert_allclose(result["integrator.y"], result.time**2, rtol=1e-12)  # 2 t integrated: exact for the trapezoid


def test_outputs_are_those_of_the_end_of_the_step():
    result = fly(Explicit(centred=True, kernel="never"))
    assert_allclose(result["gain.y"], 2 * result.time, rtol=1e-12)


def test_held_it_is_first_order():
    result = fly(Explicit(kernel="never"))
    assert_allclose(result["integrator.y"], result.time**2 + 0.1 * result.time, rtol=1e-12)


def test_an_fmu_that_cannot_be_refreshed_is_not_centred():
    result = fly(Explicit(centred=True, kernel="never"), refresh=False)
    assert_allclose(result["integrator.y"], result.time**2 + 0.1 * result.time, rtol=1e-12)


def test_the_inputs_of_the_end_are_set_between_the_step_and_the_reading():
    clock, gain = Clock("clock"), Gain("gain")
    run([clock, gain], [("clock.y", "gain.u", "after_step")], stop=0.1, step=0.1, master=Explicit(centred=True))
    calls = gain.calls[gain.calls.index(("exit",)) + 1 :]
    assert [call[0] for call in calls[:3]] == ["set", "step", "set"]
    assert np.isclose(calls[0][1]["u"], 0.05)
    assert np.isclose(calls[2][1]["u"], 0.1)
