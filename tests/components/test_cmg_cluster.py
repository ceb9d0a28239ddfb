"""Gyros and wheels: geometry, momentum, limits, servo lag, refusals."""

import numpy as np
import pytest
from helpers import Point
from numpy.testing import assert_allclose
from published import as_in
from scipy.spatial.transform import Rotation

CmgCluster = as_in(
    "ye2016-perfect", "actuators", wheel_speed=0.0, rotor_deviation=0.0, transverse_deviation=0.0, spin_deviation=0.0
)


RNG = np.random.default_rng(7)
DEVIATION = {
    "rotor_deviation": RNG.uniform(-0.05, 0.05, (3, 4)),
    "transverse_deviation": RNG.uniform(-0.05, 0.05, (3, 4)),
    "spin_deviation": RNG.uniform(-0.05, 0.05, (3, 3)),
}
GIMBALS, ROTORS = (v.start for n in ("gimbal_axes_B", "rotor_axes_B") for v in CmgCluster().parameters if v.name == n)
PARALLEL = {  # two gyros whose momenta turn in the x-y plane
    "gimbal_axes_B": [[0, 0], [0, 0], [1, 1]],
    "rotor_axes_B": [[1, 1], [0, 0], [0, 0]],
    "rotor_momentum": 15.0,
}


def test_feedthrough():
    """Momentum, angles and torque follow from states: a loop through the cluster is not algebraic."""
    table = CmgCluster().direct_feedthrough
    assert {n for n, inputs in table.items() if not inputs} == {"tau_B", "h_B", "wheel_momentum", "singularity"}


def test_a_rotor_is_turned_about_its_gimbal_axis():
    angles = np.array([0.3, -1.2, 2.0, 4.0])
    part = CmgCluster()
    g, s_0 = (next(v.start for v in part.parameters if v.name == n) for n in ("gimbal_axes_B", "rotor_axes_B"))
    s = np.array([Rotation.from_rotvec(a * g[:, i]).apply(s_0[:, i]) for i, a in enumerate(angles)])
    h = 8.0 * s.sum(axis=0) + 0.02 * np.array([100.0, -80.0, 60.0])
    assert_allclose(Point(part, gimbal_angle=angles, wheel_speed=[100.0, -80.0, 60.0]).outputs()["h_B"], h, atol=1e-12)


def test_singularity_at_the_start_is_that_of_the_pyramid():
    """Columns t = g x s at gamma = 0: A A^T = diag(2 cos^2 b, 2 cos^2 b, 4 sin^2 b)."""
    b = np.radians(54.7356)
    assert_allclose(Point(CmgCluster()).outputs()["singularity"], 16 * np.cos(b) ** 4 * np.sin(b) ** 2, rtol=1e-12)


@pytest.mark.parametrize(("a", "b"), [(0.7, 2.0), (0.0, 0.4), (1.0, 1.0), (np.pi / 4, 5 * np.pi / 4)])
def test_two_parallel_gyros_are_singular_where_their_momentum_is_none_or_all(a, b):
    """geng2012: det(A A^T) = m (1 - m/4), m = |h|^2 / h_0^2."""
    y = Point(CmgCluster(gimbals=2, **PARALLEL), gimbal_angle=[a, b], wheel_speed=np.zeros(3)).outputs()
    m = y["h_B"] @ y["h_B"] / 15.0**2
    assert_allclose(y["singularity"], m * (1 - m / 4), atol=1e-12)


@pytest.mark.parametrize("lag", [0.0, 0.05])
def test_the_torque_before_the_first_step_is_the_rate_of_the_momentum(lag):
    part = CmgCluster(**DEVIATION, gimbal_lag=lag)
    point = Point(part, np.random.default_rng(3), gimbal_angle=[0.1, 0.7, -2.0, 3.0])
    rates = point.functions.rates(point.t, point.x, point.u, point.p, point.c)
    tau = point.functions.mean_rates(point.t, point.x, point.u, point.p, point.c).full().ravel()
    h = 1e-6
    change = []
    for sign in (1, -1):
        moved = Point(part)
        moved.p, moved.x = point.p, point.x + sign * h * rates.full().ravel()
        change.append(moved.outputs()["h_B"])
    assert_allclose(tau, -(change[0] - change[1]) / (2 * h), rtol=1e-7, atol=1e-8)


def test_a_servo_follows_with_its_time_constant():
    r, T, t = np.array([0.1, 0.2, -0.3, 0.4]), 0.2, 0.5
    point = Point(CmgCluster(gimbal_lag=T), gimbal_rate_command=r)
    x = point.advance(1e-3, 500)[:, -1]
    assert_allclose(x[:4], r * (t - T * (1 - np.exp(-t / T))), rtol=1e-9)
    assert_allclose(x[4:8], r * (1 - np.exp(-t / T)), rtol=1e-9)
    direct = Point(CmgCluster(), gimbal_rate_command=r).advance(1e-3, 500)[:, -1]
    assert_allclose(direct[:4], r * t, rtol=1e-12)


def test_a_servo_follows_what_limit_and_dead_zone_leave_of_the_command():
    """Its own rate starts within the dead zone and is carried out all the same."""
    part = CmgCluster(gimbal_lag=0.2, gimbal_rate_limit=0.2, gimbal_dead_zone=0.03)
    point = Point(part, gimbal_rate_command=[0.4, -0.1, 0.04, 0.0])
    left, T = np.array([0.2, -0.05, 0.0, 0.0]), 0.2  # halved, the direction kept; 0.02 is within the dead zone
    for steps in (10, 500):
        t, x = 1e-3 * steps, point.advance(1e-3, steps)[:, -1]
        assert_allclose(x[4:8], left * (1 - np.exp(-t / T)), rtol=1e-9)
        assert_allclose(x[:4], left * (t - T * (1 - np.exp(-t / T))), rtol=1e-8)
    assert point.advance(1e-3, 10)[4, -1] < 0.03
    moved = Point(part, servo_rate=[0.1, 0.01, -0.3, 0.0], gimbal_rate_command=[0.4, -0.1, 0.04, 0.0])
    assert_allclose(moved.outputs()["gimbal_rate"], [0.1, 0.01, -0.3, 0.0])
    assert_allclose(moved.rates()["servo_rate"], (left - [0.1, 0.01, -0.3, 0.0]) / T, rtol=1e-12)
    assert_allclose(moved.rates()["gimbal_angle"], [0.1, 0.01, -0.3, 0.0])


def test_limits_and_dead_zone():
    part = CmgCluster(gimbal_rate_limit=0.2, gimbal_dead_zone=0.03, wheel_torque_limit=0.25)
    point = Point(part, gimbal_rate_command=[0.4, -0.1, 0.02, 0.0], wheel_acceleration_command=[20.0, -3.0, 0.0])
    y = point.outputs()
    assert_allclose(y["gimbal_rate"], [0.2, -0.05, 0.0, 0.0])  # halved, the direction kept; then the dead zone
    assert_allclose(point.rates()["wheel_speed"], [12.5, -3.0, 0.0])
    assert y["saturated"] == 1
    assert Point(part, gimbal_rate_command=[0.1, -0.1, 0.02, 0.0]).outputs()["saturated"] == 0


def test_wheels_alone_and_gyros_alone():
    wheels = CmgCluster(gimbals=0)
    y = Point(wheels, wheel_speed=[1.0, 2.0, 3.0]).outputs()
    assert_allclose(y["h_B"], [0.02, 0.04, 0.06])
    assert_allclose(y["wheel_momentum"], [0.02, 0.04, 0.06])
    gyros = Point(CmgCluster(wheels=0), gimbal_rate_command=[0.1, 0, 0, 0])
    assert gyros.violated() == []
    assert_allclose(gyros.rates()["gimbal_angle"], [0.1, 0, 0, 0])


@pytest.mark.parametrize(
    ("values", "message"),
    [
        (
            dict(gimbals=2, **PARALLEL | {"gimbal_axes_B": [[0, 0], [0, 0], [1, 2]]}),
            "axis 2 of gimbal_axes_B has length 2",
        ),
        (dict(spin_axes_B=np.diag([1, 1, 0.9])), "axis 3 of spin_axes_B has length 0.9"),
        (
            dict(gimbals=2, **PARALLEL | {"rotor_axes_B": [[1, 0], [0, 0], [0, 1]]}),
            "axis 2 of rotor_axes_B is not at right angles to its gimbal axis (cosine of the angle 1)",
        ),
        (dict(gimbals=2, wheels=0, **PARALLEL), "spin axes together do not span three dimensions"),
        (
            dict(rotor_deviation=-ROTORS),
            "rotor_deviation leaves gyro 1 no rotor axis: rotor_axes_B + rotor_deviation has length 0, more than 0.001",
        ),
        (
            dict(transverse_deviation=-np.cross(GIMBALS, ROTORS, axis=0) * [0, 0, 1, 0]),
            "transverse_deviation leaves gyro 3 no plane to turn its momentum in: |s_0 x t_0| is 0, more than 0.001",
        ),
        (
            dict(spin_deviation=[[0, 0, 0], [0, -1, 0], [0, 0, 0]]),
            "spin_deviation leaves wheel 2 no spin axis: spin_axes_B + spin_deviation has length 0, more than 0.001",
        ),
        (
            dict(gimbals=2, **PARALLEL, spin_deviation=[[0, 0, 1], [0, 0, 0], [0, 0, -1]]),
            "rotor, transverse and spin axes with their deviations do not span three dimensions",
        ),
        (dict(rotor_momentum=(8.0, 8.0, 0.0, 8.0)), "rotor_momentum[3] = 0 N.m.s: it must be positive"),
        (dict(gimbal_rate_limit=-1.0), "gimbal_rate_limit[1] = -1 rad/s: it must be positive"),
        (dict(gimbal_dead_zone=-1.0), "gimbal_dead_zone = -1 rad/s: it must not be negative"),
        (dict(gimbal_lag=1e-4), "gimbal_lag = 0.0001 s: it must be 0 or at least half the internal step"),
    ],
)
def test_refusals(values, message):
    assert any(message in text for text in Point(CmgCluster(**values)).violated())
