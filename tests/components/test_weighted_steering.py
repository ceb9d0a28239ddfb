"""Weighted pseudo-inverse steering: the torque is met with the least weighted effort, within limits; refusals."""

import numpy as np
import pytest
from helpers import Point, numbers
from numpy.testing import assert_allclose

from components.actuators.cmg_cluster import CmgCluster
from components.actuators.weighted_steering import WeightedSteering
from components.numbers.neutral import WHEEL_INERTIA

STEERING = WeightedSteering()
RNG = np.random.default_rng(7)
COMMAND = [0.3, -0.2, 0.5]
SINGULAR = [np.pi / 2, 0.0, -np.pi / 2, 0.0]  # all transverse axes in one plane: det(A A^T) = 0


def commands(y):
    return np.concatenate([y["gimbal_rate_command"], y["wheel_acceleration_command"]])


def momentum(gamma, speed):
    """What a cluster of the same nominal axes stores, from the cluster's own component."""
    return Point(CmgCluster(), gimbal_angle=gamma, wheel_speed=speed).outputs()["h_B"]


def test_feedthrough():
    table = STEERING.direct_feedthrough
    assert table["gimbal_rate_command"] == ("tau_command_B", "gimbal_angle")
    assert table["singularity"] == ("gimbal_angle",)


def test_a_cluster_that_carries_the_commands_out_gives_the_torque():
    """By a central difference of the cluster's momentum along the commands: error h^2/6 |h'''| below 1e-9."""
    for _ in range(10):
        gamma, tau, h = RNG.uniform(-np.pi, np.pi, 4), RNG.normal(0, 1, 3), 1e-4
        y = Point(STEERING, gimbal_angle=gamma, tau_command_B=tau).outputs()
        rates, accelerations = y["gimbal_rate_command"], y["wheel_acceleration_command"]
        ahead, behind = (momentum(gamma + s * h * rates, s * h * accelerations) for s in (1, -1))
        assert_allclose(-(ahead - behind) / (2 * h), tau, atol=1e-7)
        assert_allclose(y["tau_planned_B"], tau, atol=1e-12)


@pytest.mark.parametrize("wheel_weight", [1.0, 1e4])
def test_of_all_commands_those_of_the_least_weighted_effort(wheel_weight):
    """No command of no torque (null space of Q, from finite differences) can be added to lessen x . W^-1 x."""
    gamma = RNG.uniform(-1, 1, 4)
    y = Point(STEERING, gimbal_angle=gamma, tau_command_B=COMMAND, wheel_weight=[wheel_weight] * 3).outputs()
    columns = []
    for unit in np.eye(7):
        step = 1e-5 * unit
        ahead, behind = (momentum(gamma + s * step[:4], s * step[4:]) for s in (1, -1))
        columns.append((ahead - behind) / 2e-5)
    _, _, rows = np.linalg.svd(np.array(columns).T)
    weights = np.array([1.0] * 4 + [wheel_weight] * 3)
    x = commands(y)
    assert np.abs(rows[3:] @ (x / weights)).max() < 1e-8 * np.abs(x).max()


def test_weight_of_the_wheels_keeps_gimbal_rates_small_near_a_singular_direction():
    gamma = np.array(SINGULAR) + 0.02
    light, heavy = (
        Point(STEERING, gimbal_angle=gamma, tau_command_B=[0, 0, 1], wheel_weight=[w] * 3).outputs() for w in (1, 1e6)
    )
    assert light["singularity"] < 1e-2
    assert np.abs(heavy["gimbal_rate_command"]).max() < 0.5 * np.abs(light["gimbal_rate_command"]).max()
    assert_allclose(heavy["tau_planned_B"], [0, 0, 1], atol=1e-10)


PYRAMID = np.array([[1, 0, -1, 0], [0, 1, 0, -1], [0.7, 0.7, 0.7, 0.7]]) / np.sqrt(1.49)
LIMITS = {"gimbal_rate_limit": 0.01, "gimbal_dead_zone": 1e-3}


def given(part, y, **values):
    """The torque of a cluster with nominal axes and the same limits that gets the commands."""
    names = ("gimbal_rate_command", "wheel_acceleration_command")
    cluster = Point(CmgCluster(**part.given), **values, **{n: y[n] for n in names})
    return cluster.functions.mean_rates(0, cluster.x, cluster.u, cluster.p, cluster.c).full().ravel()


@pytest.mark.parametrize("wheels", [{}, {"wheels": 4, "spin_axes_B": PYRAMID}], ids=["on the axes", "pyramid"])
def test_the_wheels_give_what_a_limit_of_the_gyros_leaves_over(wheels):
    """The gyros get the direction that they would have without limits, less what is in the dead zone."""
    part, free = WeightedSteering(**wheels, **LIMITS), WeightedSteering(**wheels)
    for _ in range(10):
        values = dict(gimbal_angle=RNG.uniform(-np.pi, np.pi, 4), tau_command_B=RNG.normal(0, 1, 3))
        y, wanted = Point(part, **values).outputs(), Point(free, **values).outputs()["gimbal_rate_command"]
        assert np.abs(wanted).max() > 0.01
        shorter = wanted * 0.01 / np.abs(wanted).max()
        assert_allclose(y["gimbal_rate_command"], np.where(np.abs(shorter) < 1e-3, 0, shorter), atol=1e-15)
        assert_allclose(y["tau_planned_B"], values["tau_command_B"], atol=1e-10)
        assert_allclose(given(part, y, gimbal_angle=values["gimbal_angle"]), values["tau_command_B"], atol=1e-10)
        assert y["saturated"] == 0


def test_rates_within_the_dead_zone_are_left_to_the_wheels():
    y = Point(WeightedSteering(gimbal_dead_zone=0.1), tau_command_B=COMMAND).outputs()
    assert not y["gimbal_rate_command"].any()
    assert_allclose(-WHEEL_INERTIA * y["wheel_acceleration_command"], COMMAND, rtol=1e-10)
    assert y["saturated"] == 0


def test_a_command_that_gyros_and_wheels_cannot_give_is_reported():
    """The wheels of 0.15 N m give what they can, and the plan is what the cluster will give."""
    part = WeightedSteering(**LIMITS, wheel_torque_limit=0.15)
    y = Point(part, tau_command_B=COMMAND).outputs()
    torques = -WHEEL_INERTIA * y["wheel_acceleration_command"]
    assert_allclose(np.abs(torques).max(), 0.15)
    assert_allclose(given(part, y), y["tau_planned_B"], atol=1e-12)
    assert np.abs(y["tau_planned_B"] - COMMAND).max() > 0.05
    assert y["saturated"] == 1
    enough = Point(part, tau_command_B=np.multiply(COMMAND, 0.4)).outputs()
    assert_allclose(enough["tau_planned_B"], np.multiply(COMMAND, 0.4), atol=1e-12)
    assert enough["saturated"] == 0


def test_a_wheel_s_own_share_is_limited_too():
    """Wheels on the axes and no gyro: each is asked for all of its axis."""
    alone = WeightedSteering(gimbals=0, wheel_torque_limit=0.25)
    y = Point(alone, tau_command_B=COMMAND).outputs()
    assert_allclose(y["tau_planned_B"], [0.25, -0.2, 0.25], rtol=1e-12)
    assert y["saturated"] == 1


@pytest.mark.parametrize(
    "axes", [[[1, 0], [0, 1], [0, 0]], [[1, 0, 0.6], [0, 1, 0.8], [0, 0, 0]]], ids=["two", "plane"]
)
def test_wheels_that_do_not_span_keep_their_share(axes):
    """A plane of wheels, in which a pseudo-inverse would divide by zero: it gives its share and it is said."""
    structure = {"wheels": len(axes[0]), "spin_axes_B": axes}
    values = dict(gimbal_angle=[0.3, -0.2, 0.1, 0.4], tau_command_B=COMMAND, wheel_weight=[1e4] * len(axes[0]))
    free, limited = (Point(WeightedSteering(**structure, **limits), **values) for limits in ({}, LIMITS))
    share, y = free.outputs()["wheel_acceleration_command"], limited.outputs()
    assert limited.violated() == [] and np.isfinite(limited.outputs_flat()).all()
    assert np.isfinite(numbers(limited.functions.calculate_forward(limited.p, np.ones(len(limited.p))))).all()
    assert_allclose(y["wheel_acceleration_command"], share, rtol=1e-12)
    assert np.abs(share).max() > 0.1
    assert (free.outputs()["saturated"], y["saturated"]) == (0, 1)


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"gimbal_weight": [1, 0, 1, 1]}, "gimbal_weight[2] = 0: it must be positive."),
        ({"wheel_weight": [1, -2, 1]}, "wheel_weight[2] = -2 1/s2: it must be positive."),
        ({"rotor_momentum": [8, 8, 0, 8]}, "rotor_momentum[3] = 0 N.m.s: it must be positive."),
        ({"spin_axes_B": 2 * np.eye(3)}, "axis 1 of spin_axes_B has length 2"),
        ({"gimbal_rate_limit": [1, 1, 0, 1]}, "gimbal_rate_limit[3] = 0 rad/s: it must be positive."),
        ({"wheel_torque_limit": [1, -1, 1]}, "wheel_torque_limit[2] = -1 N.m: it must be positive."),
        ({"gimbal_dead_zone": -1.0}, "gimbal_dead_zone = -1 rad/s: it must not be negative."),
    ],
)
def test_refusals(values, words):
    assert any(words in message for message in Point(STEERING, **values).violated())


def test_two_gyros_without_wheels_are_refused():
    alone = WeightedSteering(wheels=0, gimbals=2)
    assert any("gimbal_angle is singular at the start" in message for message in Point(alone).violated())
