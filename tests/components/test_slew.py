"""Step and slew of the reference: ends, kinematics, limits, shortest time, refusals."""

import numpy as np
import pytest
from helpers import Point
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from components.guidance.attitude_step import AttitudeStep
from components.guidance.slew import Slew

DEGREE = np.pi / 180
START = Rotation.from_euler("XYZ", [0.3, -0.5, 0.8])
AXIS = np.array([2.0, -1.0, 2.0]) / 3
TURN = dict(q_start=START.as_quat(scalar_first=True), axis=AXIS, start_time=10.0)
KINDS = {
    "smooth, rate": dict(smooth=1, angle=1.2, max_rate=0.03, max_acceleration=0.05),
    "smooth, acceleration": dict(smooth=1, angle=1.2, max_rate=1.0, max_acceleration=0.05),
    "bang-bang, coasting": dict(smooth=0, angle=1.2, max_rate=0.03, max_acceleration=0.05),
    "bang-bang": dict(smooth=0, angle=1.2, max_rate=1.0, max_acceleration=0.05),
}
DURATIONS = {  # closed forms, T in s
    "smooth, rate": 2 * 1.2 / 0.03,
    "smooth, acceleration": np.sqrt(2 * np.pi * 1.2 / 0.05),
    "bang-bang, coasting": 1.2 / 0.03 + 0.03 / 0.05,
    "bang-bang": 2 * np.sqrt(1.2 / 0.05),
}
every = pytest.mark.parametrize("kind", KINDS)


def at(t, kind, **values):
    return Point(Slew(), t=t, **{**TURN, **KINDS[kind], **values}).outputs()


def attitude(y) -> Rotation:
    return Rotation.from_quat(y["q_RN"], scalar_first=True)


@every
def test_ends(kind):
    T = DURATIONS[kind]
    for t, angle in ((0.0, 0.0), (10.0, 0.0), (10 + T / 2, 0.6), (10 + T, 1.2), (500.0, 1.2)):
        y = at(t, kind)
        assert ((START * Rotation.from_rotvec(angle * AXIS)).inv() * attitude(y)).magnitude() < 1e-12
        if angle != 0.6:
            assert_allclose(y["omega_RN_R"], 0, atol=1e-12)
        assert_allclose(y["remaining"], max(0, 10 + T - t), atol=1e-9)


@every
@pytest.mark.parametrize("part", [0.003, 0.3, 0.62, 0.97])
def test_rate_and_acceleration_are_derivatives(kind, part):
    t, h = 10 + part * DURATIONS[kind], 1e-4
    before, here, after = (at(t + d, kind) for d in (-h, 0, h))
    turned = (attitude(before).inv() * attitude(after)).as_rotvec() / (2 * h)
    assert_allclose(turned, here["omega_RN_R"], atol=1e-8)
    change = (after["omega_RN_R"] - before["omega_RN_R"]) / (2 * h)
    assert_allclose(change, here["omega_dot_RN_R"], atol=1e-7)


@every
def test_limits_are_kept_and_one_is_used(kind):
    times = 10 + DURATIONS[kind] * np.linspace(0, 1, 81)
    rows = [at(t, kind) for t in times[:-1]]
    rate = max(np.linalg.norm(y["omega_RN_R"]) for y in rows) / KINDS[kind]["max_rate"]
    acceleration = max(np.linalg.norm(y["omega_dot_RN_R"]) for y in rows) / KINDS[kind]["max_acceleration"]
    assert max(rate, acceleration) <= 1 + 1e-12
    assert_allclose(max(rate, acceleration), 1, rtol=3e-3)


def test_smooth_acceleration_is_continuous_and_bang_bang_is_faster():
    T = DURATIONS["smooth, acceleration"]
    for t in (10.0, 10 + T):
        assert_allclose(at(t, "smooth, acceleration")["omega_dot_RN_R"], 0, atol=1e-12)
    assert DURATIONS["bang-bang"] < T


def test_step():
    part = AttitudeStep()
    before, after = (
        Point(part, t=t, q_start=TURN["q_start"], axis=AXIS, angle=1.2, step_time=10.0).outputs() for t in (9.999, 10.0)
    )
    assert (START.inv() * attitude(before)).magnitude() < 1e-12
    assert ((START * Rotation.from_rotvec(1.2 * AXIS)).inv() * attitude(after)).magnitude() < 1e-12
    assert_allclose([after["omega_RN_R"], after["omega_dot_RN_R"]], 0)


REFUSALS = {
    "axis": ({"axis": [0, 2, 0]}, ["axis has length 2", "unit vector"]),
    "no quaternion": ({"q_start": [0, 0, 0, 0]}, ["q_start has norm 0", "unit quaternion"]),
    "angle": ({"angle": -0.1}, ["angle = -5.72958 deg", "must not be negative"]),
    "rate": ({"max_rate": 0.0}, ["max_rate = 0 deg/s", "must be positive"]),
    "acceleration": ({"max_acceleration": -1.0}, ["max_acceleration = -57.2958 deg/s2"]),
}


@pytest.mark.parametrize("case", REFUSALS)
def test_refusals(case):
    values, words = REFUSALS[case]
    messages = Point(Slew(), **values).violated()
    assert any(all(word in message for word in words) for message in messages), messages


@pytest.mark.parametrize("case", ["axis", "no quaternion"])
def test_refusals_of_a_step(case):
    values, words = REFUSALS[case]
    messages = Point(AttitudeStep(), **values).violated()
    assert any(all(word in message for word in words) for message in messages), messages
