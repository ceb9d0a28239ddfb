"""Adaptive L2-gain: the identity of its proof, what keeps it from a division by zero, gimbal lock, refusals."""

import numpy as np
import pytest
from helpers import Point
from numpy.testing import assert_allclose
from published import as_in
from scipy.spatial.transform import Rotation

AdaptiveL2Gain = as_in("xiao2011-l2gain", "controller")
FlexibleSpacecraft = as_in("xiao2011-l2gain", "plant")


DEGREE = np.pi / 180
J = np.array([1200.0, 1000.0, 1500.0])
K, P1, KAPPA, C1, C2 = 5.0, 10.0, 13.0, 100.0, 100.0  # kappa = (0.2^2 + 1) / (2 0.2^2)
NO_LIMIT = 1e9


def quaternion(degrees) -> np.ndarray:
    roll, pitch, yaw = degrees
    return Rotation.from_euler("ZYX", [yaw, pitch, roll], degrees=True).as_quat(scalar_first=True)


def rates_of_angles(theta, omega) -> np.ndarray:
    """theta' of roll, pitch, yaw from the body rate, by differences of scipy's angles."""
    h = 1e-5
    here = Rotation.from_euler("ZYX", theta[::-1])
    sides = [(here * Rotation.from_rotvec(h * s * omega)).as_euler("ZYX")[::-1] for s in (-1, 1)]
    return (sides[1] - sides[0]) / (2 * h)


def test_direct_feedthrough():
    table = AdaptiveL2Gain().direct_feedthrough
    seen = ("q_BN", "omega_BN_B", "q_RN", "omega_RN_R")
    assert table["tau_command_B"] == table["u"] == seen
    assert table["theta"] == ("q_BN", "q_RN")


def test_start_weights_are_those_of_the_paper_file():
    """parameters.json: W_f drawn first, then W_g; corners of both."""
    values = {s.name: s.start for s in AdaptiveL2Gain().states}
    assert_allclose(values["W_f"][[0, 2], [0, 4]], [0.7475000009190534, 0.5767714251271113], rtol=1e-15)
    assert_allclose(values["W_g"][[0, 2], [0, 4]], [0.08930874724859783, 0.8115711173810778], rtol=1e-15)


@pytest.mark.parametrize("normalised", [1.0, 0.0])
@pytest.mark.parametrize("limit", [0.2, NO_LIMIT])
@pytest.mark.parametrize("seed", range(4))
def test_identity_of_the_proof(seed, limit, normalised):
    """V3' = -(k+1/2) z1^2 + e1 z1 - (p1+kappa) e2^2 + e2 T on each axis, for any true f, g and disturbance.

    The true acceleration is theta'' = f + g u_out + T with f = W_f* X, g = W_g* X / J_n; V3' is put together from the
    component's own rates, z1' and z2'.
    """
    rng = np.random.default_rng(seed)
    omega_RN = rng.normal(size=3) * 1e-3
    theta, omega = rng.normal(size=3) * 0.02, rng.normal(size=3) * 0.01
    e1, T = rng.normal(size=3) * 0.05, rng.normal(size=3) * 0.1
    body = Rotation.from_euler("ZYX", theta[::-1])
    values = dict(q_BN=body.as_quat(scalar_first=True), omega_BN_B=omega, omega_RN_R=omega_RN)
    point = Point(AdaptiveL2Gain(), **values, e1=e1, torque_limit=limit, normalised=normalised)
    y, rates, x = point.outputs(), point.rates(), point.states()
    theta_dot = rates_of_angles(theta, omega - body.inv().apply(omega_RN))
    z1, z2 = theta, theta_dot + (K + 0.5) * theta
    e2 = z2 - e1
    assert_allclose(y["theta"], theta, atol=1e-14)
    assert_allclose(y["z2"], z2, atol=1e-9)
    X = np.exp(-(theta @ theta + theta_dot @ theta_dot) / 1.5**2) * np.ones(5)
    J_n = J if normalised else np.ones(3)
    true_f, true_g = rng.uniform(size=(3, 5)), rng.uniform(size=(3, 5))
    u_out = y["tau_command_B"]
    acceleration = true_f @ X + true_g @ X / J_n * u_out + T
    z2_dot = acceleration + (K + 0.5) * theta_dot
    parts = z1 * theta_dot + e2 * (z2_dot - rates["e1"])
    parts -= np.sum((true_f - x["W_f"]) * rates["W_f"], axis=1) / C1
    parts -= np.sum((true_g - x["W_g"]) * rates["W_g"], axis=1) / C2
    expected = -(K + 0.5) * z1**2 + e1 * z1 - (P1 + KAPPA) * e2**2 + e2 * T
    scale = np.abs(e2 * acceleration).max() + np.abs(expected).max()
    assert_allclose(parts, expected, atol=1e-8 * scale)


def test_without_a_limit_it_is_theorem_1():
    """The auxiliary system rests at zero and the weights of g learn from the unlimited torque."""
    point = Point(AdaptiveL2Gain(torque_limit=[NO_LIMIT] * 3))
    y, rates = point.outputs(), point.rates()
    assert_allclose(y["tau_command_B"], y["u"])
    assert_allclose(rates["e1"], 0, atol=1e-15)
    X = np.exp(-np.sum(y["theta"] ** 2) / 1.5**2)  # at rest in the orbit frame
    assert_allclose(rates["W_g"][:, 0], C2 * y["z2"] * y["u"] * X / J, rtol=1e-9)
    assert_allclose(np.abs(y["u"]), [1588.8, 1454.8, 1868.3], rtol=1e-4)


def at_floor(f_hat=0.0) -> Point:
    """Roll's estimated input gain below the floor, with e2 > 0 there; u_out < 0 unless f_hat is far below zero."""
    W_f, W_g = np.zeros((3, 5)), np.full((3, 5), 0.4)
    W_f[0], W_g[0] = f_hat / 5, 1e-3
    return Point(AdaptiveL2Gain(), W_g=W_g, W_f=W_f)


def test_projection_at_the_floor():
    falling, rising = at_floor(), at_floor(f_hat=-5.0)
    y = falling.outputs()
    assert y["z2"][0] > 0 > y["tau_command_B"][0]
    assert_allclose(falling.rates()["W_g"][0], 0)
    assert np.abs(falling.rates()["W_g"][1:]).min() > 0
    y = rising.outputs()
    assert y["z2"][0] > 0 and y["tau_command_B"][0] == 0.2
    X = np.exp(-np.sum(y["theta"] ** 2) / 1.5**2)
    assert_allclose(rising.rates()["W_g"][0], C2 * y["z2"][0] * 0.2 * X / J[0], rtol=1e-9)


def test_floor_is_used_everywhere_and_reported():
    """u, the auxiliary system and the reported g_hat divide by the same floor."""
    point = at_floor()
    y, rates = point.outputs(), point.rates()
    floor = 0.2 / 1500
    assert y["floor_active"] == 1
    assert_allclose(y["g_hat"][0], floor)
    z1, z2 = y["theta"][0], y["z2"][0]
    raw = (-z1 - (P1 + KAPPA) * z2) / floor  # at rest, W_f = 0, e1 = 0
    assert_allclose(y["u"][0], raw, rtol=1e-9)
    assert_allclose(rates["e1"][0], floor * (y["tau_command_B"][0] - raw), rtol=1e-9)


def test_the_product_is_floored_where_the_network_vanishes():
    """Far from its centres X goes to zero whatever the weights: the torque stays a number of sensible size."""
    point = Point(AdaptiveL2Gain(), q_BN=quaternion([179, 5, 170]), omega_BN_B=[0.1, 0.1, 0.1])
    y = point.outputs()
    assert y["floor_active"] == 3
    assert np.isfinite(point.rates_flat()).all() and np.abs(y["u"]).max() < 1e7


def test_the_weights_learn_from_the_limited_torque():
    point = Point(AdaptiveL2Gain())
    y = point.outputs()
    assert np.abs(y["u"]).min() > 1e3 and y["saturated"] == 3
    assert_allclose(np.abs(y["tau_command_B"]), 0.2)
    X = np.exp(-np.sum(y["theta"] ** 2) / 1.5**2)
    assert_allclose(point.rates()["W_g"][:, 0], C2 * y["z2"] * y["tau_command_B"] * X / J, rtol=1e-9)


def test_zero_error_is_an_equilibrium():
    q, omega = quaternion([20, 30, -50]), np.array([0.01, -0.02, 0.03])
    point = Point(AdaptiveL2Gain(), q_BN=q, q_RN=q, omega_BN_B=omega, omega_RN_R=omega, W_f=np.zeros((3, 5)))
    assert_allclose(point.outputs()["u"], 0, atol=1e-9)
    assert_allclose(point.rates_flat(), 0, atol=1e-9)


@pytest.mark.parametrize("pitch", [89.97, 90.0, -90.0])
def test_gimbal_lock_is_reported_and_finite(pitch):
    point = Point(AdaptiveL2Gain(), q_BN=quaternion([10, pitch, 5]), omega_BN_B=[0.02, -0.01, 0.03])
    y = point.outputs()
    assert y["gimbal_lock"] == 1
    assert np.isfinite(np.concatenate([point.outputs_flat(), point.rates_flat()])).all()
    assert any(f"pitch is {pitch:g} deg from the reference at the start" in m for m in point.violated())
    assert Point(AdaptiveL2Gain(), q_BN=quaternion([10, 89, 5])).outputs()["gimbal_lock"] == 0


def test_free_modes_and_damping():
    """equations/xiao2011.md: free modes 1.02004, 1.02166, 1.34676 rad/s; damping ratio of yaw's .03570."""
    plant = FlexibleSpacecraft(
        modes=3,
        J=np.diag(J),
        delta=np.diag([0.3, 1.8, -21.0]),
        Omega=[1.02, 1.02, 1.1316],
        zeta=[0.03] * 3,
        q_BN=[1, 0, 0, 0],
        omega_BN_B=[0, 0, 0],
    )
    A, _ = plant.linearise(Point(plant).x)
    roots = np.linalg.eigvals(A)
    roots = sorted(roots[roots.imag > 0.5], key=abs)
    assert_allclose(np.abs(roots), [1.02004, 1.02166, 1.34676], atol=1e-4)
    assert_allclose(-roots[2].real / abs(roots[2]), 0.03570, atol=1e-4)


REFUSALS = {
    "floor": (
        {"W_g": np.vstack([np.full((1, 5), 0.02), np.ones((2, 5))])},
        ["ghat(0) of roll", "row 1 of W_g", "1/(kg.m2)", "under its floor g_min = 0.000133333", "larger weights"],
    ),
    "printed": ({"W_g": np.zeros((3, 5)), "normalised": 0.0}, ["ghat(0) of yaw", "is 0 1/(kg.m2)"]),
    "J": ({"J": [[1, 2, 0], [2, 1, 0], [0, 0, 1]]}, ["J is not positive definite"]),
    "limit": ({"torque_limit": [0.2, 0.2, 0.0]}, ["torque_limit[3] = 0 N.m: it must be positive"]),
    "gamma": ({"gamma_l2": 0.0}, ["gamma_l2 = 0: it must be positive"]),
    "g_min": ({"g_min": -1.0}, ["g_min = -1 1/(kg.m2): it must be positive"]),
    "width": ({"theta_width": 0.0}, ["theta_width = 0 rad: it must be positive"]),
    "p1": ({"p1": -10.0}, ["p1 = -10: it must be positive"]),
    "c1": ({"c1": -100.0}, ["c1 = -100: it must be positive"]),
    "c2": ({"c2": 0.0}, ["c2 = 0: it must be positive"]),
    "k": ({"k_theta": -1.0}, ["k_theta = -1: it must not be negative"]),
}


@pytest.mark.parametrize("case", REFUSALS)
def test_refusals(case):
    values, words = REFUSALS[case]
    messages = Point(AdaptiveL2Gain(), **values).violated()
    assert any(all(word in message for word in words) for message in messages), messages
