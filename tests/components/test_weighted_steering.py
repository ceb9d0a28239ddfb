"""Weighted pseudo-inverse steering: the torque is met, of all ways with the least weighted effort; refusals."""

import numpy as np
import pytest
from helpers import Point
from numpy.testing import assert_allclose

from components.actuators.cmg_cluster import CmgCluster
from components.actuators.weighted_steering import WeightedSteering

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


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"gimbal_weight": [1, 0, 1, 1]}, "gimbal_weight[2] = 0: it must be positive."),
        ({"wheel_weight": [1, -2, 1]}, "wheel_weight[2] = -2 1/s2: it must be positive."),
        ({"rotor_momentum": [8, 8, 0, 8]}, "rotor_momentum[3] = 0 N.m.s: it must be positive."),
        ({"spin_axes_B": 2 * np.eye(3)}, "axis 1 of spin_axes_B has length 2"),
    ],
)
def test_refusals(values, words):
    assert any(words in message for message in Point(STEERING, **values).violated())


def test_two_gyros_without_wheels_are_refused():
    alone = WeightedSteering(wheels=0, gimbals=2)
    assert any("gimbal_angle is singular at the start" in message for message in Point(alone).violated())
