"""Noise, thrusters, suspension and sensors of li2014."""

import casadi as ca
import numpy as np
import pytest
from helpers import Point, numbers, split
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation
from scipy.stats import kstest

from components.actuators.electrostatic_suspension import ElectrostaticSuspension
from components.actuators.thrusters import Thrusters
from components.attitude import noise
from components.estimators.electrostatic_sensor import ElectrostaticSensor
from components.estimators.star_tracker_gyro import StarTrackerGyro

N = 20000


def draws(function, seed, channel):
    n = ca.SX.sym("n")
    return ca.Function("f", [n], [function(n, seed, channel)]).map(N)(np.arange(N)[None]).full().ravel()


def samples(part, count, inputs=None, **values):
    """Outputs after each of `count` samples; inputs: name -> rows."""
    point = Point(part, **values)
    x, rows = point.x, []
    at = np.cumsum([0, *(v.size for v in part.inputs)])
    for k in range(count):
        u = point.u.copy()
        for (v, a), b in zip(zip(part.inputs, at, strict=False), at[1:], strict=True):
            if inputs and v.name in inputs:
                u[a:b] = inputs[v.name][k]
        x = numbers(part.functions.update(0.1 * k, x, u, point.p, point.c))
        rows.append(numbers(part.functions.outputs(0.1 * k, x, u, point.p, point.c, [])))
    return split(part.outputs_declared, np.array(rows))


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


def test_thrusters_have_limits_slew_and_quanta():
    quiet = dict(force_noise=[0, 0, 0], force_quantum=[12e-6, 0, 0])
    f = samples(Thrusters(), 200, f_command_S=[1.0, 1.0, -1.0], tau_command_S=[1.0, -5e-4, 0], **quiet)
    assert_allclose(f["f_S"][-1, 1:], [0.65e-3, -0.65e-3])
    assert_allclose(f["tau_S"][-1], [1e-3, -5e-4, 0])
    assert_allclose(f["f_S"][-1, 0], 20e-3, atol=6.1e-6)
    assert_allclose(f["f_S"][:70, 0], 2.5e-3 * 0.1 * np.arange(1, 71), atol=6.1e-6)
    assert np.abs(f["f_S"][:, 0] / 12e-6 - np.rint(f["f_S"][:, 0] / 12e-6)).max() < 1e-9
    assert f["saturated"][-1] == 3
    least = samples(Thrusters(), 100, **quiet)["f_S"][-1, 0]
    assert least == pytest.approx(1e-3, abs=6.1e-6)  # the ion thruster cannot be switched off


def test_noise_of_the_thrusters_has_its_density():
    f = samples(Thrusters(), 4000, f_command_S=[10e-3, 0, 0], force_quantum=[0, 0, 0])["f_S"][100:, 0]
    assert_allclose(f.std(), 12e-6 * np.sqrt(5), rtol=0.05)  # one-sided, up to 5 Hz


def test_suspension_limits():
    y = samples(ElectrostaticSuspension(), 30, tau_command_T=[1.0, -1.0, 3e-9], torque_rate=[0, 1e-8, 0])
    assert_allclose(y["tau_T"][-1], [2e-8, -2e-8, 3e-9])
    assert_allclose(y["tau_T"][4], [2e-8, -5e-9, 3e-9])
    assert y["saturated"][-1] == 2


def test_star_tracker_and_gyro():
    q = [0.8, 0.0, 0.6, 0.0]
    y = samples(StarTrackerGyro(), 3000, q_BN_true=q, omega_BN_B_true=[1e-3, 0, 0])
    seen = Rotation.from_quat(q, scalar_first=True).inv() * Rotation.from_quat(y["q_BN"], scalar_first=True)
    assert_allclose(seen.as_rotvec().std(axis=0), 1e-5 * np.sqrt(5), rtol=0.05)
    assert_allclose((y["omega_BN_B"] - [1e-3, 0, 0]).std(axis=0), 1e-6 * np.sqrt(5), rtol=0.05)
    assert_allclose(np.linalg.norm(y["q_BN"], axis=1), 1, atol=1e-15)


def test_electrostatic_sensor_and_its_velocity_filter():
    t, speed, spin = 0.1 * np.arange(60), np.array([1e-5, -2e-5, 0]), np.array([1e-4, 0, 2e-4])
    moving = {
        "r_rel_true": t[:, None] * speed,
        "q_TS_true": Rotation.from_rotvec(t[:, None] * spin).as_quat(scalar_first=True),
    }
    still = dict(r_rel_true=[0, 0, 0], q_TS_true=[1, 0, 0, 0])
    y = samples(ElectrostaticSensor(), 60, moving, **still, position_noise=[0] * 3, attitude_noise=[0] * 3)
    assert_allclose(y["v_rel"][-1], speed, rtol=1e-9, atol=1e-18)
    assert_allclose(y["omega_TS_T"][-1], spin, rtol=1e-6, atol=1e-12)
    noisy = samples(ElectrostaticSensor(), 3000, **still)
    assert_allclose(noisy["r_rel"].std(axis=0), 2e-9 * np.sqrt(5), rtol=0.05)
    angles = Rotation.from_quat(noisy["q_TS"], scalar_first=True).as_rotvec()
    assert_allclose(angles.std(axis=0), 150e-9 * np.sqrt(5), rtol=0.05)


@pytest.mark.parametrize(
    ("part", "values", "message"),
    [
        (Thrusters, dict(force_upper=[0, 1, 1]), "force_upper is below force_lower on an axis (difference -0.001 N)."),
        (Thrusters, dict(torque_limit=[1, -1, 1]), "torque_limit has an element -1 N.m: it must not be negative."),
        (ElectrostaticSuspension, dict(torque_limit=[1, -1, 1]), "torque_limit has an element -1 N.m"),
        (ElectrostaticSensor, dict(filter_time=0.0), "filter_time = 0 s: it must be positive."),
    ],
)
def test_bad_input(part, values, message):
    assert any(text.startswith(message) for text in Point(part(), **values).violated())
