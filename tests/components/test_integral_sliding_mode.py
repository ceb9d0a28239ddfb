"""Integral sliding mode: the figures at the start, the design of G, the surface, both gains, the network, refusals."""

import numpy as np
import pytest
from geng2012_loop import plant, start
from helpers import Point, numbers
from numpy.testing import assert_allclose
from published import as_in
from scipy.linalg import block_diag, solve_continuous_are
from scipy.spatial.transform import Rotation

IntegralSlidingMode = as_in("geng2012-compensated", "controller")


LAW = IntegralSlidingMode()
J, F = start(LAW, "J"), start(LAW, "delta").T
K, C = np.diag(start(LAW, "Omega") ** 2), np.diag(2 * start(LAW, "zeta") * start(LAW, "Omega"))
G, D = (np.hstack([start(LAW, f"{m}_{n}") for n in ("e", "eta", "omega", "eta_dot")]) for m in "GD")
LINEAR = dict(network=0, constant_gain=0)
RNG = np.random.default_rng(11)


def model(inertia=J):
    """A, B of x = [e, eta, omega, eta'] with u the torque on the hub, from the coupled equations of motion.

    J w' + F eta'' = u and eta'' + C eta' + K eta + F^T w' = 0 as one mass matrix.
    """
    mass = np.block([[inertia, F], [F.T, np.eye(4)]])
    forces = np.block(
        [[np.zeros((3, 3)), np.zeros((3, 4)), np.zeros((3, 7))], [np.zeros((4, 3)), -K, np.zeros((4, 3)), -C]]
    )
    A, B = np.zeros((14, 14)), np.zeros((14, 3))
    A[0:3, 7:10], A[3:7, 10:14] = np.eye(3), np.eye(4)
    A[7:14], B[7:14] = np.linalg.solve(mass, forces), np.linalg.solve(mass, np.eye(7, 3))
    return A, B


def random_state(size=0.05):
    return RNG.normal(0, size, 14)


def at(x, law=LAW, **values) -> Point:
    """The law at the linear state x, the reference at the attitude of no rotation."""
    q = Rotation.from_rotvec(x[:3]).as_quat(scalar_first=True)
    motion = dict(q_BN=q, q_RN=[1, 0, 0, 0], eta=x[3:7], omega_BN_B=x[7:10], eta_dot=x[10:14])
    return Point(law, **motion, **values)


def integral_at(x, integral, law=LAW, **values) -> Point:
    point = at(x, law, **values)
    point.x[:3] = integral
    return point


def test_feedthrough():
    table = LAW.direct_feedthrough
    everything = ("q_BN", "omega_BN_B", "q_RN", "omega_RN_R", "eta", "eta_dot")
    assert table["attitude_error"] == ("q_BN", "q_RN")
    assert all(set(table[n]) == set(everything) for n in ("tau_command_B", "sigma", "s", "rho"))


def test_torque_at_the_start():
    y = Point(LAW).outputs()
    assert_allclose(y["tau_command_B"], [-0.023, 3.504, -0.015], atol=0.001)
    assert_allclose(np.degrees(y["attitude_error"]), [0, -60, 0], atol=1e-12)
    assert_allclose([*y["sigma"], *y["s"], *y["rho"]], 0, atol=1e-15)


def test_unconstrained_frequencies():
    """geng2012, figures: 1.0759, 1.3809, 2.0919, 2.8147 rad/s at nominal J."""
    A, _ = plant(1.0).linearise(Point(plant(1.0)).x)
    poles = np.linalg.eigvals(A)
    found = np.sort(np.abs(poles[poles.imag > 1e-3]))
    assert_allclose(found, [1.0759, 1.3809, 2.0919, 2.8147], rtol=1e-3)


def test_the_gain_is_the_linear_quadratic_one():
    A, B = model()
    Q = block_diag(11.2 * np.eye(3), np.zeros((4, 4)), 390 * np.eye(3), 20 * np.eye(4))
    assert_allclose(G, -B.T @ solve_continuous_are(A, B, Q, np.eye(3)), rtol=1e-5, atol=1e-6)


def test_the_linear_loop_is_stable_for_the_true_inertia_too():
    for inertia in (J, 1.2 * J):
        A, B = model(inertia)
        assert np.linalg.eigvals(A + B @ G).real.max() < -0.04


@pytest.mark.parametrize("wrong", [{"G_e": np.eye(3)}, {"G_omega": 30 * np.eye(3)}], ids=lambda v: next(iter(v)))
def test_a_gain_whose_sign_is_refused_would_be_unstable(wrong):
    A, B = model()
    gains = {n: start(LAW, n) for n in ("G_e", "G_eta", "G_omega", "G_eta_dot")} | wrong
    assert np.linalg.eigvals(A + B @ np.hstack(list(gains.values()))).real.max() > 0.01
    assert len(Point(LAW, **wrong).violated()) == 1


def test_surface_and_its_integral():
    """sigma = D x - I, I(0) = D x(0), I' = D (A + B G) x, s = (D B)^T sigma, with A, B from the mass matrix."""
    A, B = model()
    x, integral = random_state(), RNG.normal(0, 0.1, 3)
    assert_allclose(at(x).states()["integral"], D @ x, rtol=1e-10)
    point = integral_at(x, integral)
    assert_allclose(point.rates()["integral"], D @ (A + B @ G) @ x, rtol=1e-9)
    assert_allclose(point.outputs()["sigma"], D @ x - integral, rtol=1e-10)
    assert_allclose(point.outputs()["s"], (D @ B).T @ (D @ x - integral), rtol=1e-9)


def test_the_surface_as_a_classic_one_would_be_unstable():
    """On D x = 0 zeros of 0.0243 +- 1.938i rad/s remain; with the other sign of D(1,6) they have -0.061."""
    A, B = model()

    def swinging(D):
        values = np.linalg.eigvals(A - B @ np.linalg.solve(D @ B, D @ A))
        return max(values[values.imag > 1.5], key=lambda v: v.real)

    other = D.copy()
    other[0, 5] = -1
    assert_allclose(swinging(D).real, 0.0243, atol=5e-4)
    assert_allclose(swinging(D).imag, 1.938, atol=5e-3)
    assert_allclose(swinging(other).real, -0.061, atol=1e-3)


@pytest.mark.parametrize("network", [0, 1])
def test_both_gains_lead_to_the_surface(network):
    """V = |sigma|^2 / 2 of the exact model never grows: V' = s . (u - G x) <= 0, faster with the larger gain."""
    A, B = model()
    for _ in range(20):
        x, integral = random_state(), RNG.normal(0, 0.3, 3)
        rates = []
        for size in (0.1, 0.3):
            point = integral_at(x, integral, network=network, constant_gain=size, W=np.full((3, 6), size))
            y = point.outputs()
            sigma_dot = D @ (A @ x + B @ y["tau_command_B"]) - point.rates()["integral"]
            rates.append(y["sigma"] @ sigma_dot)
            assert_allclose(rates[-1], y["s"] @ (y["tau_command_B"] - G @ x), rtol=1e-6)
        assert 0 > rates[0] > rates[1]


def test_constant_gain_keeps_the_direction_of_s_and_the_network_does_not():
    x, integral = random_state(), [0.5, -0.02, 0.01]
    for network in (0, 1):
        y = integral_at(x, integral, network=network, constant_gain=0.2, W=1.0).outputs()
        added, s = y["tau_command_B"] - G @ x, y["s"]
        size = np.abs(s) if network else np.linalg.norm(s)
        assert_allclose(added, -y["rho"] * s / (size + 1e-3), rtol=1e-6)
        if not network:
            assert_allclose(y["rho"], 0.2)


def test_network():
    """A node at xi has the value one; at a distance of one width in one input its value is 1/e."""
    x = random_state()
    q = Rotation.from_rotvec(x[:3])
    angles = q.as_euler("ZYX")[::-1]
    W = np.array([[0.1], [0.2], [-0.3]])
    here = dict(angle_centres=angles, omega_centres=x[7:10], torque_centres=G @ x, W=W)
    one = IntegralSlidingMode(nodes=1)
    assert_allclose(at(x, one, **here).outputs()["rho"], W[:, 0], rtol=1e-8)
    widths = {"angle": 0.7, "omega": 0.3, "torque": 2.0}
    for group, width in widths.items():
        away = here | {f"{group}_centres": here[f"{group}_centres"] + [0, width, 0], f"{group}_width": width}
        assert_allclose(at(x, one, **away).outputs()["rho"], W[:, 0] / np.e, rtol=1e-8)


def test_weights_learn_from_the_size_of_sigma():
    x, integral = random_state(), RNG.normal(0, 0.1, 3)
    point = integral_at(x, integral, gamma_W=0.7)
    one = integral_at(x, integral, gamma_W=0.7, W=1.0)
    phi = one.outputs()["rho"][0] / 1.0  # with all weights one: the sum of the nodes
    assert_allclose(point.rates()["W"].sum(axis=1), 0.7 * np.abs(D @ x - integral) * phi, rtol=1e-9)
    assert_allclose(integral_at(x, integral, network=0).rates()["W"], 0)


def test_before_its_start_the_law_waits():
    """No torque, the integral and the weights rest; sigma is zero then and when it begins, for x has not moved."""
    x = random_state()
    waiting, begun = (at(x, start_time=5.0, network=1, t=t) for t in (4.9, 5.0))
    y, rates = waiting.outputs(), waiting.rates()
    assert not y["tau_command_B"].any() and not rates["integral"].any() and not rates["W"].any()
    assert_allclose([*y["sigma"], *begun.outputs()["sigma"]], 0, atol=1e-15)
    assert begun.outputs()["tau_command_B"].all() and begun.rates()["integral"].all()


def test_printed_gain_has_no_attitude_feedback():
    A, B = model()
    x = random_state()
    printed = -np.linalg.solve(D @ B, D @ A)
    u = at(x, printed_gain=1, **LINEAR).outputs()["tau_command_B"]
    assert_allclose(u, printed @ x, rtol=1e-8)
    assert_allclose(printed[:, :3], 0, atol=1e-12)
    assert_allclose(Point(LAW, printed_gain=1, **LINEAR).outputs()["tau_command_B"], 0, atol=1e-15)


def test_zero_error_is_an_equilibrium():
    point = at(np.zeros(14))
    assert_allclose(point.outputs()["tau_command_B"], 0, atol=1e-15)
    assert_allclose(point.rates_flat(), 0, atol=1e-15)


def test_the_rate_is_that_relative_to_the_reference():
    q = Rotation.from_rotvec([0.3, -0.2, 0.5]).as_quat(scalar_first=True)
    w = [0.02, -0.01, 0.03]
    moving = Point(LAW, q_BN=q, omega_BN_B=w, q_RN=q, omega_RN_R=w).outputs()
    assert_allclose(moving["tau_command_B"], 0, atol=1e-14)


def apart(**values) -> tuple[Point, np.ndarray]:
    """The law with body and reference at different attitudes, both turning, and e, w by scipy."""
    reference, error = Rotation.from_rotvec([0.9, -0.4, 0.7]), Rotation.from_rotvec([0.3, -0.2, 0.5])
    w, w_d = np.array([0.02, -0.01, 0.03]), np.array([-0.04, 0.05, 0.02])
    attitudes = {n: r.as_quat(scalar_first=True) for n, r in (("q_BN", reference * error), ("q_RN", reference))}
    point = Point(LAW, **attitudes, omega_BN_B=w, omega_RN_R=w_d, **values)
    return point, np.concatenate([error.as_rotvec(), np.zeros(4), w - error.inv().apply(w_d), np.zeros(4)])


def test_the_rate_of_the_reference_is_taken_into_the_body():
    point, x = apart(**LINEAR)
    assert_allclose(point.outputs()["tau_command_B"], G @ x, rtol=1e-9)
    assert_allclose(point.states()["integral"], D @ x, rtol=1e-9)


def test_the_network_sees_the_attitude_from_the_inertial_frame():
    """A node at roll, pitch, yaw of q_BN, the body's own rate and G x has the value one."""
    _, x = apart()
    body = Rotation.from_rotvec([0.9, -0.4, 0.7]) * Rotation.from_rotvec([0.3, -0.2, 0.5])
    here = dict(angle_centres=body.as_euler("ZYX")[::-1], omega_centres=[0.02, -0.01, 0.03], torque_centres=G @ x)
    centres = {name: np.tile(np.reshape(value, (3, 1)), (1, 6)) for name, value in here.items()}
    W = np.zeros((3, 6))
    W[:, 0] = [0.1, 0.2, -0.3]
    point, _ = apart(**centres, W=W)
    assert_allclose(point.outputs()["rho"], W[:, 0], rtol=1e-9)


@pytest.mark.parametrize("structure", [dict(modes=0), dict(modes=2), dict(modes=6), dict(nodes=1), dict(nodes=0)])
def test_any_number_of_modes_and_nodes(structure):
    point = Point(IntegralSlidingMode(**structure))
    assert point.violated() == []
    assert np.isfinite(point.outputs_flat()).all()


REFUSALS = {
    "J": ({"J": np.diag([-1.0, 60, 90])}, ["J is not positive definite", "smallest eigenvalue -1 kg.m2"]),
    "modes": ({"J": np.diag([40.0, 60, 90])}, ["J - delta^T delta is not positive definite"]),
    "epsilon": ({"epsilon": 0.0}, ["epsilon = 0 N.m/s", "must be positive"]),
    "width": ({"omega_width": -1.0}, ["omega_width = -1 rad/s", "must be positive"]),
    "constant gain": ({"constant_gain": -0.1}, ["constant_gain = -0.1 N.m", "must not be negative"]),
    "gamma": ({"gamma_W": -1.0}, ["gamma_W = -1 1/s", "must not be negative"]),
    "network": ({"network": 0.5}, ["network = 0.5", "0 or 1"]),
    "sign of G_e": (
        {"G_e": np.diag([-3.0, 1.0, -3.0])},
        ["-G_e is not positive definite (smallest eigenvalue of its symmetric part -1 N.m/rad)", "sign of G_e"],
    ),
    "sign of G_omega": (
        {"G_omega": 30 * np.eye(3)},
        ["-G_omega is not positive definite (smallest eigenvalue of its symmetric part -30 N.m.s/rad)", "G_omega w"],
    ),
    "surface": ({"D_omega": np.zeros((3, 3)), "D_eta_dot": np.zeros((3, 4))}, ["D B is singular"]),
}


@pytest.mark.parametrize("case", REFUSALS)
def test_refusals(case):
    values, words = REFUSALS[case]
    messages = Point(LAW, **values).violated()
    assert any(all(word in message for word in words) for message in messages), messages


def test_outputs_are_finite_at_half_a_turn_and_at_a_pitch_of_90_deg():
    for angle, lock in ((np.pi, 0), (np.pi / 2, 1)):
        q = Rotation.from_rotvec([0, angle, 0]).as_quat(scalar_first=True)
        point = Point(LAW, q_BN=q, q_RN=[1, 0, 0, 0])
        assert np.isfinite(numbers(point.outputs_flat())).all()
        assert point.outputs()["gimbal_lock"] == lock
