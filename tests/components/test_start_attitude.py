"""Quaternions of angles, against rotation matrices written out axis by axis."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from components.mathematics.start_attitude import SEQUENCES, axis_angle, euler


def turned(axis: int, angle: float) -> np.ndarray:
    """Coordinates in a frame -> in the one that it was turned from, about axis 1, 2 or 3."""
    c, s = math.cos(math.radians(angle)), math.sin(math.radians(angle))
    rows = {1: [[1, 0, 0], [0, c, -s], [0, s, c]], 2: [[c, 0, s], [0, 1, 0], [-s, 0, c]], 3: [[c, -s, 0], [s, c, 0]]}
    return np.array([*rows[axis], *([[0, 0, 1]] if axis == 3 else [])])


def matrix(q) -> np.ndarray:
    """v_N = R v_B of a unit quaternion, scalar first: R = (q0^2 - v.v) I + 2 v v^T + 2 q0 [v x]."""
    q0, v = q[0], np.array(q[1:])
    cross = np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])
    return (q0**2 - v @ v) * np.eye(3) + 2 * np.outer(v, v) + 2 * q0 * cross


@pytest.mark.parametrize("sequence", SEQUENCES)
def test_three_rotations_one_after_the_other(sequence):
    angles = [50.0, 20.0, -35.0]
    expected = np.linalg.multi_dot([turned(int(n), a) for n, a in zip(sequence, angles, strict=True)])
    q = euler(sequence, angles)
    assert_allclose(matrix(q), expected, atol=1e-15)
    assert_allclose(np.linalg.norm(q), 1.0, rtol=1e-15)
    assert_allclose(euler(sequence, np.radians(angles).tolist(), "rad"), q, atol=1e-15)


def test_there_are_twelve():
    assert len(set(SEQUENCES)) == 12


def test_an_axis_of_any_length():
    assert_allclose(axis_angle([0, 0, 5], 60), [math.sqrt(0.75), 0, 0, 0.5], atol=1e-15)
    assert_allclose(axis_angle([0, 1, 0], math.pi / 3, "rad"), [math.sqrt(0.75), 0, 0.5, 0], atol=1e-15)


@pytest.mark.parametrize(
    "make, message",
    [
        (lambda: euler("322", [1, 2, 3]), "euler322 is no sequence of Euler angles. There are 121, 123,"),
        (lambda: euler("zyx", [1, 2, 3]), "euler321|eulerzyx is no sequence"),
        (lambda: euler("321", [1, 2]), "takes three finite angles, there are 2"),
        (lambda: euler("321", [1, 2, math.nan]), "takes three finite angles"),
        (lambda: axis_angle([0, 0, 0], 3), "axis takes three numbers, not all 0"),
    ],
)
def test_what_is_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()
