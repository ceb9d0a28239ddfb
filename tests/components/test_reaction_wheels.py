"""Reaction wheels: sharing of the torque, limits, friction, momentum, refusals."""

import numpy as np
import pytest
from helpers import Point, monolithic
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from components.actuators.reaction_wheels import ReactionWheels
from components.environment.harmonic_torque import HarmonicTorque
from components.mathematics.limits import floored, stopped
from components.plants.flexible_spacecraft import FlexibleSpacecraft

BODY = {"J": np.diag([30.0, 20.0, 25.0]), "modes": 0}


def advanced(point: Point, seconds: float) -> np.ndarray:
    """Wheel momenta every millisecond, a column a time."""
    return point.advance(1e-3, round(seconds / 1e-3))


def test_direct_feedthrough():
    table = ReactionWheels().direct_feedthrough
    assert table == {"tau_B": (), "h_B": (), "wheel_speed": (), "saturated": ("tau_command_B",)}


@pytest.mark.parametrize("wheels", [3, 4, 6])
def test_the_hub_gets_the_torque_that_is_wanted(wheels):
    """Any number of wheels: h_B' = -tau_command while nothing saturates, with the least torque of the wheels."""
    wanted = np.array([0.03, -0.05, 0.02])
    point = Point(ReactionWheels(wheels=wheels), tau_command_B=wanted)
    A = next(v.start for v in point.component.parameters if v.name == "spin_axes_B")
    motor = point.rates()["wheel_momentum"]
    assert_allclose(A @ motor, -wanted, atol=1e-15)
    assert_allclose(motor, -np.linalg.lstsq(A, wanted, rcond=None)[0], atol=1e-15)
    assert_allclose(np.linalg.norm(A, axis=0), 1, rtol=1e-14)


def test_torque_limit_of_each_wheel():
    point = Point(ReactionWheels(), tau_command_B=[5.0, -0.1, -7.0], torque_limit=[0.2, 0.2, 0.3])
    assert_allclose(point.rates()["wheel_momentum"], [-0.2, 0.1, 0.3])
    assert point.outputs()["saturated"] == 2


def test_momentum_limit_is_kept_and_left_again():
    start = dict(wheel_momentum=[0.99, -0.5, 0.0], momentum_limit=1.0)
    outward = Point(ReactionWheels(), tau_command_B=[-0.2, 0.1, 0.0], **start)
    h = advanced(outward, 1.0)
    assert h[0].max() == 1.0 and h[0, -1] == 1.0
    assert_allclose(h[1, -1], -0.6)
    inward = Point(ReactionWheels(), tau_command_B=[0.2, 0, 0], wheel_momentum=[1.0, 0, 0], momentum_limit=1.0)
    assert inward.outputs()["saturated"] == 1  # by momentum and by torque, one wheel
    assert_allclose(advanced(inward, 1.0)[0, -1], 0.8)


def test_friction_slows_a_wheel_as_an_exponential():
    point = Point(ReactionWheels(), wheel_momentum=[2.0, -1.0, 0.5], friction=0.01, rotor_inertia=0.05)
    assert_allclose(advanced(point, 3.0)[:, -1], np.exp(-0.01 / 0.05 * 3.0) * np.array([2.0, -1.0, 0.5]), rtol=1e-12)
    assert_allclose(point.outputs()["wheel_speed"], [40, -20, 10])


def test_momentum_of_body_and_wheels_is_kept():
    """One ODE: wheels that saturate, rub and reach their momentum limit keep the total inertial momentum."""
    components = {
        "command": HarmonicTorque(bias=[0.0, 0.0, 0.0], sine=[0.3, -0.2, 0.25], cosine=[0.1, 0.2, -0.3], frequency=0.3),
        "wheels": ReactionWheels(wheels=4, friction=1e-3, torque_limit=0.15, wheel_momentum=[0.5, -1.0, 0.2, 0.1]),
        "body": FlexibleSpacecraft(**BODY, omega_BN_B=[0.05, -0.03, 0.02]),
    }
    connections = [("command.tau_dist_B", "wheels.tau_command_B"), ("wheels.h_B", "body.h_B")]
    _, x, y = monolithic(components, connections, 30.0, np.linspace(0, 30, 61), rtol=1e-11)
    turned = Rotation.from_quat(x["body.q_BN"], scalar_first=True)
    H = turned.apply(y["body.omega_BN_B"] @ BODY["J"] + y["wheels.h_B"])
    assert np.abs(H - H[0]).max() < 1e-8 and np.abs(H - y["body.H_N"]).max() < 1e-8
    assert np.abs(x["wheels.wheel_momentum"] - x["wheels.wheel_momentum"][0]).max() > 0.3
    assert y["wheels.saturated"].max() > 0


def test_rates_at_a_limit_lead_inwards_only():
    assert [float(stopped(v, r, 2)) for v, r in ((1, 5), (2, 5), (2, -5), (-2, -5), (-2, 5))] == [5, 0, -5, 0, 5]
    assert [float(floored(v, r, 2)) for v, r in ((3, -1), (2, -1), (1, -1), (1, 1))] == [-1, 0, 0, 1]


REFUSALS = {
    "length": (
        {"spin_axes_B": [[1, 0, 0], [0, 1.1, 0], [0, 0, 1]]},
        ["axis 2 of spin_axes_B has length 1.1", "a unit vector"],
    ),
    "plane": (
        {"spin_axes_B": [[1, 0, 0.6], [0, 1, 0.8], [0, 0, 0]]},
        ["spin_axes_B do not span three dimensions", "smallest eigenvalue"],
    ),
    "torque": ({"torque_limit": [0.2, -0.2, 0.2]}, ["torque_limit[2] = -0.2 N.m: it must be positive"]),
    "momentum": ({"momentum_limit": 0.0}, ["momentum_limit[1] = 0 N.m.s: it must be positive"]),
    "rotor": ({"rotor_inertia": [0.1, 0.1, 0.0]}, ["rotor_inertia[3] = 0 kg.m2: it must be positive"]),
    "friction": ({"friction": -1e-3}, ["friction[1] = -0.001 N.m.s/rad: it must not be negative"]),
    "beyond": (
        {"wheel_momentum": [0, -4.0, 0], "momentum_limit": 3.0},
        ["wheel_momentum[2] = -4 N.m.s at the start is beyond momentum_limit[2] = 3 N.m.s"],
    ),
}


@pytest.mark.parametrize("case", REFUSALS)
def test_refusals(case):
    values, words = REFUSALS[case]
    messages = Point(ReactionWheels(), **values).violated()
    assert any(all(word in message for word in words) for message in messages), messages


def test_fewer_than_three_wheels_do_not_span():
    assert any("do not span" in message for message in Point(ReactionWheels(wheels=2)).violated())
