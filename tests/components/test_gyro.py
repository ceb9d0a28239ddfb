"""Gyro: what it measures without errors, its random walks, its range, refusals; against Basilisk's imuSensor."""

import casadi as ca
import numpy as np
import pytest
from helpers import Point
from numpy.testing import assert_allclose, assert_array_equal
from sampling import samples, stepped
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

from components.catalog import CATALOG

Gyro = CATALOG["Gyro"]
T = 0.05
NOISE = {"angle_random_walk": [2e-4, 1e-4, 3e-4], "rate_random_walk": [1e-5, 3e-5, 2e-5]}
MISALIGNMENT, SCALE, BIAS = [0.02, -0.03, 0.01], [0.01, -0.02, 0.005], [1e-3, -2e-3, 5e-4]


def tumbling(count):
    """Times, rates and attitudes of a body whose rate turns and grows, by small turns about mean rates."""
    fine = 200
    t = T / fine * np.arange(fine * (count - 1) + 1)
    rate = lambda s: np.stack([0.3 * np.sin(s), 0.2 + 0.1 * s, -0.4 * np.cos(2 * s)], axis=-1)  # noqa: E731
    q, rows = Rotation.identity(), [Rotation.identity()]
    for k, middle in enumerate(rate(t[:-1] + T / fine / 2)):
        q = q * Rotation.from_rotvec(middle * T / fine)
        if (k + 1) % fine == 0:
            rows.append(q)
    return t[::fine], rate(t[::fine]), Rotation.concatenate(rows)


def test_direct_feedthrough():
    table = Gyro().direct_feedthrough
    assert set(table) == {"omega_BN_B", "angle_increment", "valid"}
    assert all(inputs == ("q_BN_true", "omega_BN_B_true") for inputs in table.values())


def test_without_errors_a_rate_gyro_shows_the_rate():
    t, omega, _ = tumbling(20)
    rows = samples(Gyro(sample_time=T), t, {"omega_BN_B_true": omega})
    assert_array_equal(rows["omega_BN_B"], omega)
    assert_array_equal(rows["angle_increment"], T * omega)
    assert rows["valid"].all()


def test_increments_of_an_integrating_gyro_add_up_to_the_attitude():
    """Turn after turn, whatever the motion between the samples: to the rounding of 60 products."""
    t, omega, q = tumbling(60)
    inputs = {"q_BN_true": -q.as_quat(scalar_first=True), "omega_BN_B_true": omega}
    rows = samples(Gyro(sample_time=T), t, inputs, integrating=1)
    found = q[0]
    for k in range(1, len(t)):
        found = found * Rotation.from_rotvec(rows["angle_increment"][k])
        assert (found.inv() * q[k]).magnitude() < 1e-14 * (k + 10)
    assert_allclose(rows["omega_BN_B"][0], omega[0], rtol=1e-13)  # no interval before it


def test_bias_scale_and_misalignment():
    """By scipy's rotation: a gyro that is turned by a rotation vector sees the components in its own axes."""
    t, omega, _ = tumbling(10)
    values = dict(bias=BIAS, scale_error=SCALE, misalignment=MISALIGNMENT)
    rows = samples(Gyro(sample_time=T), t, {"omega_BN_B_true": omega}, **values)
    seen = Rotation.from_rotvec(MISALIGNMENT).inv().apply(omega)
    assert_allclose(rows["omega_BN_B"], seen * (1 + np.array(SCALE)) + BIAS, rtol=1e-14, atol=1e-16)
    assert_array_equal(rows["bias"], np.tile(BIAS, (10, 1)))


def test_range():
    t, omega, _ = tumbling(60)
    rows = samples(Gyro(sample_time=T), t, {"omega_BN_B_true": omega}, range=0.35)
    assert_array_equal(rows["omega_BN_B"], np.clip(omega, -0.35, 0.35))
    assert_array_equal(rows["valid"], np.abs(omega).max(axis=1) < 0.35)
    assert 0 < rows["valid"].mean() < 1


def test_the_same_seed_gives_the_same_noise():
    t = T * np.arange(50)
    one, again, other = (samples(Gyro(sample_time=T), t, seed=s, **NOISE)["omega_BN_B"] for s in (1, 1, 2))
    assert_array_equal(one, again)
    assert not np.any(one == other)


def test_allan_variance():
    """sigma_v^2/tau + sigma_u^2 tau/3, exact for the two walks. From n means it has a relative deviation (3/n)^1/2."""
    count = 2**15
    part = Gyro(sample_time=T)
    rate = samples(part, T * np.arange(count), **NOISE)["omega_BN_B"]
    for length in (1, 4, 32, 256):
        means = rate.reshape(-1, length, 3).mean(axis=1)
        variance = (np.diff(means, axis=0) ** 2).mean(axis=0) / 2
        tau = length * T
        expected = np.array(NOISE["angle_random_walk"]) ** 2 / tau + np.array(NOISE["rate_random_walk"]) ** 2 * tau / 3
        assert np.abs(variance / expected - 1).max() < 4 * np.sqrt(3 / len(means)), tau


def test_walks_of_many_gyros():
    """Covariance of angle and bias after a time t, over the seeds, by the integrals of Wiener processes."""
    runs, count = 400, 40
    part = Gyro(sample_time=T)
    seeds = [Point(part, seed=s, **NOISE) for s in range(runs)]
    flight = ca.Function("flight", *_sum(part, count)).map(runs)
    found = flight(np.array([s.x for s in seeds]).T, np.array([s.p for s in seeds]).T)
    (angle, bias), t = (row.full().T for row in found), count * T
    v, u = (np.array(NOISE[n]) ** 2 for n in ("angle_random_walk", "rate_random_walk"))
    for axis in range(3):
        root = np.linalg.cholesky(
            [
                [v[axis] * t + u[axis] * t**3 / 3, u[axis] * t**2 / 2],
                [u[axis] * t**2 / 2, u[axis] * t],
            ]
        )
        normal = np.linalg.solve(root, np.stack([angle[:, axis], bias[:, axis]]))
        low, high = chi2.ppf([5e-5, 1 - 5e-5], runs)  # 15 comparisons in all
        assert ((normal**2).sum(axis=1) > low).all() and ((normal**2).sum(axis=1) < high).all()
        assert abs(normal[0] @ normal[1]) < 4 * np.sqrt(runs)
    assert abs(np.corrcoef(angle.T) - np.eye(3)).max() < 4 / np.sqrt(runs)


def _sum(part, count):
    """(x, p) -> sum of the increments of `count` samples, and the bias at the end."""
    step = stepped(part)
    x, p = ca.MX.sym("x", step.size_in(0)), ca.MX.sym("p", step.size_in(3))
    u = Point(part).u
    _, rows = step.mapaccum(count)(x, T * np.arange(count)[None], np.tile(u, (count, 1)).T, ca.repmat(p, 1, count))
    names = [e for v in (*part.states, *part.outputs_declared) for e in v.elements()]
    angle = [names.index(f"angle_increment[{i}]") for i in (1, 2, 3)]
    bias = [names.index(f"bias[{i}]") for i in (1, 2, 3)]
    return [x, p], [ca.sum2(rows[angle, :]), rows[bias, count - 1]]


REFUSALS = {
    "angle": ({"angle_random_walk": [0, -1, 0]}, "angle_random_walk[2] = -1 rad/s/Hz^(1/2): it must not be negative."),
    "rate": ({"rate_random_walk": [0, 0, -1]}, "rate_random_walk[3] = -1 rad/s2/Hz^(1/2): it must not be negative."),
    "range": ({"range": 0.0}, "range = 0 rad/s: it must be positive."),
    "option": ({"integrating": 2.0}, "integrating = 2: it must be 0 or 1."),
}


@pytest.mark.parametrize("case", REFUSALS)
def test_refusals(case):
    values, message = REFUSALS[case]
    assert Point(Gyro(), **values).violated() == [message]


@pytest.mark.peers
@pytest.mark.parametrize("integrating", [0, 1])
def test_basilisk_imu(integrating):
    """Rate and increment of Basilisk's imuSensor, which scales the bias too: (1 + k) (C w + b)."""
    pytest.importorskip("Basilisk")
    from Basilisk.architecture import messaging
    from Basilisk.simulation import imuSensor
    from Basilisk.utilities import macros

    t, omega, q = tumbling(20)
    imu, state = imuSensor.ImuSensor(), messaging.SCStatesMsg()
    imu.scStateInMsg.subscribeTo(state)
    imu.senRotBias, imu.gyroScale, imu.senRotMax = BIAS, list(1 + np.array(SCALE)), 0.5
    imu.dcm_PB = Rotation.from_rotvec(MISALIGNMENT).inv().as_matrix()
    imu.Reset(0)
    output, expected = imu.sensorOutMsg, []
    for k, now in enumerate(t):
        payload = messaging.SCStatesMsgPayload()
        payload.sigma_BN, payload.omega_BN_B = q[k].as_mrp(), omega[k]
        state.write(payload, macros.sec2nano(now))
        imu.UpdateState(macros.sec2nano(now))
        read = output.read()
        expected.append(np.array(read.DRFramePlatform) / T if integrating else read.AngVelPlatform)
    inputs = {"q_BN_true": q.as_quat(scalar_first=True), "omega_BN_B_true": omega}
    values = dict(bias=BIAS * (1 + np.array(SCALE)), scale_error=SCALE, misalignment=MISALIGNMENT, range=0.5)
    rows = samples(Gyro(sample_time=T), t, inputs, integrating=integrating, **values)
    # Basilisk limits an increment where the rate of its instant is at the limit: compare where neither is.
    free = np.abs(rows["omega_BN_B"]).max(axis=1) < 0.5 if integrating else np.ones(len(t), bool)
    free &= np.arange(len(t)) > 0  # Basilisk's first message is empty
    assert_allclose(rows["omega_BN_B"][free], np.array(expected)[free], rtol=1e-9, atol=1e-12)
    assert free.sum() > 10
