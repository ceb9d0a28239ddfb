"""Guidance and disturbances."""

import numpy as np
import pytest
from helpers import Point
from numpy.testing import assert_allclose
from published import as_in
from scipy.spatial.transform import Rotation

from components.environment.sum import Sum

HarmonicTorque = as_in("zhang2018-ppatc", "environment")
EulerSinusoid = as_in("zhang2018-ppatc", "guidance")

DEGREE = np.pi / 180
WIDE = dict(amplitude=[0.6, -0.9, 1.2], frequency=[0.1, 0.23, 0.17], phase=[0.3, 0, -1], bias=[0.2, 0.1, -2.0])


def test_feedthrough():
    assert EulerSinusoid().direct_feedthrough == {"q_RN": (), "omega_RN_R": (), "omega_dot_RN_R": ()}
    assert HarmonicTorque().direct_feedthrough == {"tau_dist_B": ()}
    assert Sum(n=3).direct_feedthrough == {"tau_dist_B": ("tau_1", "tau_2", "tau_3")}


def reference(t, values):
    angles = np.add(values["bias"], values["amplitude"] * np.sin(np.multiply(values["frequency"], t) + values["phase"]))
    return Rotation.from_euler("XYZ", angles)


@pytest.mark.parametrize("t", [0.0, 3.0, 47.0, 1000.0])
def test_guidance_against_scipy(t):
    """Attitude by scipy; the rate and its derivative by differences of scipy's attitudes."""
    y, h = Point(EulerSinusoid(**WIDE), t=t).outputs(), 1e-3

    def rate(now):
        return (reference(now - h / 2, WIDE).inv() * reference(now + h / 2, WIDE)).as_rotvec() / h

    found = Rotation.from_quat(y["q_RN"], scalar_first=True)
    assert (found.inv() * reference(t, WIDE)).magnitude() < 1e-12
    assert_allclose(np.linalg.norm(y["q_RN"]), 1, atol=1e-15)
    assert_allclose(y["omega_RN_R"], rate(t), atol=1e-7)
    assert_allclose(y["omega_dot_RN_R"], (rate(t + h) - rate(t - h)) / (2 * h), atol=1e-6)


def test_guidance_of_the_paper():
    y = Point(EulerSinusoid(), t=7.0).outputs()
    angles = Rotation.from_quat(y["q_RN"], scalar_first=True).as_euler("XYZ")
    assert_allclose(angles / DEGREE, np.array([0.5, 1, -0.5]) * np.sin(0.7), atol=1e-12)


def test_reference_quaternion_does_not_jump():
    q = np.array([Point(EulerSinusoid(**WIDE), t=t).outputs()["q_RN"] for t in np.arange(0, 80, 0.5)])
    assert np.abs(np.diff(q, axis=0)).max() < 0.15


def test_disturbance_of_the_paper():
    n0 = 0.0011
    for t in (0.0, 100.0, 2000.0):
        s, c = np.sin(n0 * t), np.cos(n0 * t)
        assert_allclose(Point(HarmonicTorque(), t=t).outputs()["tau_dist_B"], 0.0045 * np.array([c + 1, c + s, s + 1]))


def test_sum():
    assert_allclose(Point(Sum(), tau_1=[1, 2, 3], tau_2=[0.5, 0, -3]).outputs()["tau_dist_B"], [1.5, 2, 0])
    assert [v.name for v in Sum(n=3).inputs] == ["tau_1", "tau_2", "tau_3"]
    assert_allclose(Point(Sum(n=0)).outputs()["tau_dist_B"], 0)
