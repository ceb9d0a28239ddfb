"""PID: its law, its limit, its integral, any attitude."""

import numpy as np
import pytest
from helpers import Point, monolithic
from numpy.testing import assert_allclose
from published import as_in
from scipy.spatial.transform import Rotation

from components.plants.flexible_spacecraft import FlexibleSpacecraft

PID = as_in("xiao2011-pid", "controller", q_BN=[1, 0, 0, 0], omega_BN_B=0.0, omega_RN_R=0.0, euler=0.0)

LOOP = [
    ("plant.q_BN", "controller.q_BN"),
    ("plant.omega_BN_B", "controller.omega_BN_B"),
    ("controller.tau_command_B", "plant.tau_B"),
]


def quaternion(rotvec) -> np.ndarray:
    return Rotation.from_rotvec(rotvec).as_quat(scalar_first=True)


def test_direct_feedthrough():
    seen = ("q_BN", "omega_BN_B", "q_RN", "omega_RN_R")
    table = PID().direct_feedthrough
    assert table["tau_command_B"] == table["u"] == seen
    assert table["attitude_error"] == ("q_BN", "q_RN")


def test_law():
    """At any attitude of body and reference: rotation vector, its integral, rate relative to the reference."""
    reference, error = Rotation.from_rotvec([0.4, -1.0, 0.7]), Rotation.from_rotvec([0.5, 0.2, -1.0])
    omega_RN_R, omega_BN_B, integral = np.array([0.01, 0.02, -0.03]), np.array([-0.02, 0.05, 0.01]), [1.0, -2.0, 3.0]
    point = Point(
        PID(),
        q_RN=reference.as_quat(scalar_first=True),
        q_BN=(reference * error).as_quat(scalar_first=True),
        omega_RN_R=omega_RN_R,
        omega_BN_B=omega_BN_B,
        integral=integral,
    )
    y = point.outputs()
    rate = omega_BN_B - error.inv().apply(omega_RN_R)
    expected = -(2500 * error.as_rotvec() + 50 * np.array(integral) + 4000 * rate)
    assert_allclose(y["u"], expected, rtol=1e-12)
    assert_allclose(y["tau_command_B"], np.clip(expected, -0.2, 0.2))
    assert_allclose(y["attitude_error"], error.as_rotvec(), rtol=1e-12)
    assert_allclose(point.rates()["integral"], error.as_rotvec(), rtol=1e-12)
    assert y["saturated"] == 3


def test_law_in_euler_angles():
    """euler = 1: roll, pitch, yaw of sequence 3-2-1 and their rates, by differences of scipy's angles."""
    error, rate, h = Rotation.from_euler("ZYX", [0.4, -0.9, 0.3]), np.array([0.03, -0.01, 0.02]), 1e-5
    sides = [(error * Rotation.from_rotvec(s * h * rate)).as_euler("ZYX")[::-1] for s in (-1, 1)]
    point = Point(PID(), euler=1.0, q_BN=error.as_quat(scalar_first=True), omega_BN_B=rate, integral=[1.0, -2.0, 3.0])
    theta, theta_dot = np.array([0.3, -0.9, 0.4]), (sides[1] - sides[0]) / (2 * h)
    y = point.outputs()
    assert_allclose(y["u"], -(2500 * theta + 50 * np.array([1, -2, 3]) + 4000 * theta_dot), rtol=1e-8)
    assert_allclose(y["attitude_error"], error.as_rotvec(), rtol=1e-12)
    assert_allclose(point.rates()["integral"], theta, rtol=1e-12)


def test_gimbal_lock_of_euler_angles():
    q = quaternion([0, np.pi / 2, 0])
    point = Point(PID(), euler=1.0, q_BN=q, omega_BN_B=[0.01, 0.02, 0.03])
    assert point.outputs()["gimbal_lock"] == 1 and np.isfinite(point.outputs_flat()).all()
    assert any("pitch is 90 deg from the reference at the start" in message for message in point.violated())
    assert Point(PID(), q_BN=q).outputs()["gimbal_lock"] == 0 and Point(PID(), q_BN=q).violated() == []
    assert Point(PID(), euler=1.0).outputs()["gimbal_lock"] == 0


def test_zero_error_needs_no_torque():
    q, omega = quaternion([0.3, -2.0, 1.0]), [0.01, -0.02, 0.03]
    point = Point(PID(), q_BN=q, q_RN=-q, omega_BN_B=omega, omega_RN_R=omega)
    assert_allclose(point.outputs()["u"], 0, atol=1e-12)
    assert_allclose(point.rates()["integral"], 0, atol=1e-15)


@pytest.mark.parametrize(
    ("conditional", "error", "integral", "integrates"),
    [
        (0.0, 0.01, 0.0, True),  # |u| = 25 N m, always integrated
        (1.0, 0.01, 0.0, False),  # at the limit, and z drives u further
        (1.0, 0.01, -2.0, True),  # at the limit on the other side: z leads back
        (1.0, 5e-5, 0.0, True),  # |u| = 0.125 N m, within the limit
    ],
)
def test_conditional_integration(conditional, error, integral, integrates):
    z = np.array([error, -error, 0])
    point = Point(PID(), q_BN=quaternion(z), integral=[integral, -integral, 0], conditional=conditional)
    assert_allclose(point.rates()["integral"], z if integrates else 0 * z, rtol=1e-9, atol=1e-18)


def test_slow_pole():
    """equations/xiao2011.md: the integral takes its time, the slow closed-loop pole is -0.0206 1/s at 1200 kg m^2."""
    J = np.diag([1200.0, 1200.0, 1200.0])
    components = {
        "controller": PID(torque_limit=[1e9] * 3),
        "plant": FlexibleSpacecraft(modes=0, J=J, q_BN=quaternion([1e-3, 0, 0]), omega_BN_B=[0, 0, 0]),
    }
    _, _, y = monolithic(components, LOOP, 250.0, np.array([0.0, 150.0, 250.0]))
    late = y["controller.attitude_error"][:, 0]
    assert_allclose(np.log(late[1] / late[2]) / 100, 0.0206, atol=1e-4)


def test_a_slew_of_170_degrees_arrives_with_conditional_integration():
    J, far = np.diag([12.0, 10.0, 15.0]), np.radians(170) * np.array([2, -1, 2]) / 3
    gains = dict(K_p=[2.0] * 3, K_i=[0.02] * 3, K_d=[10.0] * 3)
    components = {
        "controller": PID(**gains, conditional=1.0, torque_limit=[0.5] * 3),
        "plant": FlexibleSpacecraft(modes=0, J=J, q_BN=quaternion(far), omega_BN_B=[0, 0, 0]),
    }
    _, _, y = monolithic(components, LOOP, 400.0, np.array([0.0, 400.0]), rtol=1e-8, atol=1e-10)
    assert_allclose(np.linalg.norm(y["controller.attitude_error"][0]), np.radians(170), rtol=1e-9)
    assert np.linalg.norm(y["controller.attitude_error"][1]) < np.radians(0.1)


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"torque_limit": [0.2, 0.0, 0.2]}, "torque_limit[2] = 0 N.m: it must be positive"),
        ({"K_i": [50, 50, -1.0]}, "K_i[3] = -1 N.m/(rad.s): it must not be negative"),
        ({"K_p": [-2.0, 50, 1.0]}, "K_p[1] = -2 N.m/rad: it must not be negative"),
        ({"K_d": [4000, -4000, 4000]}, "K_d[2] = -4000 N.m.s/rad: it must not be negative"),
    ],
)
def test_refusals(values, words):
    assert any(words in message for message in Point(PID(), **values).violated())
