"""A reference that turns with a sinusoidal rate."""

import numpy as np
import pytest
from helpers import Monolithic, Point
from numpy.testing import assert_allclose
from published import as_in

BodyRateSinusoid = as_in("ye2016-perfect", "guidance")


def test_start_is_the_papers():
    y = Point(BodyRateSinusoid(), t=100.0).outputs()
    assert_allclose(y["omega_RN_R"], 0.02 * np.sin(2 * np.pi * 100.0 / np.array([800.0, 600.0, 400.0])), rtol=1e-12)


def test_about_one_axis_the_angle_is_that_of_the_sinusoid():
    part = BodyRateSinusoid(amplitude=(0.0, 0.5, 0.0), frequency=0.3, phase=0.7, bias=(0.0, 0.1, 0.0))
    t = np.linspace(0, 40, 9)
    q = Monolithic({"guidance": part}, []).solve(t)
    angle = 0.1 * t + 0.5 / 0.3 * (np.cos(0.7) - np.cos(0.3 * t + 0.7))
    zero = np.zeros_like(t)
    assert_allclose(q, np.transpose([np.cos(angle / 2), zero, np.sin(angle / 2), zero]), atol=1e-10)


def test_acceleration_is_the_derivative_of_the_rate():
    part, h = BodyRateSinusoid(frequency=(1.0, 2.0, 3.0), phase=(0.1, 0.2, 0.3)), 1e-5
    rates = [Point(part, t=2.0 + s * h).outputs()["omega_RN_R"] for s in (1, -1)]
    assert_allclose(Point(part, t=2.0).outputs()["omega_dot_RN_R"], (rates[0] - rates[1]) / (2 * h), rtol=1e-8)


def test_sign_is_continuous_and_length_kept():
    """ye2016: the scalar part falls to -0.864, the reference never makes a full turn."""
    q = Point(BodyRateSinusoid()).advance(0.05, 16000)
    assert_allclose(q[0].min(), -0.864, atol=1e-3)
    assert np.abs(np.diff(q)).max() < 1e-3
    assert_allclose(np.linalg.norm(q, axis=0), 1.0, rtol=1e-14)


@pytest.mark.parametrize("norm", [0.0, 2.0])
def test_refusal(norm):
    text = f"q_RN has norm {norm:g} at the start, a unit quaternion (within 0.001) is needed. Divide it by its norm."
    assert Point(BodyRateSinusoid(q_RN=[norm, 0, 0, 0])).violated() == [text]
