"""Algebra of redundant actuators and of bounded estimates, against numpy and by their properties."""

import casadi as ca
import numpy as np
import pytest
from helpers import numbers
from numpy.testing import assert_allclose
from scipy.linalg import null_space

from components.mathematics import allocation, cmg, projection

RNG = np.random.default_rng(1)
A = RNG.normal(size=(3, 7))
v = RNG.normal(size=3)


def test_the_weighted_inverse_is_the_least_by_its_weights():
    W = RNG.uniform(0.1, 10, 7)
    x = numbers(allocation.weighted_inverse(ca.DM(A), ca.DM(W)) @ v)
    assert_allclose(A @ x, v, rtol=1e-12)
    assert_allclose((x / W) @ null_space(A), 0.0, atol=1e-12)  # x . W^-1 x is stationary along all that gives no torque
    alike = numbers(allocation.weighted_inverse(ca.DM(A), ca.DM.ones(7)) @ v)
    assert_allclose(alike, np.linalg.pinv(A) @ v, rtol=1e-10)


def test_the_robust_inverse_takes_matrices_and_stands_a_singularity():
    singular = np.array([[1.0, -1.0], [0.0, 0.0]])
    W, V = np.array([[1.0, 0.01], [0.01, 1.0]]), 0.01 * np.array([[1.0, 0.1], [0.1, 1.0]])
    x = numbers(allocation.robust_inverse(ca.DM(singular), ca.DM(W), ca.DM(V)) @ np.array([1.0, 1.0]))
    assert_allclose(x, W @ singular.T @ np.linalg.solve(singular @ W @ singular.T + V, [1.0, 1.0]))
    assert np.isfinite(x).all()


@pytest.mark.parametrize("shape", [(3, 4), (3, 3), (3, 2), (2, 2), (3, 1)])
def test_singularity_is_the_product_of_the_squared_singular_values(shape):
    M = RNG.normal(size=shape)
    assert_allclose(float(ca.DM(allocation.singularity(ca.DM(M)))), np.prod(np.linalg.svd(M)[1] ** 2), rtol=1e-10)


def test_limits_keep_the_direction():
    x = ca.DM([1.0, -4.0, 0.0])
    assert_allclose(numbers(allocation.limited(x, ca.DM([2.0, 2.0, 1.0]))), [0.5, -2.0, 0.0])
    assert_allclose(numbers(allocation.limited(x, 8.0)), numbers(x))
    assert_allclose(numbers(allocation.dead_zone(x, 1.5)), [0.0, -4.0, 0.0])


def test_a_rotors_momentum_moves_along_its_transverse_axis():
    """s' = gamma' t for any columns, which is what keeps the momentum of a misaligned cluster."""
    s_0, t_0, gamma, h = RNG.normal(size=(3, 4)), RNG.normal(size=(3, 4)), RNG.normal(size=4), 1e-6
    after, before = (cmg.rotated(ca.DM(s_0), ca.DM(t_0), ca.DM(gamma + k * h))[0].full() for k in (1, -1))
    assert_allclose((after - before) / (2 * h), cmg.rotated(ca.DM(s_0), ca.DM(t_0), ca.DM(gamma))[1].full(), atol=1e-9)


def test_projection():
    b, d, phi = 0.05, 0.1, np.array([1.0, 2.0, -0.5])
    edge = np.sqrt(b + d) * phi / np.linalg.norm(phi)
    assert_allclose(numbers(projection.smooth(ca.DM(edge), ca.DM(phi), b, d)), 0.0, atol=1e-14)  # nothing outward left
    assert_allclose(numbers(projection.smooth(ca.DM(edge), ca.DM(-phi), b, d)), -phi)  # inward: as it is
    inside = np.sqrt(b / 2) * phi / np.linalg.norm(phi)
    assert_allclose(numbers(projection.smooth(ca.DM(inside), ca.DM(phi), b, d)), phi)
    assert_allclose(numbers(projection.smooth(ca.DM.zeros(3), ca.DM(phi), b, d)), phi)
    across = np.array([2.0, -1.0, 0.0])  # along the edge: as it is
    assert_allclose(numbers(projection.smooth(ca.DM(edge), ca.DM(across), b, d)), across, atol=1e-15)
    steps = [numbers(projection.smooth(ca.DM(k * edge), ca.DM(phi), b, d)) for k in np.linspace(0.5, 1, 201)]
    assert np.abs(np.diff(steps, axis=0)).max() < 0.05  # no jump
