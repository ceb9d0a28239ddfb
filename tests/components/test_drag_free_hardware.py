"""Noise, thrusters, suspension and sensors of li2014."""

import casadi as ca
import numpy as np
import pytest
import sampling
from helpers import Point, numbers
from numpy.testing import assert_allclose
from published import as_in
from scipy.spatial.transform import Rotation
from scipy.stats import kstest

from components.mathematics import noise, slewing

ElectrostaticSuspension = as_in("li2014-printed-start-with-limits", "suspension")
Thrusters = as_in("li2014-printed-start-with-limits", "actuators")
ElectrostaticSensor = as_in("li2014-printed-start-with-limits", "cage_sensor")
StarTrackerGyro = as_in("li2014-printed-start-with-limits", "sensor")

N = 20000


def draws(function, seed, channel):
    n = ca.SX.sym("n")
    return ca.Function("f", [n], [function(n, seed, channel)]).map(N)(np.arange(N)[None]).full().ravel()


def samples(part, count, inputs=None, **values):
    """Of `count` samples, 0.1 s apart."""
    return sampling.samples(part, 0.1 * np.arange(count), inputs, **values)


def test_noise_is_uniform_normal_and_white():
    assert kstest(draws(noise.uniform, 7, 0), "uniform").pvalue > 1e-3
    a, b, c = (draws(noise.normal, seed, channel) for seed, channel in ((7, 0), (7, 1), (8, 0)))
    assert kstest(a, "norm").pvalue > 1e-3
    for other in (b, c, np.roll(a, 1), np.roll(a, 2), np.roll(a, 1) ** 2, np.roll(b, 1)):
        assert abs(np.corrcoef(a, other)[0, 1]) < 4 / np.sqrt(N)
    assert (a == draws(noise.normal, 7, 0)).all()


@pytest.mark.parametrize("seed", [-7, 0, 7, -(2**40), 2**40])
@pytest.mark.parametrize("first", [-N // 2, 0, 2**31])
def test_noise_is_that_of_whole_numbers(seed, first):
    """Python's integers, which do not round and whose remainders are never negative, give every bit of it."""
    n = ca.SX.sym("n")
    counters = range(first, first + N, 100)
    found = ca.Function("f", [n], [noise.uniform(n, seed, 3)]).map(len(counters))(np.array(counters)[None])
    for counter, u in zip(counters, found.full().ravel(), strict=True):
        x = 0
        for k in (counter, seed, 3, *noise.CONSTANTS):
            x = pow(x + k, 3, noise.MODULUS)
        assert u == (x + 0.5) / noise.MODULUS


def test_white_noise_before_time_zero_and_of_a_negative_seed():
    t = ca.SX.sym("t")
    f = ca.Function("f", [t], [noise.white(t, 0.1, -11.0, ca.DM([2.0]))])
    rows = f.map(N)(0.1 * np.arange(-N + 100, 100)[None]).full().ravel()
    assert kstest(rows / (2 * np.sqrt(5)), "norm").pvalue > 1e-3
    assert len(set(rows)) == N


def test_the_cube_is_a_permutation():
    """3 has no common divisor with m - 1, m prime: Fermat."""
    m = noise.MODULUS
    assert (m - 1) % 3 and all(m % k for k in range(2, int(m**0.5) + 1)) and m**2 < 2**53


def test_feedthrough():
    assert Thrusters().direct_feedthrough["f_S"] == ("f_command_S",)
    assert ElectrostaticSuspension().direct_feedthrough["tau_T"] == ("tau_command_T",)
    assert StarTrackerGyro().direct_feedthrough["q_BN"] == ("q_BN_true",)
    assert ElectrostaticSensor().direct_feedthrough["v_rel"] == ("r_rel_true",)


def test_quanta_stay_within_the_limits():
    """Random commands, limits, quanta: within the limits to the last bit, and a multiple of the quantum if one is."""
    y, q, low, high = (ca.SX.sym(n) for n in ("y", "q", "low", "high"))
    f = ca.Function("f", [y, q, low, high], [slewing.quantised(y, q, low, high)])
    rng = np.random.default_rng(1)
    limits = np.sort(rng.uniform(-1, 1, (2, N)), axis=0)
    wanted, quanta = rng.uniform(*limits), rng.uniform(0.2, 1, N) ** 3
    found = f.map(N)(wanted[None], quanta[None], limits[:1], limits[1:]).full().ravel()
    assert ((found >= limits[0]) & (found <= limits[1])).all()
    whole = np.abs(found / quanta - np.rint(found / quanta)) < 1e-9
    fits = np.floor(limits[1] / quanta) >= np.ceil(limits[0] / quanta)
    assert (whole == fits).all() and 0.1 < fits.mean() < 0.9
    far = np.where(fits, quanta, np.ptp(limits, axis=0) / 2)  # a whole quantum where the nearest multiple is outside
    assert (np.abs(found - wanted) <= far * (1 + 1e-9)).all()
    assert numbers(f(0.26, 0.1, -1.0, 0.3)) == 0.3  # 3 * 0.1 > 0.3
    assert numbers(f(0.123, 0.0, -1.0, 1.0)) == 0.123


def test_thrusters_have_limits_slew_and_quanta():
    quiet, command = dict(force_noise=[0, 0, 0]), [1.0, 1.0, -1.0]
    up = samples(Thrusters(), 200, f_command_S=command, tau_command_S=[1.0, -5e-4, 0], **quiet)
    down = samples(Thrusters(), 200, f_last=[20e-3, 0, 0], f_command_S=[-1.0, 0, 0], **quiet)
    for f in (up["f_S"], down["f_S"]):
        assert (f >= [1e-3, -0.65e-3, -0.65e-3]).all() and (f <= [20e-3, 0.65e-3, 0.65e-3]).all()
        assert np.abs(f[:, 0] / 12e-6 - np.rint(f[:, 0] / 12e-6)).max() < 1e-9
    assert_allclose(up["f_S"][-1], [1666 * 12e-6, 0.65e-3, -0.65e-3], rtol=1e-12)
    assert_allclose(down["f_S"][-1, 0], 84 * 12e-6, rtol=1e-12)  # the ion thruster cannot be switched off
    assert_allclose(up["f_S"][:70, 0], 1e-3 + 2.5e-3 * 0.1 * np.arange(1, 71), atol=6.1e-6)
    assert_allclose(up["tau_S"][-1], [1e-3, -5e-4, 0])
    assert up["saturated"][-1] == 3


def test_torque_of_the_thrusters_has_slew_and_quanta():
    command = dict(tau_command_S=[1.0, 1.0, -1.0], force_noise=[0, 0, 0])
    tau = samples(Thrusters(), 20, torque_rate=[1e-3, 0, 0], torque_quantum=[0, 3e-4, 0], **command)["tau_S"]
    assert_allclose(tau[:10, 0], 1e-4 * np.arange(1, 11), rtol=1e-12)
    assert_allclose(tau[-1], [1e-3, 9e-4, -1e-3], rtol=1e-12)
    assert np.abs(tau).max() <= 1e-3


def test_suspension_has_limits_slew_and_quanta():
    command = dict(tau_command_T=[1.0, -1.0, 4e-9])
    tau = samples(ElectrostaticSuspension(), 30, torque_rate=[0, 1e-8, 0], torque_quantum=[3e-9, 0, 3e-9], **command)
    assert np.abs(tau["tau_T"]).max() <= 2e-8
    assert_allclose(tau["tau_T"][-1], [18e-9, -2e-8, 3e-9])
    assert_allclose(tau["tau_T"][4], [18e-9, -5e-9, 3e-9])
    assert tau["saturated"][-1] == 2


def turns(q, true):
    """Rotation vectors from a true attitude to those that are seen."""
    return (Rotation.from_quat(true, scalar_first=True).inv() * Rotation.from_quat(q, scalar_first=True)).as_rotvec()


Q = [0.8, 0.0, 0.6, 0.0]
NOISY = {  # part, its inputs and densities, the noise in its outputs, the deviations that white noise up to 5 Hz has
    "Thrusters": (
        Thrusters,
        dict(f_command_S=[10e-3, 0, 0], f_last=[10e-3, 0, 0], force_quantum=[0, 0, 0])
        | dict(force_noise=[12e-6, 1e-6, 2e-6], torque_noise=[1e-6, 2e-6, 3e-6]),
        lambda y: (y["f_S"] - [10e-3, 0, 0], y["tau_S"]),
        np.array([12e-6, 1e-6, 2e-6, 1e-6, 2e-6, 3e-6]) * np.sqrt(5),
    ),
    "ElectrostaticSuspension": (
        ElectrostaticSuspension,
        dict(tau_command_T=[0, 1e-8, 0], torque_noise=[1e-10, 2e-10, 3e-10]),
        lambda y: (y["tau_T"] - [0, 1e-8, 0],),
        np.array([1e-10, 2e-10, 3e-10]) * np.sqrt(5),
    ),
    "StarTrackerGyro": (
        StarTrackerGyro,
        dict(q_BN_true=Q, omega_BN_B_true=[1e-3, 0, 0]),
        lambda y: (turns(y["q_BN"], Q), y["omega_BN_B"] - [1e-3, 0, 0]),
        np.array([1e-5] * 3 + [1e-6] * 3) * np.sqrt(5),
    ),
    "ElectrostaticSensor": (
        ElectrostaticSensor,
        dict(q_TS_true=Q, r_rel_true=[1e-3, 0, 0]),
        lambda y: (y["r_rel"] - [1e-3, 0, 0], turns(y["q_TS"], Q)),
        np.array([2e-9] * 3 + [150e-9] * 3) * np.sqrt(5),
    ),
}


@pytest.mark.parametrize("name", NOISY)
def test_noise_of_the_outputs(name):
    """Its density; new at every sample; another one on each axis, of each quantity and for each seed."""
    part, values, noise_of, deviation = NOISY[name]
    count = 4000
    a, b = (np.hstack(noise_of(samples(part(), count, **values, seed=seed))) for seed in (3.0, 4.0))
    assert_allclose(a.std(axis=0), deviation, rtol=4 / np.sqrt(2 * count))
    columns = a.shape[1]
    together = np.corrcoef(np.hstack([a[1:], a[:-1], b[1:]]).T)[:columns] - np.eye(columns, 3 * columns)
    assert np.abs(together).max() < 4 / np.sqrt(count)


def test_a_measured_attitude_is_a_unit_quaternion():
    y = samples(StarTrackerGyro(), 100, q_BN_true=Q)
    assert_allclose(np.linalg.norm(y["q_BN"], axis=1), 1, atol=1e-15)


QUIET = dict(position_noise=[0] * 3, attitude_noise=[0] * 3)
STILL = dict(r_rel_true=[0, 0, 0], q_TS_true=[1, 0, 0, 0])


@pytest.mark.parametrize("filter_time", [0.1, 0.37])
def test_velocity_filter_answers_a_step_of_the_velocity(filter_time):
    """From rest: 1 - exp(-t/T_f) of it, at the samples; the axis of the turn stays, so that its rate is that of th."""
    t, speed, spin = 0.1 * np.arange(60), np.array([1e-5, -2e-5, 0]), np.array([1e-4, 0, 2e-4])
    moving = {
        "r_rel_true": t[:, None] * speed,
        "q_TS_true": -Rotation.from_rotvec(t[:, None] * spin).as_quat(scalar_first=True),
    }
    y = samples(ElectrostaticSensor(), 60, moving, **STILL, **QUIET, filter_time=filter_time)
    part = 1 - np.exp(-t / filter_time)[:, None]
    assert_allclose(y["v_rel"], part * speed, rtol=1e-9, atol=1e-18)
    assert_allclose(y["omega_TS_T"], part * spin, rtol=1e-6, atol=1e-12)


def test_noise_goes_through_the_velocity_filter():
    """v = c/T (n - y), y independent of n with the variance c/(2 - c) of n: c/T sqrt(2/(2 - c)) of its deviation."""
    count, c = 4000, 1 - np.exp(-0.1 / 0.25)
    y = samples(ElectrostaticSensor(), count, **STILL, filter_time=0.25)
    gain = c / 0.1 * np.sqrt(2 / (2 - c)) * np.sqrt(5)
    assert_allclose(y["v_rel"].std(axis=0), 2e-9 * gain, rtol=4 / np.sqrt(2 * count))
    assert_allclose(y["omega_TS_T"].std(axis=0), 150e-9 * gain, rtol=4 / np.sqrt(2 * count))


@pytest.mark.parametrize(
    ("part", "values", "message"),
    [
        (Thrusters, dict(force_upper=[0, 1, 1]), "force_upper is below force_lower on an axis (difference -0.001 N)."),
        (Thrusters, dict(torque_limit=[1, -1, 1]), "torque_limit[2] = -1 N.m: it must not be negative."),
        (Thrusters, dict(force_rate=[-1, 0, 0]), "force_rate[1] = -1 N/s: it must not be negative."),
        (Thrusters, dict(torque_rate=[0, 0, -1]), "torque_rate[3] = -1 N.m/s: it must not be negative."),
        (Thrusters, dict(force_quantum=[-1, 0, 0]), "force_quantum[1] = -1 N: it must not be negative."),
        (Thrusters, dict(torque_quantum=[-1, 0, 0]), "torque_quantum[1] = -1 N.m: it must not be negative."),
        (Thrusters, dict(force_noise=[0, -1, 0]), "force_noise[2] = -1 N/Hz^(1/2): it must not be negative."),
        (Thrusters, dict(torque_noise=[0, -1, 0]), "torque_noise[2] = -1 N.m/Hz^(1/2): it must not be negative."),
        (
            Thrusters,
            dict(f_last=[0, 0, 0]),
            "f_last[1] = 0 N at the start: it must be within its limits, 0.001 to 0.02 N.",
        ),
        (
            Thrusters,
            dict(tau_last=[0, 2e-3, 0]),
            "tau_last[2] = 0.002 N.m at the start: it must be within its limits, -0.001 to 0.001 N.m.",
        ),
        (ElectrostaticSuspension, dict(torque_limit=[1, -1, 1]), "torque_limit[2] = -1 N.m"),
        (ElectrostaticSuspension, dict(torque_rate=[1, -1, 1]), "torque_rate[2] = -1 N.m/s"),
        (ElectrostaticSuspension, dict(torque_quantum=[1, -1, 1]), "torque_quantum[2] = -1 N.m: it must not"),
        (ElectrostaticSuspension, dict(torque_noise=[1, -1, 1]), "torque_noise[2] = -1 N.m/Hz^(1/2): it must not"),
        (
            ElectrostaticSuspension,
            dict(tau_last=[0, 0, -3e-8]),
            "tau_last[3] = -3e-08 N.m at the start: it must be within its limits, -2e-08 to 2e-08 N.m.",
        ),
        (StarTrackerGyro, dict(attitude_noise=[0, 0, -1]), "attitude_noise[3] = -1 rad/Hz^(1/2): it must not be"),
        (StarTrackerGyro, dict(rate_noise=[0, 0, -1]), "rate_noise[3] = -1 rad/s/Hz^(1/2): it must not be negative."),
        (ElectrostaticSensor, dict(position_noise=[0, 0, -1]), "position_noise[3] = -1 m/Hz^(1/2): it must not be"),
        (ElectrostaticSensor, dict(attitude_noise=[0, 0, -1]), "attitude_noise[3] = -1 rad/Hz^(1/2): it must not be"),
        (ElectrostaticSensor, dict(filter_time=0.0), "filter_time = 0 s: it must be positive."),
    ],
)
def test_bad_input(part, values, message):
    assert any(text.startswith(message) for text in Point(part(), **values).violated())
