"""geng2012 in the readings that the paper leaves open, native: clusters, units, inertia, observer, gimbals."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from cosim import simulate
from cosim.cli.library import Library
from cosim.studies.metrics import attitude_error, settling_time
from cosim.studies.papers import PAPERS, scenario
from cosim.studies.papers.claims import judge
from cosim.studies.papers.geng2012 import surface

pytestmark = pytest.mark.slow


@cache
def flown(name: str):
    """An experiment as it is, 100 s at 1 ms: .8 s of CPU."""
    return simulate(*scenario(f"geng2012-{name}"), locate=Library("native"))


def settled(name: str):
    run = flown(name)
    return settling_time(run.time, attitude_error(run), 0.1)


def at(name: str, time: float):
    return int(np.searchsorted(flown(name).time, time - 1e-9))


def rate(name: str, begin: float, end=np.inf):
    """The largest component of the body rate in an interval, deg/s."""
    run = flown(name)
    inside = (run.time >= begin - 1e-9) & (run.time <= end + 1e-9)
    return np.degrees(np.abs(run["plant.omega_BN_B"][inside]).max())


def rho(name: str, time: float):
    return flown(name)["controller.rho"][at(name, time)]


# Clusters


def test_one_wheel_never_settles_with_the_paper_s_law():
    """A limit cycle of 1.00 deg/s, on which the network learns for ever. second_look.md rounds rho_x twice, to .77."""
    assert settled("z-wheel-compensated") is settled("z-wheel-uncompensated") is None
    assert_allclose(rate("z-wheel-compensated", 80), 1.00, atol=0.005)
    assert_allclose(rho("z-wheel-compensated", 30), [0.765, 0.976, 0.171], atol=5e-4)
    assert_allclose(rho("z-wheel-compensated", 100), [6.6, 3.4, 1.8], atol=0.05)


def test_three_wheels_in_the_end_phase():
    name = "end-phase-compensated"
    assert_allclose(settled(name), 39.2, atol=0.05)
    assert_allclose(rate(name, 40), 0.0153, atol=5e-5)
    assert_allclose(np.abs(attitude_error(flown(name))[at(name, 40)]).max(), 0.087, atol=5e-4)
    assert settled("end-phase-uncompensated") is None


def test_wheels_that_wait_for_1_deg_never_act_where_it_is_not_reached():
    """Without compensation the error stays above 1 deg: three wheels fly as one does, bit for bit."""
    one, three = flown("z-wheel-uncompensated"), flown("end-phase-uncompensated")
    assert np.linalg.norm(attitude_error(three), axis=1).min() > 1
    assert_array_equal(one["plant.q_BN"], three["plant.q_BN"])


# Sigma in degrees, gamma as printed


def test_sigma_in_degrees():
    assert_allclose(settled("degrees"), 35.1, atol=0.05)
    assert_allclose(rate("degrees", 40), 0.0089, atol=5e-5)
    assert_allclose(rho("degrees", 100), [0.238, 0.528, 0.074], atol=5e-4)


def test_sigma_in_radians():
    assert_allclose(rate("printed-gamma", 40), 0.0414, atol=5e-5)
    assert_allclose([rho("printed-gamma", t)[1] for t in (30, 100)], [0.033, 0.054], atol=5e-4)


# Inertia


@pytest.mark.parametrize(
    ("name", "with_network", "without"), [("light", 33.9, 34.4), ("nominal", 33.0, 44.2), ("", 33.3, 47.7)]
)
def test_inertia(name, with_network, without):
    names = [f"{name}-{end}".strip("-") for end in ("compensated", "uncompensated")]
    names[0] = name or names[0]
    assert_allclose([settled(n) for n in names], [with_network, without], atol=0.05)


# Observer


def test_observer_from_a_wrong_start():
    name = "observer-start"
    assert_allclose(rate(name, 40), 0.047, atol=5e-4)
    wrong = flown(name)["observer.eta"] - flown(name)["plant.eta"]
    assert_allclose(wrong[0], 0.05, atol=1e-12)
    assert np.abs(wrong[-1000:]).max(axis=0)[0] > 0.02  # the slowest mode forgets with its own damping, 230 s


def test_observer_with_placed_poles():
    """J is 20 % off, so that its gains bring in an error: later than with none. second_look.md has 41.7 s, .032 deg/s.

    It says the real parts of the poles only, and so leaves the imaginary ones open: with each mode's own frequency,
    as here, it is 39.8 s; with other round frequencies from 36.7 to 43.1 s; with real poles the loop is lost.
    """
    assert_allclose(settled("observer-placed"), 39.8, atol=0.05)
    assert_allclose(rate("observer-placed", 40), 0.0194, atol=5e-5)
    assert settled("observer-placed-real") is None
    assert np.abs(attitude_error(flown("observer-placed-real"))[-1000:]).max() > 5


def test_with_the_inertia_known_placed_poles_forget_a_wrong_start():
    flight, experiment = scenario("geng2012-observer-placed")
    changes = {"plant.J": flight.vehicle["J"], "observer.eta_start": [0.05] * 4}
    run = simulate(
        replace(flight, parameters=flight.parameters | changes),
        replace(experiment, stop_time=40.0),
        locate=Library("native"),
    )
    wrong = np.abs(run["observer.eta"] - run["plant.eta"]).max(axis=1)
    assert wrong[run.time > 30].max() < 1e-4


# Gimbals


def test_gimbals_turned_before_the_manoeuvre():
    """Both by the same angle: no torque; the slew is then that of end-phase-compensated but for 10 s of disturbance.

    In 10 s that turns the body by 4.5e-5 N m (10 s)^2 / 2 / 60 kg m2, 2e-3 deg: a few times that is left at most.
    """
    run, other = flown("prepositioned"), flown("end-phase-compensated")
    before = run.time < 0
    assert run.time[0] == -10
    assert_allclose(run["actuators.gimbal_angle"][0], [0, np.pi])
    assert_allclose(run["actuators.gimbal_angle"][at("prepositioned", 0)], [np.pi / 4, 5 * np.pi / 4], atol=1e-12)
    assert np.abs(run["actuators.tau_B"][before]).max() < 1e-9
    assert np.abs(run["controller.tau_command_B"][before]).max() == 0
    apart = np.abs(attitude_error(run)[~before] - attitude_error(other))
    assert apart.max() < 0.02
    assert_allclose(settled("prepositioned"), settled("end-phase-compensated"), atol=0.05)


# Singularity


def test_the_cluster_is_singular_and_the_inverted_matrix_is_not():
    run = flown("compensated")
    measure, turning = run["steering.singularity"].ravel(), (run.time >= 1) & (run.time <= 20)
    assert_allclose([np.mean(measure < 0.01), np.mean(measure[turning] < 0.01)], [0.87, 0.30], atol=0.005)
    assert_allclose(run["steering.inverted_determinant"].min(), 0.019, atol=5e-4)
    assert_allclose(run["steering.inverted_singular_value"].min(), 0.0095, atol=5e-5)


def test_limits_of_the_cluster_are_kept():
    for name in PAPERS["geng2012"].experiments:
        run = flown(name.removeprefix("geng2012-"))
        gimbals = np.abs(run["steering.gimbal_rate_command"])
        assert 0.02 * np.abs(run["steering.wheel_acceleration_command"]).max() <= 0.25 * (1 + 1e-12)
        assert gimbals.max() <= 3.5 / 15 * (1 + 1e-12)
        assert not ((gimbals > 0) & (gimbals < np.radians(0.02))).any()


# Claims


def test_the_uncertainty_is_what_moves_the_surface():
    """V' = s^T (E - rho s / (|s| + 1e-3)) with E from the body's motion is the slope of the recorded V.

    What is left is the torque held over 1 ms and e' = w of the law's model.
    """
    run = flown("uncompensated")
    s, size = run["controller.s"], np.linalg.norm(run["controller.s"], axis=1)
    slope = np.sum(s * surface.uncertainty(run), axis=1) - surface.acting(run) * size
    found = np.gradient(surface.lyapunov(run), run.time)
    assert np.abs(slope - found)[2:-2].max() < 0.01 * np.abs(found).max()
    assert np.linalg.norm(surface.uncertainty(run, 1.0) - surface.uncertainty(run), axis=1).max() > 0.1


def test_verdicts():
    paper = PAPERS["geng2012"]
    found = judge(paper.claims, {name: flown(name.removeprefix("geng2012-")) for name in paper.experiments})
    assert [verdict.word.partition(" (")[0] for verdict in found] == [
        "in 3 readings",
        "in 6 readings",
        "in 5 readings",
        "in 3 readings",
        "in 5 readings",
        "partly",
        "in 4 readings",
        "in 4 readings",
        "in 2 readings",
        "reproduced",
        "reproduced",
        "not judged",
        "not reproduced",
        "partly",
        "in 2 readings",
        "in one reading",
    ]
    for verdict in found[:5]:  # nothing that the paper says of the manoeuvre holds on the cluster that it flies
        ones = [all(holds.values()) for name, holds in verdict.readings.items() if name.startswith("one wheel")]
        assert ones and not any(ones), verdict
