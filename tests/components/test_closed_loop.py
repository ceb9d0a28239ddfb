"""The complete closed loop of zhang2018 as one ODE, against the table of figures of equations/zhang2018.md."""

import numpy as np
import pytest
from helpers import monolithic
from numpy.testing import assert_allclose
from published import as_in
from zhang2018_loop import CONNECTIONS, HALF, loop

AdaptiveTracking = as_in("zhang2018-atc", "controller")
PrescribedPerformance = as_in("zhang2018-ppatc", "controller")


class Flight:
    """200 s of a law, every 10 ms; e in degrees."""

    def __init__(self, controller):
        self.t, self.x, self.y = monolithic(loop(controller), CONNECTIONS, 200.0)
        self.e = np.degrees(self.y["controller.e"])
        self.late = self.t >= 100.0

    def last_outside(self, bound=0.005):
        return [self.t[np.nonzero(np.abs(e) > bound)[0][-1]] for e in self.e.T]

    def first_mode(self):
        return np.abs(self.x["plant.eta"][:, 0]).max()


@pytest.fixture(scope="module")
def ppatc():
    return Flight(PrescribedPerformance())


@pytest.fixture(scope="module")
def atc():
    return Flight(AdaptiveTracking())


@pytest.fixture(scope="module")
def ppatc_half():
    return Flight(PrescribedPerformance(**HALF))


@pytest.fixture(scope="module")
def atc_half():
    return Flight(AdaptiveTracking(**HALF))


def test_ppatc_keeps_half_the_bound(ppatc):
    assert_allclose(ppatc.e[ppatc.late].mean(axis=0), [0.0025, 0.0025, -0.0025], atol=3e-5)


def test_ppatc_stays_within_its_bounds(ppatc):
    z = ppatc.y["controller.z"]
    assert ppatc.y["controller.barrier_hits"].max() == 0
    assert ppatc.x["controller.barrier_time"][-1] == 0
    assert_allclose(z[:, 1].min(), 0.400, atol=0.003)
    assert_allclose(z[:, :2].max(), 0.834, atol=0.003)
    assert_allclose([z[:, 2].min(), z[:, 2].max()], [-0.667, -0.500], atol=0.003)


def test_ppatc_settling(ppatc):
    assert_allclose(ppatc.last_outside(), [27.5, 27.0, 27.3], atol=0.1)


def test_atc_pitch_undershoot(atc):
    lowest = atc.e[:, 1].argmin()
    assert_allclose(atc.e[lowest, 1], -0.0433, atol=0.0005)
    assert_allclose(atc.t[lowest], 4.9, atol=0.1)


def test_atc_steady_state_and_settling(atc):
    assert_allclose(np.abs(atc.e[atc.late]).max(axis=0), [7.52e-5, 5.68e-5, 4.88e-5], atol=2e-6)
    assert_allclose(atc.last_outside(), [31.9, 15.5, 29.0], atol=0.1)


def test_panels_move_against_each_other(ppatc, atc):
    for flight in (ppatc, atc):
        eta = flight.x["plant.eta"]
        assert np.abs(eta[:, :4] + eta[:, 4:]).max() < 1e-12


def test_first_mode(ppatc, atc):
    assert_allclose([ppatc.first_mode(), atc.first_mode()], [2.9e-4, 5.7e-5], rtol=0.02)


def test_estimated_bound(ppatc, atc):
    assert_allclose(ppatc.x["controller.mu_hat"][-1], 0.052255, atol=1e-5)
    assert_allclose(atc.x["controller.mu_hat"][-1], 0.038704, atol=1e-5)


def test_half_the_gain(ppatc, ppatc_half, atc_half):
    change = np.abs(ppatc_half.e - ppatc.e)
    assert_allclose(change.max(), 0.0123, atol=5e-4)
    assert_allclose(change[ppatc.t >= 20.0].max(), 9.7e-5, atol=5e-6)
    assert_allclose(atc_half.e[:, 1].min(), -0.109, atol=1e-3)
    assert_allclose(atc_half.last_outside()[1], 26.3, atol=0.1)
    assert_allclose(np.abs(atc_half.e[atc_half.late]).max(axis=0), [8.0e-5, 7.3e-5, 7.3e-5], atol=2e-6)
