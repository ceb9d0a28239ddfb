"""The law of ye2016: gains, torque, signs, perfect knowledge, an outside reference, refusals."""

import numpy as np
import pytest
from helpers import Point, monolithic, split
from numpy.testing import assert_allclose
from published import as_in
from scipy.linalg import solve_continuous_lyapunov
from scipy.spatial.transform import Rotation
from ye2016_loop import CONNECTIONS, KNOWN, OFF, SLOW, loop, outside

from components.numbers import ye2016 as numbers
from cosim.studies.papers.ye2016 import gains, system

CmgCluster = as_in(
    "ye2016-adaptive", "actuators", wheel_speed=0.0, rotor_deviation=0.0, transverse_deviation=0.0, spin_deviation=0.0
)
HybridAdaptive = as_in("ye2016-adaptive", "controller")

SENSED = {"q_BN", "omega_BN_B", "q_RN", "omega_RN_R", "omega_dot_RN_R"}
POLES = (0.2, 0.3)


def moving(seed=4, **values):
    """The law at a large attitude, tracking something that turns."""
    rng = np.random.default_rng(seed)
    body, off = Rotation.random(random_state=seed), Rotation.from_rotvec(0.02 * rng.normal(size=3))
    inputs = {
        "q_BN": (body * off).as_quat(scalar_first=True),
        "q_RN": body.as_quat(scalar_first=True),
        "omega_BN_B": 0.02 * rng.normal(size=3),
        "omega_RN_R": 0.02 * rng.normal(size=3),
        "omega_dot_RN_R": 1e-3 * rng.normal(size=3),
        "gimbal_angle": rng.normal(size=values.get("gimbals", 4)),
    }
    structure = {n: values.pop(n) for n in ("gimbals", "wheels") if n in values}
    parameters = {n: values.pop(n) for n in list(values) if n not in inputs}
    return Point(HybridAdaptive(**structure, **parameters), **(inputs | values))


def test_feedthrough():
    """Nothing depends on the wheels' speed after the start."""
    table = HybridAdaptive().direct_feedthrough
    assert set(table["gimbal_rate_command"]) == set(table["wheel_acceleration_command"]) == SENSED | {"gimbal_angle"}
    assert set(table["tau_wanted_B"]) == SENSED
    assert table["H_hat_N"] == ()


def test_gains_have_the_printed_eigenvalues():
    k_1, k_2 = numbers.K_1, numbers.K_2
    found = np.concatenate([np.roots([1, b, a]) for a, b in zip(k_1, k_2, strict=True)])
    printed = [complex(-r, s * r) for r in POLES for s in (1, -1)] + [-r * np.sqrt(2) for r in POLES]
    assert_allclose(np.sort_complex(found), np.sort_complex(printed), atol=1e-12)


def blocks(first, mixed, last):
    return np.block([[first, mixed], [mixed.T, last]])


def weight(rng):
    """A positive definite Q, 6 x 6, and its blocks by the names of the law."""
    Q = np.eye(6) + 0.5 * (M := rng.normal(size=(6, 6))) @ M.T
    return Q, {"q_1": Q[:3, :3], "q_12": Q[:3, 3:], "q_2": Q[3:, 3:]}


@pytest.mark.parametrize("K", [gains.diagonal(), gains.placed(), gains.placed(0.1)], ids=["diagonal", "placed", "slow"])
@pytest.mark.parametrize("general", [False, True])
def test_P_solves_the_lyapunov_equation(K, general):
    Q, given = weight(np.random.default_rng(3)) if general else (np.eye(6), {})
    c = Point(HybridAdaptive(k_1=K[:, :3], k_2=K[:, 3:], **given)).c.reshape(3, 3, 3)
    A_1 = np.block([[np.zeros((3, 3)), np.eye(3)], [-K]])
    P = solve_continuous_lyapunov(A_1.T, -Q)
    assert_allclose(blocks(*c), P, atol=1e-9 * np.abs(P).max())


def test_P_of_the_paper():
    paper = Point(HybridAdaptive()).c.reshape(3, 3, 3)  # of parameters.json
    assert_allclose(paper[0], np.diag([3.85, 2.65, 3.7382378498728825]), rtol=1e-12)
    assert_allclose(paper[1], np.diag([6.25, 2.7777777777777786, 4.166666666666668]), rtol=1e-12)
    assert_allclose(paper[2], np.diag([16.875, 5.462962962962964, 6.599663291074446]), rtol=1e-12)


@pytest.mark.parametrize("seed", range(6))
def test_gains_are_refused_just_where_an_eigenvalue_is_not_left_of_the_axis(seed):
    """Random K, most diagonal elements not positive where it is Hurwitz all the same: the eigenvalues decide."""
    rng, refused = np.random.default_rng(seed), "A_1 = A_0 - B_0 K is not Hurwitz"
    for _ in range(8):
        K = np.hstack([rng.normal(size=(3, 3)) + 0.6 * np.eye(3), rng.normal(size=(3, 3)) + 2.0 * np.eye(3)])
        A_1 = np.block([[np.zeros((3, 3)), np.eye(3)], [-K]])
        _, given = weight(rng)
        messages = Point(HybridAdaptive(k_1=K[:, :3], k_2=K[:, 3:], **given)).violated()
        assert any(refused in text for text in messages) == (np.linalg.eigvals(A_1).real.max() >= 0)


def test_momentum_at_the_start():
    assert_allclose(Point(HybridAdaptive(), wheel_speed=system.WHEEL_SPEED).states()["H_0"], [2.0, -1.6, 1.2])
    q, w = Rotation.from_rotvec([0.3, -0.5, 0.9]), np.array([0.01, 0.02, -0.03])
    point = Point(HybridAdaptive(), wheel_speed=system.WHEEL_SPEED, q_BN=q.as_quat(scalar_first=True), omega_BN_B=w)
    assert_allclose(point.states()["H_0"], q.apply(np.array([2.0, -1.6, 1.2]) + np.array(system.J) @ w), rtol=1e-12)


def delivered(point, y, **structure):
    """The torque of a cluster with nominal axes that gets the law's commands."""
    rates = {n: y[n] for n in ("gimbal_rate_command", "wheel_acceleration_command")}
    gamma = split(point.component.inputs, point.u)["gimbal_angle"]
    cluster = Point(CmgCluster(**structure), **rates, gimbal_angle=gamma)
    return cluster.functions.mean_rates(0, cluster.x, cluster.u, cluster.p, cluster.c).full().ravel()


@pytest.mark.parametrize("weight", [1.0, 1e4])
def test_a_cluster_as_it_is_known_gives_the_torque_that_is_wanted(weight):
    """X u = v exactly, whatever the weights: only the share of the wheels changes."""
    y = (point := moving(wheel_weight=weight)).outputs()
    assert_allclose(delivered(point, y), y["tau_wanted_B"], rtol=1e-10)
    other = moving(wheel_weight=1e4 / weight).outputs()
    share = np.abs(y["wheel_acceleration_command"]).max(), np.abs(other["wheel_acceleration_command"]).max()
    assert (share[0] > share[1]) == (weight > 1.0)


@pytest.mark.parametrize("structure", [{"gimbals": 0}, {"wheels": 0}, {"gimbals": 6, "wheels": 1}], ids=str)
def test_gyros_alone_and_wheels_alone(structure):
    point = moving(**structure)
    y = point.outputs()
    assert_allclose(delivered(point, y, **structure), y["tau_wanted_B"], rtol=1e-9)
    assert np.isfinite(point.rates_flat()).all() and point.violated() == []


def test_the_sign_of_the_bodys_quaternion_does_not_matter():
    q = moving().u[:4]
    for name, rows in moving(q_BN=-q).outputs().items():
        assert_allclose(rows, moving().outputs()[name], rtol=1e-12, atol=1e-14, err_msg=name)


def test_shadow_reflects_the_error_and_keeps_its_size():
    far = Rotation.from_rotvec([0.0, 0.0, np.radians(200)])
    near = far * Rotation.from_rotvec([1e-4, 2e-4, -1e-4])
    inputs = dict(q_BN=near.as_quat(scalar_first=True), q_RN=far.as_quat(scalar_first=True))
    inputs = {n: q * np.sign(q[3]) for n, q in inputs.items()}  # the long way round: 200 deg, scalar part negative
    assert inputs["q_RN"][0] < 0
    literal, switched = (Point(HybridAdaptive(shadow=s), **inputs).outputs()["e"] for s in (0.0, 1.0))
    sigma_d, shadow_d = np.tan(np.radians(50)), np.tan(np.radians(40))
    assert_allclose(np.linalg.norm(literal) / np.linalg.norm(switched), (1 + sigma_d**2) / (1 + shadow_d**2), rtol=1e-3)


def test_a_full_turn_is_reported():
    assert Point(HybridAdaptive(), q_RN=[-1 + 1e-6, 0, 0, np.sqrt(2e-6)]).outputs()["full_turn"] == 1
    assert Point(HybridAdaptive()).outputs()["full_turn"] == 0


def test_no_error_nothing_learnt():
    """On the reference with zero error the estimates stay."""
    q = [1.0, 0, 0, 0]
    rates = Point(HybridAdaptive(), q_BN=q, q_RN=q, omega_BN_B=[0.01, 0, 0], omega_RN_R=[0.01, 0, 0]).rates()
    assert all(np.abs(rows).max() < 1e-12 for rows in rates.values())


@pytest.mark.parametrize(("name", "shape"), [("Theta_c", (4, 6)), ("Theta_w", (3, 3))])
def test_estimates_stay_within_the_ball(name, shape):
    """At the edge, |Theta|^2 = b + d, none that the law pushes outward grows; inside, it is the unprojected law."""
    edge = np.zeros(shape)
    edge[:, 0] = np.sqrt(0.15)
    pushed = 0
    for seed in range(4):
        rates, free = (moving(seed, **{name: edge}, wheel_inertia=5.0, b=b).rates()[name] for b in (0.05, 1e9))
        assert (rates[:, 0] <= 1e-12 * np.abs(free).max()).all()
        pushed += (free[:, 0] > 1e-3 * np.abs(free).max()).sum()
        assert_allclose(rates[:, 1:], free[:, 1:])  # along the edge
    assert pushed > 2
    inside, free = (moving(1, **{name: 0.1 * edge}, b=b).rates()[name] for b in (0.05, 1e9))
    assert_allclose(inside, free)


def second(path, h=1e-2):
    """First and second derivative of the MRP along a path of attitudes, by differences of fourth order."""
    q = np.array([path(k * h).as_quat(canonical=True, scalar_first=True) for k in range(-2, 3)])
    a, b, c, d, e = q[:, 1:] / (1 + q[:, :1])
    return (a - 8 * b + 8 * d - e) / (12 * h), (-a + 16 * b - 30 * c + 16 * d - e) / (12 * h**2)


@pytest.mark.parametrize("seed", range(4))
def test_identity_of_the_proof(seed):
    """V' = -1/2 e^T Q e for any gain, weight, true axes and momentum, which the estimates are away from.

    The motion is that of a cluster with those deviations on a body with that momentum; the second derivatives of both
    MRP are differences of scipy's attitudes. Wheels of 5 kg m^2, so that their part of V' is no trifle.
    """
    rng = np.random.default_rng(seed)
    inertia, (Q, weights), K = 5.0, weight(rng), gains.placed() if seed % 2 else gains.diagonal()
    weights |= {"k_1": K[:, :3], "k_2": K[:, 3:]}
    true_c, true_w, true_F = rng.uniform(-0.05, 0.05, (4, 6)), rng.uniform(-0.05, 0.05, (3, 3)), rng.normal(size=3)
    estimates = {"Theta_c": rng.uniform(-0.05, 0.05, (4, 6)), "Theta_w": rng.uniform(-0.05, 0.05, (3, 3))}
    estimates["Theta_F"] = rng.normal(size=3)
    alpha = {"alpha_F": 0.1, "alpha_G": 1e-3}  # so that every part of V' is of a size
    body = Rotation.from_rotvec(rng.uniform(-1, 1, 3))
    reference = body * Rotation.from_rotvec(0.2 * rng.normal(size=3))
    w, w_d, w_d_dot = 0.1 * rng.normal(size=(3, 3))
    motion = {"omega_BN_B": w, "omega_RN_R": w_d, "omega_dot_RN_R": w_d_dot, "gimbal_angle": rng.normal(size=4)}
    motion |= {n: r.as_quat(canonical=True, scalar_first=True) for n, r in (("q_BN", body), ("q_RN", reference))}
    motion |= {"wheel_speed": rng.normal(size=3)}
    point = Point(HybridAdaptive(**alpha, **weights, wheel_inertia=inertia), **motion, **estimates)
    y, rates = point.outputs(), point.rates()

    deviation = {
        "rotor_deviation": true_c[:, 3:].T,
        "transverse_deviation": true_c[:, :3].T,
        "spin_deviation": true_w.T,
    }
    torque = delivered(point, y, wheel_inertia=inertia, **deviation)
    momentum = body.inv().apply(point.states()["H_0"] + true_F)
    w_dot = np.linalg.solve(system.J, torque - np.cross(w, momentum))
    _, sigma_ddot = second(lambda t: body * Rotation.from_rotvec(w * t + w_dot * t**2 / 2))
    _, sigma_d_ddot = second(lambda t: reference * Rotation.from_rotvec(w_d * t + w_d_dot * t**2 / 2))

    e, e_dot, e_ddot = y["e"], y["e_dot"], sigma_ddot - sigma_d_ddot
    whole, whole_dot = np.concatenate([e, e_dot]), np.concatenate([e_dot, e_ddot])
    parts = np.array(
        [
            whole @ blocks(*point.c.reshape(3, 3, 3)) @ whole_dot,
            (estimates["Theta_F"] - true_F) @ rates["Theta_F"] / alpha["alpha_F"],
            np.sum((estimates["Theta_c"] - true_c) * rates["Theta_c"]) / alpha["alpha_G"],
            np.sum((estimates["Theta_w"] - true_w) * rates["Theta_w"]) / alpha["alpha_G"],
        ]
    )
    assert np.abs(parts).min() > 5e-4 * np.abs(parts).max()
    assert_allclose(parts.sum(), -whole @ Q @ whole / 2, atol=1e-7 * np.abs(parts).max())


def test_error_is_linear_with_perfect_knowledge():
    """e'' = -k_2 e' - k_1 e of each component: three second-order systems, whatever the motion."""
    q = Rotation.from_rotvec([0.02, -0.03, 0.01]).as_quat(scalar_first=True)
    parts = loop(**KNOWN)
    parts["plant"] = type(parts["plant"])(modes=0, J=system.J, q_BN=q, omega_BN_B=0.0)
    # the true total momentum is what the controller is to know, so at rest it turns with the body
    start = Rotation.from_quat(q, scalar_first=True).apply(system.unknown_momentum())
    parts["controller"] = HybridAdaptive(**(KNOWN | {"Theta_F": start}))
    t, _, y = monolithic(parts, CONNECTIONS, 60.0, np.linspace(0, 60, 61))
    e, e_dot = y["controller.e"], y["controller.e_dot"]
    for i in range(3):
        A = np.array([[0, 1], [-numbers.K_1[i], -numbers.K_2[i]]])
        values, vectors = np.linalg.eig(A)
        modes = np.linalg.solve(vectors, [e[0, i], e_dot[0, i]])
        expected = np.real((vectors * modes) @ np.exp(np.outer(values, t)))[0]
        assert_allclose(e[:, i], expected, atol=1e-9)


@pytest.mark.parametrize(("alpha_F", "alpha_G"), [(0.0, 0.0), (1e5, 1e3)], ids=["nonadaptive", "adaptive"])
def test_the_loop_against_the_papers_equations_in_numpy(alpha_F, alpha_G):
    rows = np.linspace(0.0, 150.0, 31)
    sigma, omega, gamma, Theta_F = outside(rows, alpha_F, alpha_G)
    _, x, y = monolithic(loop(alpha_F=alpha_F, alpha_G=alpha_G), CONNECTIONS, 150.0, rows)
    q = x["plant.q_BN"]
    assert_allclose(q[:, 1:] / (1 + q[:, :1]), sigma, atol=1e-8)
    assert_allclose(y["plant.omega_BN_B"], omega, atol=1e-9)
    assert_allclose(x["actuators.gimbal_angle"], gamma, atol=1e-7)
    assert_allclose(x["controller.Theta_F"], Theta_F, atol=1e-6)


@pytest.mark.parametrize("name", ["perfect", "nonadaptive", "printed", "slow"])
def test_figures_of_the_loop_as_one_ode(name):
    """Rows of equations/ye2016.md that are of a monolithic integration; momentum of one plant unit."""
    values = {"perfect": KNOWN, "nonadaptive": OFF, "printed": {"alpha_F": 1e7}, "slow": {"alpha_F": 1e2} | SLOW}[name]
    t, x, y = monolithic(loop(**values), CONNECTIONS, 800.0, np.linspace(0, 800, 4001), rtol=1e-11)
    relative = Rotation.from_quat(x["guidance.q_RN"], scalar_first=True).inv() * Rotation.from_quat(
        x["plant.q_BN"], scalar_first=True
    )
    error = np.abs(relative.as_euler("ZYX")).max(axis=1)
    H = y["plant.H_N"]
    assert np.abs(H - H[0]).max() < 1e-9
    if name == "perfect":
        assert error.max() < 1e-9
    elif name == "nonadaptive":
        assert_allclose(error.max(), 2.6916e-3, rtol=0.02)
    elif name == "printed":
        assert_allclose([error.max(), error[t >= 400].max()], [4.211e-4, 1.855e-4], rtol=0.03)
    else:
        assert 0.145 < (x["controller.Theta_c"] ** 2).sum(axis=2).max() <= 0.1501


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"k_1": np.diag([0.08, -0.18, 0.12])}, "K = [k_1, k_2]: A_1 = A_0 - B_0 K is not Hurwitz"),
        ({"k_2": np.diag([0.4, 0.6, 0.0])}, "K = [k_1, k_2]: A_1 = A_0 - B_0 K is not Hurwitz"),
        (
            {"k_1": 0.0, "k_2": 0.0},
            "A_0 - B_0 K is not Hurwitz, for P of (23) is not positive definite (det k_1 0 1/s6",
        ),
        ({"k_1": -gains.placed()[:, :3], "k_2": gains.placed()[:, 3:]}, "A_1 = A_0 - B_0 K is not Hurwitz"),
        (
            {"q_1": np.diag([1.0, -1.0, 1.0])},
            "Q = [q_1, q_12; q_12^T, q_2] is not positive definite (smallest pivot -1)",
        ),
        ({"q_12": 2.0 * np.eye(3)}, "Q = [q_1, q_12; q_12^T, q_2] is not positive definite (smallest pivot -3)"),
        ({"q_2": np.zeros((3, 3))}, "Q = [q_1, q_12; q_12^T, q_2] is not positive definite (smallest pivot 0)"),
        ({"q_1": np.eye(3) + np.eye(3, k=1)}, "q_1 is not symmetric: elements that mirror each other differ by 1 1/s2"),
        ({"q_BN": [0, 0, 0, 0]}, "q_BN has norm 0 at the start, a unit quaternion (within 1e-6) is needed"),
        ({"q_RN": [2, 0, 0, 0]}, "q_RN has norm 2 at the start, a unit quaternion"),
        ({"rotor_axes_B": 2.0 * system.ROTOR_AXES}, "axis 1 of rotor_axes_B has length 2, a unit vector"),
        ({"gimbal_axes_B": 0.5 * system.GIMBAL_AXES}, "axis 1 of gimbal_axes_B has length 0.5, a unit vector"),
        ({"J": -np.eye(3)}, "J is not positive definite"),
        ({"d": 0.0}, "d = 0: it must be positive"),
        ({"wheel_weight": (1.0, -1.0, 1.0)}, "wheel_weight[2] = -1 1/s2: it must be positive"),
        ({"alpha_F": -1.0}, "alpha_F = -1 kg2.m4/s: it must not be negative"),
    ],
)
def test_refusals(values, message):
    assert any(message in text for text in Point(HybridAdaptive(**values)).violated())
