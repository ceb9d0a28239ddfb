"""Every exchange on zhang2018-ppatc, over its whole flight, against plant, law, guidance and disturbance as one ODE."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from helpers import monolithic
from numpy.testing import assert_allclose
from published import as_in
from zhang2018_loop import CONNECTIONS, loop

from cosim import Explicit, Iterated, Library, load, prepare
from cosim.studies.verification.convergence import angle

pytestmark = pytest.mark.slow

STOP = 200.0  # s, all of it: exchanges have looked exact over 6 s that blow up later
SLOPES = Explicit(inputs="smooth", extrapolation=1)


@pytest.fixture(scope="module")
def attitude():
    rows = np.linspace(0.0, STOP, 2001)
    _, x, _ = monolithic(loop(as_in("zhang2018-ppatc", "controller")()), CONNECTIONS, STOP, rows, rtol=1e-12)
    return x["plant.q_BN"]


@pytest.fixture(scope="module")
def flown(attitude):
    """Error in deg and evaluations a step of a master at a step, the FMUs' own step 1 ms."""
    system, experiment = load("zhang2018-ppatc")
    with prepare(system, Library()) as prepared:

        @cache
        def fly(master, step):
            setup = replace(experiment, communication_step_size=step, every=round(0.1 / step), master=master)
            run = prepared.fly(setup, record=["plant.q_BN"])
            steps = STOP / step
            return np.degrees(angle(run["plant.q_BN"], attitude).max()), run.info["loop"]["evaluations"] / steps

        yield fly


@pytest.mark.parametrize(
    ("master", "step", "error", "evaluations"),
    [
        (SLOPES, 1e-3, 2e-8, 1.0),
        (Iterated("smooth"), 1e-2, 2e-9, 3.0),
        (Iterated("smooth"), 0.1, 1e-5, 4.5),
        (Iterated("ramp"), 1e-2, 1e-6, 3.0),
        (Iterated("ramp"), 0.1, 1e-4, 4.5),
    ],
    ids=str,
)
def test_error_and_cost(flown, master, step, error, evaluations):
    found, cost = flown(master, step)
    assert found < error and cost <= evaluations


@pytest.mark.parametrize(
    ("master", "steps", "order"),
    [
        (SLOPES, (1e-3, 5e-4, 2.5e-4), 2.0),
        (Iterated("ramp"), (0.1, 1e-2), 2.0),
        (Iterated("smooth"), (0.1, 0.05, 0.02), 4.0),
    ],
    ids=str,
)
def test_order(flown, master, steps, order):
    """The next power of the step is as large as this one where the loop's gain, 570 1/s, is: half an order is left."""
    errors = [flown(master, step)[0] for step in steps]
    assert_allclose(np.diff(np.log(errors)) / np.diff(np.log(steps)), order, atol=0.5)


def test_held_inputs_are_hundreds_of_times_less_exact(flown):
    assert flown(Explicit(inputs="held"), 1e-3)[0] > 400 * flown(SLOPES, 1e-3)[0]
