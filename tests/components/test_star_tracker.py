"""Star tracker: exact delay, its own rate, misalignment, noise about each axis, outages; against Basilisk's."""

import numpy as np
import pytest
from helpers import Point
from numpy.testing import assert_allclose, assert_array_equal
from sampling import samples
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

from components.catalog import CATALOG

StarTracker = CATALOG["StarTracker"]
T = 0.05
TURN = [2e-3, -1e-3, 3e-3]


def turning(count, sample=T):
    """Times and attitudes of a body that turns ever faster about a skew axis."""
    t = sample * np.arange(count)
    return t, Rotation.from_rotvec(np.outer(0.1 + 0.2 * t + 0.05 * t**2, [0.48, -0.6, 0.64]))


def seen(part, count, sample=T, **values):
    t, q = turning(count, sample)
    return t, q, samples(part, t, {"q_BN_true": q.as_quat(scalar_first=True)}, **values)


def attitude(rows):
    return Rotation.from_quat(rows["q_BN"], scalar_first=True)


def test_direct_feedthrough():
    table = StarTracker().direct_feedthrough
    assert table == {"q_BN": ("q_BN_true",), "exposure_time": (), "valid": ()}


def test_without_latency_and_errors_it_shows_the_attitude_now():
    t, q, rows = seen(StarTracker(sample_time=T), 30)
    assert_allclose(rows["q_BN"], q.as_quat(scalar_first=True), atol=2e-16)
    assert_array_equal(rows["exposure_time"], t)
    assert rows["valid"].all()
    _, _, none = seen(StarTracker(sample_time=T, memory=0), 30)
    assert_array_equal(none["q_BN"], rows["q_BN"])


@pytest.mark.parametrize("late", [0, 1, 3, 4, 7, 11])
@pytest.mark.parametrize("n", [1, 4])
def test_what_is_shown_is_the_attitude_of_a_latency_ago(n, late):
    """For whole numbers of measurements and fractions, by a plain list of measurements with their arrivals."""
    t, q, rows = seen(
        StarTracker(sample_time=T, memory=12), 60, samples_per_measurement=n, latency=late * T, misalignment=TURN
    )
    mounted = (q * Rotation.from_rotvec(TURN)).as_quat(scalar_first=True)
    arrivals = {k + late: k for k in range(0, 60, n)}
    shown, valid = 0, 0
    for k in range(60):
        if k in arrivals:
            shown, valid = arrivals[k], 1
        assert rows["valid"][k] == valid
        assert rows["exposure_time"][k] == t[shown]
        assert_allclose(rows["q_BN"][k], mounted[shown], atol=4e-16)


def test_noise_across_and_about_the_boresight():
    """Rotation vector of the error: its components in axes across, across and along have the two deviations."""
    count, cross, roll = 4000, 2e-5, 3e-4
    boresight = np.array([2.0, -1.0, 2.0]) / 3
    values = dict(boresight_B=boresight, cross_noise=cross, roll_noise=roll)
    part = StarTracker(sample_time=1e-3)
    _, q, rows = seen(part, count, 1e-3, **values)
    error = (q.inv() * attitude(rows)).as_rotvec()
    across = np.linalg.svd(boresight[None])[2][1:]
    normal = error @ np.vstack([across, boresight]).T / [cross, cross, roll]
    low, high = chi2.ppf([1e-4, 1 - 1e-4], count)
    assert ((normal**2).sum(axis=0) > low).all() and ((normal**2).sum(axis=0) < high).all()
    assert np.abs(np.corrcoef(normal.T) - np.eye(3)).max() < 4 / np.sqrt(count)
    assert np.abs((normal[1:] * normal[:-1]).mean(axis=0)).max() < 4 / np.sqrt(count)
    *_, again = seen(part, 50, 1e-3, **values)
    *_, other = seen(part, 50, 1e-3, seed=7, **values)
    assert_array_equal(again["q_BN"], rows["q_BN"][:50])
    assert not np.any(again["q_BN"] == other["q_BN"])


def test_what_is_measured_while_it_is_not_available_arrives_as_not_valid():
    t, q = turning(20)
    part = StarTracker(sample_time=T)
    point = Point(part, q_BN_true=q[0].as_quat(scalar_first=True), latency=2 * T)
    at = [e for v in part.parameters for e in v.elements()].index("available")
    rows = []
    for k, now in enumerate(t):
        point.u[:], point.t, point.p[at] = q[k].as_quat(scalar_first=True), now, float(not 5 <= k < 10)
        point.x = point.rates_flat()
        rows.append(point.outputs())
    assert [int(row["valid"]) for row in rows] == [0, 0] + 5 * [1] + 5 * [0] + 8 * [1]
    expected = [0, 0, 0, 1, 2, 3, 4] + 5 * [4] + list(range(10, 18))
    assert_array_equal([float(row["exposure_time"]) for row in rows], t[expected])


REFUSALS = {
    "boresight": ({"boresight_B": [0, 1, 1]}, "boresight_B has length 1.41421, a unit vector"),
    "cross": ({"cross_noise": -1e-5}, "cross_noise = -1e-05 rad: it must not be negative."),
    "roll": ({"roll_noise": -1e-5}, "roll_noise = -1e-05 rad: it must not be negative."),
    "early": ({"latency": -0.2}, "latency = -0.2 s: it must not be negative."),
    "fraction": ({"latency": 0.07}, "latency = 0.07 s is no whole number of samples of 0.2 s. Choose a sample_time"),
    "long": ({"latency": 0.8}, "latency = 0.8 s, but memory = 4 measurements last for less than 0.8 s. Build it with"),
    "rate": ({"samples_per_measurement": 1.5}, "samples_per_measurement = 1.5: it must be a whole number, 1 or more."),
    "none": ({"samples_per_measurement": 0}, "samples_per_measurement = 0: it must be a whole number, 1 or more."),
    "available": ({"available": 0.5}, "available = 0.5: it must be 0 or 1."),
}


@pytest.mark.parametrize("case", REFUSALS)
def test_refusals(case):
    values, message = REFUSALS[case]
    assert any(m.startswith(message) for m in Point(StarTracker(), **values).violated())


def test_a_memory_of_none_is_for_no_latency():
    assert Point(StarTracker(memory=0)).violated() == []
    assert len(Point(StarTracker(memory=0), latency=0.2).violated()) == 1


@pytest.mark.peers
def test_basilisk_star_tracker():
    """Basilisk's starTracker without noise: its case frame is turned from the body's by the misalignment."""
    pytest.importorskip("Basilisk")
    from Basilisk.architecture import messaging
    from Basilisk.simulation import starTracker

    tracker, state = starTracker.StarTracker(), messaging.SCStatesMsg()
    tracker.scStateInMsg.subscribeTo(state)
    tracker.dcm_CB = Rotation.from_rotvec(TURN).inv().as_matrix().tolist()
    tracker.Reset(0)
    _, q, rows = seen(StarTracker(sample_time=T), 30, misalignment=TURN)
    for k in range(30):
        payload = messaging.SCStatesMsgPayload()
        payload.sigma_BN = q[k].as_mrp()
        state.write(payload)
        tracker.UpdateState(0)
        expected = np.array(tracker.sensorOutMsg.read().qInrtl2Case)
        assert_allclose(rows["q_BN"][k] * np.sign(rows["q_BN"][k] @ expected), expected, atol=1e-9)
