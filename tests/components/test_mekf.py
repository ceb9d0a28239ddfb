"""MEKF: its covariance against closed forms, its errors against its covariance, delay, first fix, refusals."""

import casadi as ca
import numpy as np
import pytest
from helpers import Point
from numpy.testing import assert_allclose, assert_array_equal
from sampling import samples, stepped
from scipy.linalg import solve_discrete_are
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

from components.catalog import CATALOG

MEKF, Gyro, StarTracker = (CATALOG[name] for name in ("MEKF", "Gyro", "StarTracker"))
T, N = 0.1, 5  # of the gyro, and samples of it between two measurements
WALKS = {"angle_random_walk": [1e-4, 2e-4, 1.5e-4], "rate_random_walk": [1e-5, 5e-6, 2e-5]}
TRACKER = {"boresight_B": np.array([2.0, -1.0, 2.0]) / 3, "cross_noise": 1e-4, "roll_noise": 8e-4}
SIGMA_0 = {"sigma_q_BN_start": 0.02, "sigma_bias_start": 2e-3}


def scalar_first(rotation):
    return rotation.as_quat(scalar_first=True)


def test_direct_feedthrough():
    table, every = MEKF().direct_feedthrough, tuple(v.name for v in MEKF().inputs)
    assert table["q_BN"] == table["omega_BN_B"] == table["bias"] == every
    assert table["valid"] == ("exposure_time", "valid_measured")


def settled(count, **values):
    """The covariance after `count` samples at rest, the last with a measurement: 6 x 6."""
    t = T * np.arange(count)
    inputs = {"exposure_time": t - t % (N * T), "valid_measured": np.ones(count)}
    inputs["exposure_time"] = np.repeat(t[::N], N)[:count]
    rows = samples(MEKF(sample_time=T), t, inputs, **values)
    P = np.block([[rows["P_attitude"][-1], rows["P_cross"][-1]], [rows["P_cross"][-1].T, rows["P_bias"][-1]]])
    return P, rows


def walk_covariance(v, u, tau):
    """Covariance of angle and bias errors after tau, three axes: integrals of two Wiener processes."""
    v, u = np.diag(np.square(v)), np.diag(np.square(u))
    return np.block([[v * tau + u * tau**3 / 3, -u * tau**2 / 2], [-u * tau**2 / 2, u * tau]])


def test_steady_covariance_of_one_axis_is_farrenkopfs():
    """Isotropic, at rest: after an update sigma_n^2 (1 - 1/zeta^2), before one sigma_n^2 (zeta^2 - 1)."""
    v, u, n, tau = 1e-4, 1e-5, 3e-4, N * T
    values = dict(angle_random_walk=v, rate_random_walk=u, cross_noise=n, roll_noise=n, **SIGMA_0)
    P, rows = settled(N * 400 + 1, **values)
    S_u, S_v = u * tau**1.5 / n, v * tau**0.5 / n
    gamma = np.sqrt(1 + S_v**2 / 4 + S_u**2 / 48)
    zeta = gamma + S_u / 4 + 0.5 * np.sqrt(2 * gamma * S_u + S_v**2 + S_u**2 / 3)
    # The error of P falls by (1/zeta^2)^2 or faster from measurement to measurement: nothing is left of it after 400
    assert zeta**-1600 < 1e-16
    assert_allclose(np.diag(P)[:3], n**2 * (1 - zeta**-2), rtol=1e-10)
    before = rows["P_attitude"][-2] + T**2 * rows["P_bias"][-2] - 2 * T * rows["P_cross"][-2]
    before = np.diag(before) + v**2 * T + u**2 * T**3 / 3
    assert_allclose(before, n**2 * (zeta**2 - 1), rtol=1e-10)
    assert_allclose(rows["sigma_q_BN"][-1], np.sqrt(np.diag(P)[:3]), rtol=1e-15)
    assert_allclose(rows["sigma_bias"][-1], np.sqrt(np.diag(P)[3:]), rtol=1e-15)


def test_steady_covariance_of_three_axes_is_that_of_the_riccati_equation():
    """A skew boresight couples the axes; scipy's solution from one measurement to the next."""
    tau, one = N * T, np.eye(3)
    F = np.block([[one, -tau * one], [0 * one, one]])
    H = np.hstack([one, 0 * one])
    b = TRACKER["boresight_B"]
    R = TRACKER["cross_noise"] ** 2 * (one - np.outer(b, b)) + TRACKER["roll_noise"] ** 2 * np.outer(b, b)
    unit = np.repeat([1e-4, 1e-5], 3)  # rad, rad/s: of one size, as scipy wants it
    scaled = walk_covariance(*WALKS.values(), tau) / np.outer(unit, unit)
    F_scaled, R_scaled = F * unit / unit[:, None], R / unit[0] ** 2
    before = solve_discrete_are(F_scaled.T, H.T, scaled, R_scaled) * np.outer(unit, unit)
    K = before @ H.T @ np.linalg.inv(H @ before @ H.T + R)
    after = before - K @ H @ before
    # what is left of the start falls by the square of this from measurement to measurement
    slowest = np.abs(np.linalg.eigvals((np.eye(6) - K @ H) @ F)).max()
    P, _ = settled(N * int(np.ceil(np.log(1e-13) / np.log(slowest) / 2)) + 1, **WALKS, **TRACKER, **SIGMA_0)
    scale = np.sqrt(np.outer(np.diag(after), np.diag(after)))
    assert_allclose(P / scale, after / scale, atol=1e-9)
    assert np.abs(after[0, 1] / scale[0, 1]) > 0.1


def tumbling(count):
    """Attitudes every T of a body that turns at a constant rate about an axis that itself turns in inertial space."""
    t = T * np.arange(count)
    inner = Rotation.from_rotvec(np.outer(t, [0.02, 0.05, -0.03]))
    outer = Rotation.from_rotvec(np.outer(np.sin(0.05 * t), [0.3, -0.2, 0.4]))
    return t, outer * inner


def flights(runs, count, late=0, told=True):
    """Errors (runs, count, 6) and covariances (runs, count, 6, 6) of filters with sensors of their own seeds.

    late: latency of the trackers in samples; told: their filters get the time of exposure, else that of arrival.
    """
    t, q = tumbling(count)
    true, walks = scalar_first(q), dict(WALKS)
    sensors = dict(gyro=Gyro(sample_time=T), tracker=StarTracker(sample_time=T), filter=MEKF(sample_time=T))
    rng, starts, numbers = np.random.default_rng(5), [], []
    for run in range(runs):
        theta, beta = rng.normal(size=(2, 3)) * np.array([[0.02], [2e-3]])
        estimate = scalar_first(q[0] * Rotation.from_rotvec(-theta))
        gyro = Point(sensors["gyro"], q_BN_true=true[0], integrating=1, seed=run, bias=beta, **walks)
        mounted = dict(samples_per_measurement=N, latency=late * T, **TRACKER)
        tracker = Point(sensors["tracker"], q_BN_true=true[0], seed=runs + run, **mounted)
        filtered = Point(sensors["filter"], q_estimate=estimate, **walks, **TRACKER, **SIGMA_0)
        starts.append(np.concatenate([point.x for point in (gyro, tracker, filtered)]))
        numbers.append(np.concatenate([point.p for point in (gyro, tracker, filtered)]))
    step = loop(sensors, late * T * (not told))
    x, p = ca.MX.sym("x", step.size_in(0)), ca.MX.sym("p", step.size_in(3))
    _, rows = step.mapaccum(count)(x, t[None], true.T, ca.repmat(p, 1, count))
    found = ca.Function("flight", [x, p], [rows]).map(runs)(np.array(starts).T, np.array(numbers).T).full()
    found = found.T.reshape(runs, count, -1)
    estimate = Rotation.from_quat(found[..., :4].reshape(-1, 4), scalar_first=True)
    repeated = Rotation.from_quat(np.tile(true, (runs, 1)), scalar_first=True)
    theta = (estimate.inv() * repeated).as_rotvec().reshape(runs, count, 3)
    errors = np.concatenate([theta, found[..., 4:7]], axis=-1)
    attitude, cross, bias = (found[..., k : k + 9].reshape(runs, count, 3, 3) for k in (7, 16, 25))
    return errors, np.block([[attitude, cross], [cross.swapaxes(-1, -2), bias]])


def loop(sensors, added):
    """(x, t, q_true, p) -> x, [q, bias error, P] after one sample of gyro, tracker and filter, in this order."""
    f = {name: stepped(part) for name, part in sensors.items()}
    x, p = ([ca.MX.sym(n + name, f[name].size_in(k)) for name in f] for n, k in (("x", 0), ("p", 3)))
    t, q = ca.MX.sym("t"), ca.MX.sym("q", 4)

    def rows(name, values):
        names = [e for v in (*sensors[name].states, *sensors[name].outputs_declared) for e in v.elements()]
        return lambda *wanted: ca.vertcat(*(values[i] for w in wanted for i, n in enumerate(names) if wanted_by(w, n)))

    wanted_by = lambda w, n: n == w or n.startswith(w + "[")  # noqa: E731
    after_g, gyro = f["gyro"](x[0], t, ca.vertcat(q, ca.MX.zeros(3)), p[0])
    after_t, tracker = f["tracker"](x[1], t, q, p[1])
    seen, rate = rows("tracker", tracker), rows("gyro", gyro)
    measured = ca.vertcat(seen("q_BN"), seen("exposure_time") + added, seen("valid"), rate("omega_BN_B"))
    after_f, filtered = f["filter"](x[2], t, measured, p[2])
    estimate = rows("filter", filtered)
    shown = ca.vertcat(estimate("q_BN"), rate("bias") - estimate("bias"), estimate("P_attitude", "P_cross", "P_bias"))
    return ca.Function("loop", [ca.vertcat(*x), t, q, ca.vertcat(*p)], [ca.vertcat(after_g, after_t, after_f), shown])


def chi_squares(errors, P):
    """Sum over the runs of e^T P^-1 e, at each sample."""
    return np.einsum("rki,rkij,rkj->k", errors, np.linalg.inv(P), errors)


AT = [4, 20, 100, 103, 250, 400, 402, 600]  # samples, with and without a new measurement


@pytest.mark.parametrize("late", [0, 3])
def test_errors_are_those_of_the_covariance(late):
    """NEES of 60 flights of a turning body within the bounds of chi-square, from the start on; 16 comparisons."""
    errors, P = flights(60, 601, late)
    low, high = chi2.ppf([1e-4, 1 - 1e-4], 6 * 60)
    nees = chi_squares(errors, P)[AT]
    assert (nees > low).all() and (nees < high).all(), nees
    sigma = np.sqrt(np.einsum("rkii->rki", P))
    assert (np.abs(errors) < 3 * sigma)[:, 1:].mean() > 0.99  # of normal errors 0.9973, which are correlated in time
    assert (sigma[:, -1, :3] < 3e-4).all() and (sigma[:, -1, 3:] < 2e-4).all()


def test_a_delay_that_the_filter_is_not_told_shows():
    errors, P = flights(20, 301, late=3, told=False)
    assert chi_squares(errors, P)[300] > 10 * 6 * 20


def test_a_late_measurement_at_a_constant_rate_is_as_good_as_one_in_time():
    """Without noise and memory: the attitude is exact after the first of it, and stays."""
    count, late, w = 60, 3, np.array([0.1, -0.2, 0.05])
    t = T * np.arange(count)
    q = Rotation.from_rotvec(np.outer(t, w))
    exposure = np.repeat(t[::N], N)
    arrived = np.concatenate([np.zeros(late), exposure])[:count]
    shown = Rotation.from_rotvec(np.outer(arrived, w))
    inputs = {
        "q_BN_measured": scalar_first(shown),
        "exposure_time": arrived,
        "valid_measured": t >= late * T - 1e-9,
        "omega_BN_B_measured": np.tile(w, (count, 1)),
    }
    values = dict(cross_noise=1e-9, roll_noise=1e-9, sigma_q_BN_start=1.0, sigma_bias_start=1e-12)
    start = scalar_first(Rotation.from_rotvec([0.3, -0.2, 0.5]))
    rows = samples(MEKF(sample_time=T, memory=0), t, inputs, q_estimate=start, **values)
    error = (q.inv() * Rotation.from_quat(rows["q_BN"], scalar_first=True)).magnitude()
    assert_array_equal(rows["valid"], inputs["valid_measured"])
    assert error[late - 1] > 0.5 and error[late:].max() < 1e-12
    assert_allclose(rows["omega_BN_B"], inputs["omega_BN_B_measured"], atol=1e-10)


def test_what_is_not_new_or_not_valid_is_not_used():
    """Then it turns with the gyro alone, by scipy; of valid measurements the same exposure counts once."""
    count, w, away = 30, np.array([0.2, 0.1, -0.3]), scalar_first(Rotation.from_rotvec([0.1, 0, 0]))
    t = T * np.arange(count)
    inputs = {"omega_BN_B_measured": np.tile(w, (count, 1)), "q_BN_measured": np.tile(away, (count, 1))}
    part = MEKF(sample_time=T)
    blind = samples(part, t, inputs | {"exposure_time": t}, bias_estimate=[0.01, 0, 0])
    expected = Rotation.from_rotvec(np.outer(t, w - [0.01, 0, 0]))
    assert (expected.inv() * Rotation.from_quat(blind["q_BN"], scalar_first=True)).magnitude().max() < 1e-13
    assert not blind["valid"].any() and not blind["residual"].any()
    assert (np.diff(blind["sigma_q_BN"], axis=0) > 0).all()
    once = samples(part, t, inputs | {"exposure_time": np.zeros(count), "valid_measured": np.ones(count)})
    assert once["valid"].all() and (np.diff((once["sigma_q_BN"] ** 2).sum(axis=1)) > 0).all()
    assert_allclose(once["residual"], np.tile([0.1, 0, 0], (count, 1)), rtol=1e-12, atol=1e-15)


def test_a_first_fix_from_anywhere():
    """Knowing nothing (10 rad), it takes the first measurement, up to R / (P + R) = 2.5e-11 of half a turn."""
    far = Rotation.from_rotvec([0.0, 3.0, 0.0])
    inputs = {"q_BN_measured": scalar_first(far)[None], "exposure_time": np.zeros(1), "valid_measured": np.ones(1)}
    rows = samples(MEKF(sample_time=T), np.zeros(1), inputs, sigma_q_BN_start=10.0, roll_noise=5e-5)
    found = Rotation.from_quat(rows["q_BN"], scalar_first=True)
    assert (far.inv() * found).magnitude()[0] < 3 * 2.6e-11
    assert_allclose(rows["sigma_q_BN"], np.full((1, 3), 5e-5), rtol=1e-10)


REFUSALS = {
    "cross": ({"cross_noise": 0.0}, "cross_noise = 0 rad: it must be positive."),
    "roll": ({"roll_noise": 0.0}, "roll_noise = 0 rad: it must be positive."),
    "attitude": ({"sigma_q_BN_start": 0.0}, "sigma_q_BN_start = 0 rad: it must be positive."),
    "bias": ({"sigma_bias_start": 0.0}, "sigma_bias_start = 0 rad/s: it must be positive."),
    "walk": ({"angle_random_walk": -1e-5}, "angle_random_walk[1] = -1e-05 rad/s/Hz^(1/2): it must not be negative."),
    "boresight": ({"boresight_B": [0, 0, 2.0]}, "boresight_B has length 2, a unit vector (within 0.001) is needed."),
}


@pytest.mark.parametrize("case", REFUSALS)
def test_refusals(case):
    values, message = REFUSALS[case]
    assert any(m.startswith(message) for m in Point(MEKF(), **values).violated())
