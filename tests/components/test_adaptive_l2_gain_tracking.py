"""Angles that move in the orbit frame: the guidance that makes them, and the law that tracks them."""

import numpy as np
import pytest
from helpers import Point
from numpy.testing import assert_allclose
from published import as_in
from scipy.spatial.transform import Rotation

Guidance = as_in("xiao2011-l2gain-tracking", "guidance")
Tracking = as_in("xiao2011-l2gain-tracking", "controller")
Still = as_in("xiao2011-l2gain", "controller")

J = np.array([1200.0, 1000.0, 1500.0])
K, P1, KAPPA, C1, C2 = 5.0, 10.0, 13.0, 100.0, 100.0  # kappa = (0.2^2 + 1) / (2 0.2^2)
RATE = 1.078e-3
MOVING = dict(amplitude=[0.3, 0.5, -0.4], frequency=[0.02, 0.05, 0.03], phase=[0.1, 0.7, -0.4], bias=[0.2, -0.3, 0.1])


def rotation(q) -> Rotation:
    return Rotation.from_quat(q, scalar_first=True)


def from_angles(theta) -> Rotation:
    return Rotation.from_euler("ZYX", np.asarray(theta)[::-1])


def at(t, **values):
    return Point(Guidance(**(MOVING | values)), t=t).outputs()


@pytest.mark.parametrize("t", [0.0, 17.0, 400.0])
def test_angles_from_the_orbit_frame_are_sinusoids(t):
    y = at(t)
    wanted = np.array(MOVING["bias"]) + MOVING["amplitude"] * np.sin(
        np.array(MOVING["frequency"]) * t + MOVING["phase"]
    )
    orbit = Rotation.from_rotvec([0, -RATE * t, 0])
    assert_allclose(y["y_d"], wanted, atol=1e-14)
    assert_allclose((orbit.inv() * rotation(y["q_ON"])).magnitude(), 0, atol=1e-14)
    assert_allclose((rotation(y["q_RN"]).inv() * orbit * from_angles(wanted)).magnitude(), 0, atol=1e-14)
    assert_allclose(y["omega_ON_O"], [0, -RATE, 0])


@pytest.mark.parametrize("t", [3.0, 400.0])
def test_rates_are_the_derivatives(t):
    h = 1e-4
    y, before, after = at(t), at(t - h), at(t + h)
    turn = (rotation(before["q_RN"]).inv() * rotation(after["q_RN"])).as_rotvec() / (2 * h)
    assert_allclose(y["omega_RN_R"], turn, atol=1e-9)
    for name, of in (("omega_dot_RN_R", "omega_RN_R"), ("y_d_dot", "y_d"), ("y_d_ddot", "y_d_dot")):
        assert_allclose(y[name], (after[of] - before[of]) / (2 * h), atol=1e-9)


def test_without_motion_it_is_the_orbit_frame():
    y = at(50.0, amplitude=[0.0] * 3, bias=[0.0] * 3)
    assert_allclose(y["q_RN"], y["q_ON"], atol=1e-15)
    assert_allclose(y["omega_RN_R"], [0, -RATE, 0], atol=1e-18)
    assert_allclose(y["omega_dot_RN_R"], 0, atol=1e-18)


def test_an_orbit_below_the_surface_is_refused():
    messages = Point(Guidance(orbit_rate=2e-3)).violated()
    assert any("orbit_rate = 0.002 rad/s" in message for message in messages), messages


def random_case(seed):
    """A body in a turning frame O, with angles wanted, by scipy: inputs, angles and their rates."""
    rng = np.random.default_rng(seed)
    theta, theta_dot = rng.normal(size=3) * 0.1, rng.normal(size=3) * 0.01
    omega_ON_O, frame = rng.normal(size=3) * 1e-3, Rotation.random(random_state=seed)
    body, h = from_angles(theta), 1e-6
    turn = (from_angles(theta - h * theta_dot).inv() * from_angles(theta + h * theta_dot)).as_rotvec() / (2 * h)
    inputs = dict(
        q_ON=frame.as_quat(scalar_first=True),
        omega_ON_O=omega_ON_O,
        q_BN=(frame * body).as_quat(scalar_first=True),
        omega_BN_B=turn + body.inv().apply(omega_ON_O),
        y_d=theta + rng.normal(size=3) * 0.01,
        y_d_dot=rng.normal(size=3) * 0.01,
        y_d_ddot=rng.normal(size=3) * 1e-3,
        e1=rng.normal(size=3) * 0.05,
    )
    return inputs, theta, theta_dot, rng


@pytest.mark.parametrize("limit", [0.2, 1e9])
@pytest.mark.parametrize("seed", range(4))
def test_identity_of_the_proof_with_moving_angles(seed, limit):
    """V3' = -(k+1/2) z1^2 + e1 z1 - (p1+kappa) e2^2 + e2 T on each axis, z1 = theta - y_d, z2 with y_d'."""
    given, theta, theta_dot, rng = random_case(seed)
    point = Point(Tracking(), **given, torque_limit=[limit] * 3)
    y, rates, x = point.outputs(), point.rates(), point.states()
    T, e1 = rng.normal(size=3) * 0.1, given["e1"]
    z1, z1_dot = theta - given["y_d"], theta_dot - given["y_d_dot"]
    z2 = z1_dot + (K + 0.5) * z1
    e2 = z2 - e1
    assert_allclose(y["z1"], z1, atol=1e-12)
    assert_allclose(y["z2"], z2, atol=1e-8)
    X = np.exp(-(theta @ theta + theta_dot @ theta_dot) / 1.5**2) * np.ones(5)
    true_f, true_g = rng.uniform(size=(3, 5)), rng.uniform(size=(3, 5))
    acceleration = true_f @ X + true_g @ X / J * y["tau_command_B"] + T
    z2_dot = acceleration - given["y_d_ddot"] + (K + 0.5) * z1_dot
    parts = z1 * z1_dot + e2 * (z2_dot - rates["e1"])
    parts -= np.sum((true_f - x["W_f"]) * rates["W_f"], axis=1) / C1
    parts -= np.sum((true_g - x["W_g"]) * rates["W_g"], axis=1) / C2
    expected = -(K + 0.5) * z1**2 + e1 * z1 - (P1 + KAPPA) * e2**2 + e2 * T
    assert_allclose(parts, expected, atol=1e-7 * (np.abs(e2 * acceleration).max() + np.abs(expected).max()))


def test_on_the_wanted_path_it_asks_for_the_wanted_acceleration():
    given, theta, theta_dot, _ = random_case(9)
    given |= dict(y_d=theta, y_d_dot=theta_dot, e1=[0.0] * 3, W_f=np.zeros((3, 5)), torque_limit=[1e9] * 3)
    y = Point(Tracking(), **given).outputs()
    assert_allclose(y["u"] * y["g_hat"], given["y_d_ddot"], atol=1e-7)
    without = Point(Tracking(), **given, feedforward=0.0).outputs()
    assert np.abs(without["u"] * without["g_hat"]).min() > 10 * np.abs(given["y_d_ddot"]).min()


def test_at_rest_in_the_orbit_frame_it_is_the_law_without_motion():
    given, *_ = random_case(3)
    seen = {n: given[n] for n in ("q_BN", "omega_BN_B", "e1")}
    still = Point(Still(), **seen, q_RN=given["q_ON"], omega_RN_R=given["omega_ON_O"])
    zero = dict.fromkeys(("y_d", "y_d_dot", "y_d_ddot"), [0.0] * 3)
    moving = Point(Tracking(), **(given | zero))
    for name in ("tau_command_B", "u", "z2", "theta", "f_hat", "g_hat"):
        assert_allclose(moving.outputs()[name], still.outputs()[name], rtol=1e-14)
    assert_allclose(moving.rates_flat(), still.rates_flat(), rtol=1e-12)


def test_direct_feedthrough():
    table = Tracking().direct_feedthrough
    seen = ("q_BN", "omega_BN_B", "q_ON", "omega_ON_O", "y_d", "y_d_dot", "y_d_ddot")
    assert table["tau_command_B"] == seen
    assert table["z1"] == ("q_BN", "q_ON", "y_d")
    assert table["attitude_error"] == ("q_BN", "q_RN")


def test_a_feedforward_is_on_or_off():
    messages = Point(Tracking(), feedforward=0.5).violated()
    assert any("feedforward = 0.5: it must be 0" in message for message in messages), messages
