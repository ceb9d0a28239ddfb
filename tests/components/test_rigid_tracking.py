"""Quaternion feedback and the linear-quadratic regulator: laws, gains, Lyapunov functions, Basilisk, scipy."""

import numpy as np
import pytest
from helpers import Point, assert_units, numbers
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp
from scipy.linalg import solve_continuous_are, sqrtm
from scipy.spatial.transform import Rotation

from components.catalog import CATALOG
from components.framework import ComponentError
from cosim.slaves.fmi2 import FmuSlave
from fmus.export.build import build_reference

LAWS = ("LinearQuadraticRegulator", "QuaternionFeedback")
every = pytest.mark.parametrize("name", LAWS)
J = np.array([[30.0, 2.0, -1.0], [2.0, 20.0, 3.0], [-1.0, 3.0, 25.0]])
AXIS = np.array([2.0, -1.0, 2.0]) / 3


def quaternion(rotation) -> np.ndarray:
    return rotation.as_quat(scalar_first=True)


def attitude(rng):
    """A reference and a body at random, and both rates and the reference's acceleration in their axes."""
    reference, error = Rotation.random(rng=rng), Rotation.from_rotvec(rng.uniform(-1.7, 1.7, 3))
    return reference, error, *rng.uniform(-0.1, 0.1, (3, 3))


def at(part, reference, error, w, w_R, w_R_dot, **values):
    inputs = dict(omega_BN_B=w, omega_RN_R=w_R, omega_dot_RN_R=w_R_dot)
    return Point(part, q_RN=quaternion(reference), q_BN=quaternion(reference * error), **inputs, **values)


def command(point) -> np.ndarray:
    return point.outputs()["tau_command_B"]


def basilisk(module, sigma_BR, omega_BR_B, omega_RN_B, omega_dot_RN_B) -> np.ndarray:
    """What an attitude control module of Basilisk, called once, commands for a vehicle of inertia J, N m."""
    from Basilisk.architecture import messaging

    guidance, vehicle = messaging.AttGuidMsgPayload(), messaging.VehicleConfigMsgPayload()
    guidance.sigma_BR, guidance.omega_BR_B = list(sigma_BR), list(omega_BR_B)
    guidance.omega_RN_B, guidance.domega_RN_B = list(omega_RN_B), list(omega_dot_RN_B)
    vehicle.ISCPntB_B = list(np.ravel(J))
    sources = messaging.AttGuidMsg().write(guidance), messaging.VehicleConfigMsg().write(vehicle)
    module.guidInMsg.subscribeTo(sources[0])
    module.vehConfigInMsg.subscribeTo(sources[1])
    module.SelfInit()
    module.Reset(0)
    module.UpdateState(0)
    return np.array(module.cmdTorqueOutMsg.read().torqueRequestBody)


# ---- both ----------------------------------------------------------------------------------------------------------


@every
def test_direct_feedthrough(name):
    seen = ("q_BN", "omega_BN_B", "q_RN", "omega_RN_R", "omega_dot_RN_R")
    table = CATALOG[name]().direct_feedthrough
    assert table == {"tau_command_B": seen, "attitude_error": ("q_BN", "q_RN")}
    assert CATALOG[name](momentum=1).direct_feedthrough["tau_command_B"] == (*seen, "h_B")


@every
def test_units_with_gains_and_momentum(name):
    given = {"K_q": J, "K_w": 2 * J} if name == "QuaternionFeedback" else {}
    assert_units(CATALOG[name](momentum=1, **given))


@every
@pytest.mark.parametrize("momentum", [0, 1])
def test_a_body_on_its_reference_stays_on_it(name, momentum):
    """Without an error the torque is what a rigid body with wheels takes: the rate of its inertial momentum, in N.

    By differences of a rotation that scipy makes, over 1 ms to fourth order.
    """
    h_B, rate, slope, turn = np.array([3.0, -2.0, 1.0]), np.array([0.3, -0.2, 0.5]), np.array([0.1, 0.2, -0.3]), 2.0

    def motion(t):
        """Attitude, and rate in body axes, of a turn about an axis that turns itself."""
        first = Rotation.from_rotvec(np.outer(np.sin(turn * t), rate))
        second = Rotation.from_rotvec(np.outer(t, slope))
        own = first.inv().apply(slope) + turn * np.cos(turn * t)[:, None] * rate
        return second * first, own

    t = 0.4 + 1e-3 * np.arange(-2, 3)
    q, w = motion(t)
    H_N = q.apply(w @ J + momentum * h_B)
    weights = np.array([1, -8, 0, 8, -1]) / 12e-3
    inertial = q[2].inv().apply(weights @ q.apply(w))
    point = Point(
        CATALOG[name](momentum=momentum),
        J=J,
        q_BN=-quaternion(q[2]),
        q_RN=quaternion(q[2]),
        omega_BN_B=w[2],
        omega_RN_R=w[2],
        omega_dot_RN_R=inertial,
        **({"h_B": h_B} if momentum else {}),
    )
    expected = q[2].inv().apply(weights @ H_N)
    assert_allclose(command(point), expected, atol=1e-9 * np.abs(expected).max())  # the differences' h^4
    point.u[:] = Point(CATALOG[name](momentum=momentum)).u
    assert not command(point).any()  # at rest on a reference at rest: none


def closed_loop(name, q0, w0, stop, rows=400, **values):
    """A rigid body under the law, its reference at rest, by DOP853; (t, q_BN, w) with equations of this test."""
    point = Point(CATALOG[name](), J=J, **values)

    def rates(t, x):
        q, w = x[:4], x[4:]
        point.u[:4], point.u[4:7] = q / np.linalg.norm(q), w
        matrix = np.array(
            [[0, -w[0], -w[1], -w[2]], [w[0], 0, w[2], -w[1]], [w[1], -w[2], 0, w[0]], [w[2], w[1], -w[0], 0]]
        )
        return np.concatenate([matrix @ q / 2, np.linalg.solve(J, command(point) - np.cross(w, J @ w))])

    t = np.linspace(0, stop, rows)
    found = solve_ivp(rates, (0, stop), np.concatenate([q0, w0]), "DOP853", t_eval=t, rtol=1e-10, atol=1e-15)
    return t, found.y[:4].T, found.y[4:].T


def lyapunov(name, q, w, gain):
    short = q * np.where(q[:, :1] < 0, -1, 1)
    if name == "QuaternionFeedback":
        return 2 * (1 - short[:, 0]) + np.einsum("ti,ij,tj->t", w, np.linalg.solve(gain, J), w) / 2
    e = Rotation.from_quat(short, scalar_first=True).as_rotvec()
    return gain * np.sum(e**2, axis=1) / 2 + np.einsum("ti,ij,tj->t", w, J, w) / 2


@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("QuaternionFeedback", {}),
        ("QuaternionFeedback", {"K_q": 5 * np.eye(3), "K_w": np.diag([10.0, 20.0, 30.0]), "gyroscopic": 0.0}),
        ("LinearQuadraticRegulator", {}),
        ("LinearQuadraticRegulator", {"gyroscopic": 0.0}),
    ],
    ids=["bandwidth", "given gains", "regulator", "regulator, w x J w left"],
)
def test_the_lyapunov_function_falls_at_its_rate(name, values):
    """From 150 deg and turning fast: V' = -w . K_q^-1 K_w w, or -w . K_d w, and V ends near zero.

    Of a K_q that is a number times the identity w x J w need not be cancelled: w . (w x J w) = 0.
    """
    q0 = quaternion(Rotation.from_rotvec(np.radians(150) * AXIS))
    part = CATALOG[name]()
    t, q, w = closed_loop(name, q0, [0.1, -0.2, 0.05], 60.0, 6001, **values)
    c = dict(zip(("k", "d"), np.split(Point(part, J=J, **values).c, [-9]), strict=True))
    k = c["k"].reshape(3, 3) if name == "QuaternionFeedback" else c["k"][0]
    d = c["d"].reshape(3, 3)
    V = lyapunov(name, q, w, k)
    loss = np.linalg.solve(k, d) if name == "QuaternionFeedback" else d
    expected = -np.einsum("ti,ij,tj->t", w, loss, w)
    h = t[1] - t[0]
    slope = (8 * (V[3:-1] - V[1:-3]) - (V[4:] - V[:-4])) / (12 * h)
    assert_allclose(slope, expected[2:-2], atol=1e-6 * np.abs(expected).max())  # DOP853's 1e-10 over h
    assert (np.diff(V) < 1e-9 * V[0]).all() and V[-1] < 1e-3 * V[0]


@every
def test_either_quaternion_of_an_attitude_gives_one_torque(name):
    rng = np.random.default_rng(7)
    reference, error, w, w_R, w_R_dot = attitude(rng)
    one = at(CATALOG[name](), reference, error, w, w_R, w_R_dot)
    expected = command(one)
    one.u[:4] = -one.u[:4]
    assert_allclose(command(one), expected, rtol=1e-13)


@every
@pytest.mark.parametrize("backend", ["native", "python"])
def test_its_fmu_commands_the_same(name, backend):
    """Of either back end, with an inertia given before initialization: what the equations say, but for rounding."""
    slave = FmuSlave("law", build_reference(f"{name}:momentum=1", backend))
    references = {n: v.value_reference for n, v in slave.description.variables.items()}
    reference, error, w, w_R, w_R_dot = attitude(np.random.default_rng(11))
    point = at(CATALOG[name](momentum=1), reference, error, w, w_R, w_R_dot, h_B=[1.0, -2.0, 3.0], J=J)
    slave.instantiate()
    slave.setup_experiment(0.0)
    slave.set_real(tuple(references[f"J[{i},{k}]"] for i in (1, 2, 3) for k in (1, 2, 3)), J.ravel())
    slave.enter_initialization_mode()
    slave.set_real(tuple(v.value_reference for v in slave.description.inputs), point.u)
    slave.exit_initialization_mode()
    found = slave.get_real(tuple(references[f"tau_command_B[{i}]"] for i in (1, 2, 3)))
    assert_allclose(found, command(point), rtol=1e-13)


REFUSED = [
    ("bandwidth", 0.0, "bandwidth = 0 rad/s: it must be positive."),
    ("damping", -1.0, "damping = -1: it must be positive."),
    (
        "K_q",
        -np.eye(3),
        "K_q is not positive definite (smallest eigenvalue -1 N.m): it drives the body away. Give one ",
    ),
    ("K_w", -np.eye(3), "K_w is not positive definite (smallest eigenvalue -1 N.m.s/rad): it drives the body away."),
    ("acceptable_error", 0.0, "acceptable_error = 0 rad: it must be positive."),
    ("acceptable_rate", 0.0, "acceptable_rate = 0 rad/s: it must be positive."),
    ("acceptable_torque", -1.0, "acceptable_torque = -1 N.m: it must be positive."),
]


@pytest.mark.parametrize(("parameter", "value", "message"), REFUSED)
def test_what_cannot_be_is_refused(parameter, value, message):
    name = LAWS[0] if parameter.startswith("acceptable") else LAWS[1]
    assert any(message in text for text in Point(CATALOG[name](), **{parameter: value}).violated())


@every
def test_momentum_is_taken_or_not(name):
    with pytest.raises(ComponentError, match=f"{name}: momentum = 2: it is 0, or 1 to take h_B"):
        CATALOG[name](momentum=2)


# ---- quaternion feedback -------------------------------------------------------------------------------------------


def test_the_linear_loop_has_bandwidth_and_damping():
    """About every axis, whatever the inertia: e = e0 of the closed form of a second order, from 1e-4 rad."""
    b, c = 0.7, 0.4
    q0 = quaternion(Rotation.from_rotvec(1e-4 * AXIS))
    t, q, _ = closed_loop("QuaternionFeedback", q0, [0, 0, 0], 20.0, bandwidth=b, damping=c)
    e = Rotation.from_quat(q, scalar_first=True).as_rotvec()
    fast = b * np.sqrt(1 - c**2)
    expected = np.exp(-c * b * t) * (np.cos(fast * t) + c * b / fast * np.sin(fast * t))
    assert_allclose(e, 1e-4 * np.outer(expected, AXIS), atol=1e-4 * 1e-8)  # third order in 1e-4, and DOP853


def test_a_slew_from_rest_is_about_one_axis():
    """The paper's eigenaxis rotation: with K and D like J and w x J w cancelled, of a body with a full inertia."""
    _, q, w = closed_loop("QuaternionFeedback", quaternion(Rotation.from_rotvec(2.5 * AXIS)), [0, 0, 0], 40.0)
    assert np.abs(np.cross(w, AXIS)).max() < 1e-9 * np.abs(w).max() + 1e-12
    assert np.abs(np.cross(q[:, 1:], AXIS)).max() < 1e-9


def test_given_gains_take_the_place_of_those_of_the_inertia():
    K, D = np.diag([5.0, 6.0, 7.0]), np.array([[30.0, 1, 0], [1, 40, 2], [0, 2, 50]])
    point = Point(CATALOG["QuaternionFeedback"](), J=J, K_q=K, bandwidth=0.3, damping=0.8)
    assert_allclose(point.c, np.concatenate([K.ravel(), 2 * 0.8 * 0.3 * J.ravel()]), rtol=1e-14)
    point = Point(CATALOG["QuaternionFeedback"](), J=J, K_w=D, bandwidth=0.3)
    assert_allclose(point.c, np.concatenate([2 * 0.09 * J.ravel(), D.ravel()]), rtol=1e-14)


@pytest.mark.peers
@pytest.mark.parametrize(("gyroscopic", "kind"), [(0.0, "mrpPD"), (1.0, "mrpFeedback")])
def test_basilisk_says_the_same_of_quaternion_feedback(gyroscopic, kind):
    """Its modules take sigma = qv/(1 + q0): of a gain K (1 + q0), at each attitude anew, they make K qv."""
    pytest.importorskip("Basilisk")
    from Basilisk.fswAlgorithms import mrpFeedback, mrpPD

    rng, K, D = np.random.default_rng(8), 4.0, 30.0
    part = CATALOG["QuaternionFeedback"](J=J, K_q=K * np.eye(3), K_w=D * np.eye(3))
    for _ in range(20):
        reference, error, w, w_R, w_R_dot = attitude(rng)
        found = command(at(part, reference, error, w, w_R, w_R_dot, gyroscopic=gyroscopic))
        q = quaternion(error) * np.sign(quaternion(error)[0])
        into = error.inv().apply
        module = mrpPD.mrpPD() if kind == "mrpPD" else mrpFeedback.mrpFeedback()
        module.K, module.P = K * (1 + q[0]), D
        if kind == "mrpFeedback":
            module.Ki, module.controlLawType = -1.0, 1  # no integral; the body's rate before J w, not the reference's
        expected = basilisk(module, q[1:] / (1 + q[0]), w - into(w_R), into(w_R), into(w_R_dot))
        assert_allclose(found, expected, rtol=1e-9, atol=1e-9)


# ---- linear-quadratic regulator ------------------------------------------------------------------------------------


def design(E, W, T, inertia):
    """(gain, P) of scipy for e' = w, J w' = tau with weights 1/E^2, 1/W^2 and 1/T^2."""
    zero, one, inverse = np.zeros((3, 3)), np.eye(3), np.linalg.inv(inertia)
    A, B = np.block([[zero, one], [zero, zero]]), np.vstack([zero, inverse])
    Q, R = np.diag([E**-2] * 3 + [W**-2] * 3), T**-2 * one
    P = solve_continuous_are(A, B, Q, R)
    return T**2 * B.T @ P, P


INERTIAS = [J, np.diag([300.0, 200.0, 250.0]), np.diag([5.0, 5.0, 8.0]), 7.0 * np.eye(3), np.diag([0.02, 10.0, 10.0])]


@pytest.mark.parametrize("inertia", INERTIAS, ids=["full", "diagonal", "two alike", "a sphere", "a rod"])
@pytest.mark.parametrize("weights", [(0.1, 0.02, 1.0), (0.01, 1e9, 0.3), (1.0, 1e-3, 2.0)], ids=str)
def test_the_gains_are_those_of_the_riccati_equation(inertia, weights):
    """scipy's own accuracy, by the residual of what it solves, is some 1e-10 of a rod's smallest gain."""
    names = ("acceptable_error", "acceptable_rate", "acceptable_torque")
    c = Point(CATALOG["LinearQuadraticRegulator"](), J=inertia, **dict(zip(names, weights, strict=True))).c
    gain, P = design(*weights, inertia)
    found = np.hstack([c[0] * np.eye(3), c[1:].reshape(3, 3)])
    assert_allclose(found, gain, atol=1e-8 * np.abs(gain).max())
    k, K_d, T = c[0], c[1:].reshape(3, 3), weights[2]
    cost = np.block([[k * K_d, k * inertia], [k * inertia, inertia @ K_d]]) / T**2
    assert_allclose(cost, P, atol=1e-8 * np.abs(P).max())


def test_the_square_root_is_scipys():
    rng = np.random.default_rng(9)
    for size in ([1.0, 1.0, 1.0], [1.0, 1.0, 5.0], [3.0, 2.0, 1e-4], [1e6, 2e6, 3e6]):
        R = Rotation.random(rng=rng).as_matrix()
        inertia = R @ np.diag(size) @ R.T  # with k = 1/2 and any rate K_d is its root
        values = {"acceptable_error": 2.0, "acceptable_torque": 1.0, "acceptable_rate": 1e12}
        K_d = Point(CATALOG["LinearQuadraticRegulator"](), J=inertia, **values).c[1:].reshape(3, 3)
        assert_allclose(K_d, sqrtm(inertia), atol=1e-11 * np.sqrt(max(size)))


def test_gains_have_finite_slopes_where_moments_of_inertia_are_equal():
    """A master's Newton method asks for them: of a sphere and of a body with two equal moments."""
    for inertia in (7.0 * np.eye(3), np.diag([5.0, 5.0, 8.0])):
        point = Point(CATALOG["LinearQuadraticRegulator"](), J=inertia)
        seed = np.random.default_rng(1).normal(size=len(point.p))
        assert np.isfinite(numbers(point.functions.calculate_forward(point.p, seed))).all()


def test_the_cost_is_what_the_riccati_equation_says():
    """Integrated along a flight of 1e-4 rad; with the feedback's torque, and P of scipy."""
    E, W, T = 0.1, 0.05, 1.0
    values = {"acceptable_error": E, "acceptable_rate": W, "acceptable_torque": T}
    e0, w0 = 1e-4 * AXIS, 1e-4 * np.array([0.1, -0.2, 0.3])
    t, q, w = closed_loop("LinearQuadraticRegulator", quaternion(Rotation.from_rotvec(e0)), w0, 120.0, 12001, **values)
    e = Rotation.from_quat(q, scalar_first=True).as_rotvec()
    gain, P = design(E, W, T, J)
    tau = -np.hstack([e, w]) @ gain.T
    rate = np.sum(e**2, axis=1) / E**2 + np.sum(w**2, axis=1) / W**2 + np.sum(tau**2, axis=1) / T**2
    x0 = np.concatenate([e0, w0])
    h = t[1]
    cost = h / 3 * (rate[0] + 4 * rate[1:-1:2].sum() + 2 * rate[2:-1:2].sum() + rate[-1])  # Simpson
    assert_allclose(cost, x0 @ P @ x0, rtol=1e-6)  # what is left of third order in 1e-4, and of 120 s


def test_without_a_weight_of_the_rate_the_damping_is_that_of_butterworth():
    """Poles of each principal axis at sqrt(k/j) and 45 deg."""
    inertia = np.diag([30.0, 20.0, 25.0])
    c = Point(CATALOG["LinearQuadraticRegulator"](), J=inertia, acceptable_rate=1e9).c
    K_d = c[1:].reshape(3, 3)
    for i, j in enumerate(np.diag(inertia)):
        poles = np.roots([j, K_d[i, i], c[0]])
        assert_allclose(np.abs(poles), np.sqrt(c[0] / j), rtol=1e-12)
        assert_allclose(-poles.real, np.abs(poles) * np.sqrt(0.5), rtol=1e-9)


@pytest.mark.peers
def test_basilisk_says_the_same_of_the_regulator():
    """mrpFeedback with P = 1: its torque plus w_e - K_d w_e, and of a gain that makes sigma the rotation vector."""
    pytest.importorskip("Basilisk")
    from Basilisk.fswAlgorithms import mrpFeedback

    rng, part = np.random.default_rng(10), CATALOG["LinearQuadraticRegulator"](J=J)
    c = Point(part).c
    for _ in range(20):
        reference, error, w, w_R, w_R_dot = attitude(rng)
        found = command(at(part, reference, error, w, w_R, w_R_dot))
        e, into = error.as_rotvec(), error.inv().apply
        sigma = error.as_mrp()
        module = mrpFeedback.mrpFeedback()
        module.K, module.P = c[0] * np.linalg.norm(e) / np.linalg.norm(sigma), 1.0
        module.Ki, module.controlLawType = -1.0, 1
        rate = w - into(w_R)
        expected = basilisk(module, sigma, rate, into(w_R), into(w_R_dot)) + rate - c[1:].reshape(3, 3) @ rate
        assert_allclose(found, expected, rtol=1e-9, atol=1e-9)
