"""Attitude helpers against scipy's Rotation and against differences of it."""

import casadi as ca
import numpy as np
import pytest
from helpers import numbers
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from components.mathematics import euler, mrp, quaternion, rbf, vectors

RNG = np.random.default_rng(1)
ROTATIONS = [Rotation.from_quat(q) for q in RNG.normal(size=(8, 4))]


def column(r: Rotation) -> ca.DM:
    return ca.DM(r.as_quat(scalar_first=True))


def small_turn(r: Rotation, omega: np.ndarray, h: float) -> Rotation:
    """The attitude after h at the body rate omega."""
    return r * Rotation.from_rotvec(omega * h)


@pytest.mark.parametrize("r", ROTATIONS)
def test_quaternion_is_scalar_first_and_takes_body_to_inertial(r):
    v = RNG.normal(size=3)
    assert_allclose(numbers(quaternion.rotate(column(r), ca.DM(v))), r.apply(v), atol=1e-14)
    assert_allclose(quaternion.dcm(column(r)).full(), r.as_matrix().T, atol=1e-14)


@pytest.mark.parametrize(("a", "b"), list(zip(ROTATIONS, ROTATIONS[::-1], strict=True)))
def test_product_conjugate_and_error(a, b):
    product = numbers(quaternion.product(column(a), column(b)))
    expected = (a * b).as_quat(scalar_first=True)
    assert_allclose(product * np.sign(product @ expected), expected, atol=1e-14)
    error = quaternion.error(column(a), column(b))
    assert float(error[0]) >= 0
    assert_allclose(numbers(quaternion.rotation_vector(error)), (b.inv() * a).as_rotvec(), atol=1e-12)


@pytest.mark.parametrize("r", ROTATIONS)
def test_quaternion_rate(r):
    omega, h = RNG.normal(size=3), 1e-5
    after, before = (column(small_turn(r, omega, d)).full().ravel() for d in (h, -h))
    difference = (after * np.sign(after @ before) - before) / (2 * h)
    rate = numbers(quaternion.rate(column(r), ca.DM(omega)))
    assert_allclose(rate * np.sign(numbers(column(r)) @ before), difference, atol=1e-9)


@pytest.mark.parametrize("angle", [0.0, 1e-12, 1e-7, 1.9e-4, 2.1e-4, 0.3, 3.1, np.pi])
def test_rotation_vector_near_and_far(angle):
    axis = np.array([0.6, -0.48, 0.64])
    q = column(Rotation.from_rotvec(angle * axis))
    assert_allclose(numbers(quaternion.rotation_vector(q)), angle * axis, rtol=1e-14, atol=1e-300)


@pytest.mark.parametrize("angle", [0.0, 1e-12, 1e-5, 0.99e-2, 1.01e-2, 0.3, 3.1, 5.0])
def test_quaternion_of_a_rotation_vector_near_and_far(angle):
    """The quaternion, and its slope by differences of scipy's (central: 1e-10 and rounding)."""
    e = angle * np.array([0.6, -0.48, 0.64])
    found = numbers(quaternion.from_rotation_vector(ca.DM(e)))
    assert_allclose(found, [np.cos(angle / 2), *(np.sinc(angle / 2 / np.pi) / 2 * e)], rtol=1e-15, atol=1e-300)
    assert_allclose(found * np.sign(found[0]), numbers(quaternion.short(column(Rotation.from_rotvec(e)))), atol=4e-16)
    v, h = ca.SX.sym("v", 3), 1e-5
    slope = ca.Function("slope", [v], [ca.jacobian(quaternion.from_rotation_vector(v), v)])(e).full()
    turned = lambda d: np.array([np.cos(np.linalg.norm(d) / 2), *(np.sinc(np.linalg.norm(d) / 2 / np.pi) / 2 * d)])  # noqa: E731
    differences = [(turned(e + h * axis) - turned(e - h * axis)) / (2 * h) for axis in np.eye(3)]
    assert_allclose(slope, np.transpose(differences), atol=1e-10)


@pytest.mark.parametrize("r", ROTATIONS)
def test_a_small_turn_of_an_attitude(r):
    """To third order the turn by the vector itself, |n|^3 / 12; of unit length."""
    n = 1e-3 * RNG.normal(size=3)
    found = numbers(quaternion.turned(column(r), ca.DM(n)))
    error = (r * Rotation.from_rotvec(n)).inv() * Rotation.from_quat(found, scalar_first=True)
    assert error.magnitude() < np.linalg.norm(n) ** 3 / 12 + 1e-15
    assert abs(np.linalg.norm(found) - 1) < 4e-16


def test_rotation_vector_has_a_slope_at_zero():
    q = ca.SX.sym("q", 4)
    slope = ca.Function("slope", [q], [ca.jacobian(quaternion.rotation_vector(q), q)])([1, 0, 0, 0])
    assert_allclose(slope.full(), np.hstack([np.zeros((3, 1)), 2 * np.eye(3)]))


SEQUENCES = {  # scipy's name, the order of its angles, functions
    "123": ("XYZ", slice(None), euler.quaternion_from_123, euler.angles_123),
    "321": ("ZYX", slice(None, None, -1), euler.quaternion_from_321, euler.angles_321),
}


@pytest.mark.parametrize("sequence", SEQUENCES)
@pytest.mark.parametrize("r", ROTATIONS)
def test_euler_angles(sequence, r):
    name, order, to_quaternion, to_angles = SEQUENCES[sequence]
    angles = r.as_euler(name)[order]
    assert_allclose(numbers(to_angles(column(r))), angles, atol=1e-12)
    assert_allclose(numbers(to_angles(to_quaternion(ca.DM(angles)))), angles, atol=1e-12)
    back = Rotation.from_quat(numbers(to_quaternion(ca.DM(angles))), scalar_first=True)
    assert (back.inv() * r).magnitude() < 1e-12


def euler_rates(r: Rotation, omega: np.ndarray, name: str, order: slice, h: float = 1e-5) -> np.ndarray:
    after, before = (small_turn(r, omega, d).as_euler(name)[order] for d in (h, -h))
    return (after - before) / (2 * h)


@pytest.mark.parametrize("r", ROTATIONS)
def test_rates_of_the_angles(r):
    omega = RNG.normal(size=3)
    for name, order, _, to_angles in SEQUENCES.values():
        theta, rates = to_angles(column(r)), euler_rates(r, omega, name, order)
        if name == "XYZ":
            assert_allclose(numbers(euler.F_123(theta) @ omega), rates, rtol=1e-7, atol=1e-7)
            assert_allclose(numbers(euler.G_123(theta) @ rates), omega, rtol=1e-7, atol=1e-7)
        else:
            assert_allclose(numbers(euler.rates_321(theta, ca.DM(omega))), rates, rtol=1e-7, atol=1e-7)


@pytest.mark.parametrize("r", ROTATIONS)
def test_second_derivative_of_the_angles(r):
    omega, omega_dot, h = RNG.normal(size=3), RNG.normal(size=3), 1e-4
    theta = r.as_euler("XYZ")
    rates = numbers(euler.F_123(ca.DM(theta)) @ omega)
    # the attitude after h to the second order in h: the body rate turns by omega_dot h / 2 on the way
    after, before = (small_turn(r, omega + omega_dot * d / 2, d).as_euler("XYZ") for d in (h, -h))
    second = (after - 2 * theta + before) / h**2
    found = numbers(euler.acceleration_123(ca.DM(theta), ca.DM(rates), ca.DM(omega_dot)))
    assert_allclose(found, second, rtol=1e-4, atol=1e-4)


def difference(function, point, rate, h=1e-6):
    return (function(ca.DM(point + h * rate)).full() - function(ca.DM(point - h * rate)).full()) / (2 * h)


def test_derivatives_of_the_rate_matrices():
    theta, rates = RNG.uniform(-1, 1, 3), RNG.normal(size=3)
    for matrix, derivative in ((euler.G_123, euler.G_dot_123), (mrp.G, mrp.G_dot)):
        result = derivative(ca.DM(theta), ca.DM(rates)).full()
        assert_allclose(result, difference(matrix, theta, rates), rtol=1e-8, atol=1e-8)


@pytest.mark.parametrize("r", ROTATIONS)
def test_mrp(r):
    omega, h = RNG.normal(size=3), 1e-5
    q = column(r)
    sigma = numbers(mrp.from_quaternion(q * (-1 if float(q[0]) < 0 else 1)))
    assert_allclose(sigma, r.as_mrp(), atol=1e-13)
    after, before = (small_turn(r, omega, d).as_mrp() for d in (h, -h))
    assert_allclose(numbers(mrp.G(ca.DM(sigma)) @ omega), (after - before) / (2 * h), atol=1e-8)
    assert_allclose((mrp.G(ca.DM(sigma)) @ mrp.G_inverse(ca.DM(sigma))).full(), np.eye(3), atol=1e-13)


@pytest.mark.parametrize("r", ROTATIONS)
def test_the_shadow_set_is_the_other_quaternion_and_the_same_attitude(r):
    sigma, shadow = (numbers(mrp.from_quaternion(sign * column(r))) for sign in (1, -1))
    assert_allclose(np.linalg.norm(sigma) * np.linalg.norm(shadow), 1, rtol=1e-12)
    assert (Rotation.from_mrp(sigma).inv() * Rotation.from_mrp(shadow)).magnitude() < 1e-12


def test_vectors():
    a = RNG.normal(size=3)
    assert_allclose(float(vectors.length(ca.DM(a))), np.linalg.norm(a))
    v = ca.SX.sym("v", 3)
    slope = ca.Function("slope", [v], [vectors.length(v), ca.gradient(vectors.length(v), v)])
    at_zero = slope(ca.DM.zeros(3))
    assert float(at_zero[0]) == 0.0
    assert_allclose(numbers(at_zero[1]), 0)


@pytest.mark.parametrize("kind", ["random", "diagonal", "equal", "indefinite"])
def test_smallest_eigenvalue(kind):
    A = RNG.normal(size=(3, 3))
    A = {"random": A @ A.T, "diagonal": np.diag([3.0, 1.0, 2.0]), "equal": 5 * np.eye(3), "indefinite": A + A.T}[kind]
    expected = np.linalg.eigvalsh(A)[0]
    assert_allclose(float(vectors.smallest_eigenvalue(ca.DM(A))), expected, rtol=1e-7, atol=1e-7)
    A[0, 1] += 0.25
    assert_allclose(float(vectors.asymmetry(ca.DM(A))), 0.25)


def test_gaussian():
    centres = np.array([[0.0, 1.0], [0.0, 0.0]])
    h = numbers(rbf.gaussian((ca.DM([0, 0]), ca.DM(centres), 0.5)))
    assert_allclose(h, [1, np.exp(-2)])  # at the centre; two widths away
    both = rbf.gaussian((ca.DM([0, 0]), ca.DM(centres), 0.5), (ca.DM([3]), ca.DM([[0, 3]]), 1.0))
    assert_allclose(numbers(both), [np.exp(-4.5), np.exp(-2)])  # a product over the groups
