"""PPATC and ATC: the paper's figures at the start, equilibria, the barrier, the error dynamics, refusals."""

import casadi as ca
import numpy as np
import pytest
from helpers import Monolithic, Point, monolithic
from numpy.testing import assert_allclose
from published import as_in
from scipy.spatial.transform import Rotation
from zhang2018_loop import CONNECTIONS, loop

AdaptiveL2Gain = as_in("xiao2011-l2gain", "controller")
AdaptiveTracking = as_in("zhang2018-atc", "controller")
IntegralSlidingMode = as_in("geng2012-compensated", "controller")
PID = as_in("xiao2011-pid", "controller", euler=0.0)
PrescribedPerformance = as_in("zhang2018-ppatc", "controller")


DEGREE = np.pi / 180
BOTH = pytest.mark.parametrize("law", [PrescribedPerformance, AdaptiveTracking])
MOTION = ("q_BN", "omega_BN_B", "q_RN", "omega_RN_R")
COMMON = {
    "tau_command_B": (*MOTION, "omega_dot_RN_R"),
    "attitude_error": ("q_BN", "q_RN"),
    "e": ("q_BN", "q_RN"),
    "s": MOTION,
    "D_hat": MOTION,
    "gimbal_lock": ("q_BN", "q_RN"),
}


def quaternion(angles, unit=DEGREE):
    return Rotation.from_euler("XYZ", np.multiply(angles, unit)).as_quat(scalar_first=True)


def test_feedthrough():
    assert AdaptiveTracking().direct_feedthrough == COMMON
    further = {"rho": (), "z": ("q_BN", "q_RN"), "epsilon": ("q_BN", "q_RN"), "barrier_hits": ("q_BN", "q_RN")}
    assert PrescribedPerformance().direct_feedthrough == COMMON | further


def test_start_of_prescribed_performance():
    """Figures of zhang2018, degree reading."""
    y = Point(PrescribedPerformance()).outputs()
    assert_allclose(y["tau_command_B"], [-0.656759, 0.546986, 0.199056], atol=1e-5)
    assert_allclose(y["s"], [0.183090, -0.4525, -0.039572], atol=1e-6)
    assert_allclose(y["epsilon"], [0.804719, 0, -0.346574], atol=1e-6)
    assert_allclose(y["e"] / DEGREE, [0.25, 0.15, -0.2], atol=1e-12)
    assert_allclose(y["z"], [0.25 / 0.3, 0.5, -0.2 / 0.3], atol=1e-12)
    assert_allclose(y["rho"] / DEGREE, 0.3)


def test_gains_read_in_radians_are_stronger():
    """zhang2018, 'Units of gains': with the same numbers read per radian the roll torque starts at -38.5 N m."""
    y = Point(PrescribedPerformance(angle_unit=1.0)).outputs()
    assert_allclose(y["tau_command_B"][0], -38.5, atol=0.05)


def test_side_and_time_are_fixed_at_the_start():
    point = Point(PrescribedPerformance())
    assert_allclose(point.states()["side"], [1, 1, -1])
    point.t = 50.0
    point.x = point.initial()
    assert_allclose(point.outputs()["rho"] / DEGREE, 0.3)  # rho counts from the initialization
    point.t = 60.0
    assert_allclose(point.outputs()["rho"] / DEGREE, 0.295 * np.exp(-1.5) + 0.005)
    assert not np.any(point.rates()["side"]) and point.rates()["t0"] == 0


@BOTH
def test_large_angles_against_scipy(law):
    """e and attitude_error far from zero, and across +-180 deg of roll."""
    rng = np.random.default_rng(11)
    for _ in range(5):
        angles = rng.uniform(-1, 1, (2, 3)) * [np.pi, 1.4, np.pi]
        body, reference = (Rotation.from_euler("XYZ", a) for a in angles)
        a, b = (r.as_quat(scalar_first=True) for r in (body, reference))
        y = Point(law(), q_BN=a, q_RN=-b).outputs()
        difference = body.as_euler("XYZ") - reference.as_euler("XYZ")
        assert_allclose(y["e"], (difference + np.pi) % (2 * np.pi) - np.pi, atol=1e-12)
        assert_allclose(y["attitude_error"], (reference.inv() * body).as_rotvec(), atol=1e-12)


def moving_reference():
    q = quaternion([20, -35, 50])
    omega, omega_dot = np.array([0.02, -0.03, 0.01]), np.array([-0.004, 0.003, 0.002])
    return dict(q_BN=q, omega_BN_B=omega, q_RN=q, omega_RN_R=omega, omega_dot_RN_R=omega_dot), omega, omega_dot


@pytest.mark.parametrize("law", [lambda: PrescribedPerformance(overshoot=[1, 1, 1]), AdaptiveTracking])
def test_zero_error_is_an_equilibrium(law):
    """On the reference s = 0, nothing adapts, and the torque is Euler's equation of the reference motion."""
    inputs, omega, omega_dot = moving_reference()
    point = Point(law(), **inputs)
    y, rates = point.outputs(), point.rates()
    J = next(v.start for v in point.component.parameters if v.name == "J")
    assert_allclose(y["tau_command_B"], J @ omega_dot + np.cross(omega, J @ omega), rtol=1e-10)
    assert_allclose([*y["e"], *y["s"], *y["attitude_error"]], 0, atol=1e-12)
    assert_allclose(rates["W"], 0, atol=1e-12)
    assert_allclose(rates["mu_hat"], 0, atol=1e-12)


def roll(z) -> Point:
    """PPATC of the paper's start with a roll error of z of its bound, 0.3 deg, whose side is positive."""
    point = Point(PrescribedPerformance(), q_BN=quaternion([z * 0.3, 0.15, -0.2]))
    point.x[[v.name for v in point.component.states for _ in range(v.size)].index("side")] = 1
    return point


def at_roll(z) -> dict:
    return roll(z).outputs()


@pytest.mark.parametrize("margin", [0.05, 0.95])
def test_barrier_is_continuous_in_value_and_slope(margin):
    h = 1e-5
    before, at, after = (at_roll(margin + d)["epsilon"][0] for d in (-h, 0, h))
    slope = (1 / margin + 1 / (1 - margin)) / 2  # of 1/2 ln(z / (1 - z))
    assert_allclose(at, np.log(margin / (1 - margin)) / 2, atol=1e-12)
    assert_allclose([(at - before) / h, (after - at) / h], slope, rtol=2e-4)


def test_outputs_are_finite_on_the_bounds_and_beyond():
    for z in (-3.0, -1e-9, 0.0, 1.0, 1.0 + 1e-9, 30.0):
        y = at_roll(z)
        assert all(np.isfinite(v).all() for v in y.values())
    assert np.abs(at_roll(30.0)["tau_command_B"]).max() < 1e3


def test_barrier_hits_and_time():
    inside, beyond = roll(0.5), roll(0.97)
    assert (inside.outputs()["barrier_hits"], inside.rates()["barrier_time"]) == (0, 0)
    assert (beyond.outputs()["barrier_hits"], beyond.rates()["barrier_time"]) == (1, 1)
    all_three = Point(PrescribedPerformance(), q_BN=quaternion([0.29, 0.29, -0.29]))
    assert all_three.outputs()["barrier_hits"] == 3
    assert all_three.rates()["barrier_time"] == 1


def test_straight_barrier_leads_back_inside():
    """Turned out of its bounds of 0.005 deg at 60 s, PPATC comes back into them within some 1 / Lambda = 8 s."""
    system = Monolithic(loop(PrescribedPerformance()), CONNECTIONS)
    names = [f"{n}.{v.name}" for n, c in system.components.items() for v in c.states for _ in range(v.size)]
    first = names.index("plant.q_BN")
    x = system.solve(np.array([0.0, 60.0]), None, 1e-8, 1e-12)[-1]
    turn = Rotation.from_euler("XYZ", 0.02 * DEGREE * np.ones(3))
    body = Rotation.from_quat(x[first : first + 4], scalar_first=True)
    x[first : first + 4] = (body * turn).as_quat(scalar_first=True)
    t = np.linspace(60.0, 100.0, 401)
    x = system.solve(t, x, 1e-8, 1e-12)
    y, states = system.outputs(t, x), system.split(x)
    assert y["controller.barrier_hits"][0] == 3 and y["controller.z"][0].max() > 3
    late = t > 90.0
    assert not y["controller.barrier_hits"][late].any()
    assert 0 < states["controller.barrier_time"][-1] == states["controller.barrier_time"][late][0]


def fifth(values, h):
    """First and second derivative in the middle of five rows."""
    a, b, c, d, e = values
    return (a - 8 * b + 8 * d - e) / (12 * h), (-a + 16 * b - 30 * c + 16 * d - e) / (12 * h**2)


def angles_ddot_of_a_rigid_body(q, omega, torque, J, h=1e-3):
    """theta'' at a moment, by differences of scipy's angles along a rigid body's motion."""
    omega_dot = np.linalg.solve(J, torque - np.cross(omega, J @ omega))
    here = Rotation.from_quat(q, scalar_first=True)
    turns = [here * Rotation.from_rotvec((omega + omega_dot * d / 2) * d) for d in h * np.arange(-2, 3)]
    return fifth([r.as_euler("XYZ") for r in turns], h)[1]


@pytest.mark.parametrize("moment", [1.0, 6.0, 20.0, 50.0])
@BOTH
def test_error_dynamics_along_the_closed_loop(law, moment):
    """(11) with (12): s' = r (D - D_hat - (k + K) s), D what the rigid model without disturbance does not explain.

    s' and the angles' second derivative are differences along the integrated loop, the rigid model's are differences of
    scipy's angles: V, R, A, B of the law cannot hide an error, since only the right ones cancel.
    """
    h = 4e-3
    components = loop(law())
    _, states, y = monolithic(components, CONNECTIONS, moment, [0, *(moment + h * np.arange(-2, 3))], rtol=1e-11)
    q, omega = states["plant.q_BN"][1:], y["plant.omega_BN_B"][3]
    s_dot, _ = fifth(y["controller.s"][1:], h)
    _, angles_ddot = fifth(Rotation.from_quat(q, scalar_first=True).as_euler("XYZ"), h)
    J = next(v.start for v in components["controller"].parameters if v.name == "J")
    rigid = angles_ddot_of_a_rigid_body(q[2], omega, y["controller.tau_command_B"][3], J)
    disturbing = (angles_ddot - rigid) / DEGREE
    s, mu = y["controller.s"][3], states["controller.mu_hat"][3]
    feedback = (np.array([0.5, 0.1, 0.5]) + mu**2 / (mu * np.linalg.norm(s) + 0.01)) * s
    r = 1.0
    if law is PrescribedPerformance:
        z, rho, side = y["controller.z"][3], y["controller.rho"][3] / DEGREE, np.array([1, 1, -1])
        r = (1 / (side * z) + 1 / (1 - side * z)) / (2 * rho)  # no overshoot: z between 0 and side
    expected = r * (disturbing - y["controller.D_hat"][3] - feedback)
    assert_allclose(s_dot, expected, rtol=1e-4, atol=1e-4 * np.abs(r * disturbing).max())


@pytest.mark.parametrize("nodes", [0, 1, 5])
@BOTH
def test_any_number_of_nodes(law, nodes):
    point = Point(law(nodes=nodes))
    assert_allclose(point.outputs()["D_hat"], 0)
    assert np.isfinite(point.rates_flat()).all()
    assert point.rates()["W"].shape == (3, nodes)


def test_network_output():
    """One node at the error itself has the value one: D_hat is its weight; far away it is nothing."""
    weights, e, e_dot = np.array([0.1, 0.2, -0.3]), [0.25, 0.15, -0.2], np.array([-0.03, -0.09, 0.03])  # at the start
    at = Point(AdaptiveTracking(nodes=1), W=weights, centres=e, rate_centres=e_dot)
    assert_allclose(at.outputs()["D_hat"], weights, rtol=1e-9)
    beside = Point(AdaptiveTracking(nodes=1), W=weights, centres=e, rate_centres=[0, 0, 0])
    away = np.exp(-np.sum((e_dot / 0.1) ** 2) / 2)
    assert_allclose(beside.outputs()["D_hat"], away * weights, rtol=1e-9)


@BOTH
def test_adaptation(law):
    """With a node at the error itself (h = 1): an axis learns from its s, the bound from |s|, both leak."""
    weights, e, e_dot = np.array([0.1, 0.2, -0.3]), [0.25, 0.15, -0.2], [-0.03, -0.09, 0.03]
    gains = dict(tau_w=0.7, tau_mu=0.4, beta=0.03, gamma=0.05)
    point = Point(law(nodes=1, **gains), W=weights, mu_hat=0.6, centres=e, rate_centres=e_dot)
    s, rates = point.outputs()["s"], point.rates()
    assert_allclose(rates["W"][:, 0], 0.7 * s - 0.7 * 0.03 * weights, rtol=1e-9)
    assert_allclose(rates["mu_hat"], 0.4 * np.sqrt(np.sum(s**2)) - 0.4 * 0.05 * 0.6, rtol=1e-9)


@BOTH
def test_hold_step_limits_the_gain(law):
    """As T_s grows, the feedback of s falls to nothing; at T_s = 0 it is the paper's."""
    paper, weak, off = (Point(law(hold_step=T)).outputs()["tau_command_B"] for T in (0.0, 0.1, 1e9))
    assert np.linalg.norm(off - paper) > np.linalg.norm(weak - paper) > 0


def worst_after_holding(step: float, **values) -> float:
    """Largest |e| (deg) from 45 s to 60 s, where PPATC's gain is largest, with its torque held over a step (fresh)."""
    parts = loop(PrescribedPerformance(**values))
    plant, law = (Point(parts[n]) for n in ("plant", "controller"))
    guidance, environment = (Point(parts[n]).functions.outputs for n in ("guidance", "environment"))
    empty, p = ca.DM(0, 1), {n: Point(parts[n]).p for n in parts}

    def inputs(t, x):
        shown = plant.functions.outputs(t, x[: len(plant.x)], 0 * plant.u, plant.p, plant.c, empty)  # omega_BN_B first
        return ca.vertcat(x[:4], shown[:3], guidance(t, empty, empty, p["guidance"], empty, empty))

    def advance(point, t, x, u):
        zero = ca.DM.zeros(u.shape)
        for k in range(2):
            x = point.functions.advance(t, x, u, zero, zero, zero, point.p, point.c, k * step / 2, step / 2)
        return x

    n, t = len(plant.x), ca.MX.sym("t")
    x = ca.MX.sym("x", n + len(law.x))
    y = law.functions.outputs(t, x[n:], inputs(t, x), law.p, law.c, empty)
    disturbance = environment(t, empty, empty, p["environment"], empty, empty)
    after = advance(plant, t, x[:n], ca.vertcat(y[:3], ca.DM.zeros(3), disturbance))
    x_next = ca.vertcat(after, advance(law, t, x[n:], inputs(t + step, after)))
    e = y[6:9]  # after tau_command_B and attitude_error
    one = ca.Function("one", [x, t], [x_next, e], ["x", "t"], ["x_next", "e"])
    steps = round(60.0 / step)
    every = one.mapaccum("every", steps, ["x"], ["x_next"])
    _, e = every(np.concatenate([plant.x, law.x]), step * np.arange(steps)[None])
    return np.degrees(np.abs(e.full()[:, round(45.0 / step) :]).max())


def test_hold_step_keeps_a_held_torque_stable():
    """zhang2018: with the torque held the paper's law diverges at 4 ms; at 10 ms it does, and hold_step cures it."""
    assert worst_after_holding(0.002) < 0.0035
    assert not worst_after_holding(0.01) < 0.02
    assert worst_after_holding(0.01, hold_step=0.01) < 0.0035


@BOTH
def test_gimbal_lock(law):
    q = quaternion([10, 89.99, 5])
    assert Point(law()).outputs()["gimbal_lock"] == 0
    assert Point(law(), q_BN=q).outputs()["gimbal_lock"] == 1
    assert Point(law(), q_RN=q).outputs()["gimbal_lock"] == 1
    for name in ("q_BN", "q_RN"):
        level = Point(law(), **{name: quaternion([10, 90, 5])}).outputs()
        assert level["gimbal_lock"] == 1 and np.abs(level["tau_command_B"]).max() < 1e9  # finite, of no use
    messages = Point(law(), q_RN=q).violated()
    assert any("pitch of q_RN is 89.99 deg at the start" in m for m in messages), messages


REFUSALS = {
    "outside": (
        {"q_BN": quaternion([0.35, 0.15, -0.2])},
        ["initial roll error is 0.35 deg", "0 to 0.3 deg", "rho_0[1]"],
    ),
    "other side": (
        {"q_BN": quaternion([0.25, 0.15, -0.4])},
        ["initial yaw error is -0.4 deg", "-0.3 to 0 deg", "rho_0[3]"],
    ),
    "nowhere": (
        {"q_BN": [1, 0, 0, 0]},
        ["initial pitch error is 0 deg and overshoot[2] is 0", "epsilon would be infinite", "overshoot[2] > 0"],
    ),
    "rho": ({"rho_inf": [0.01, 0.01, 0.01]}, ["rho_0[1] = 0.3 deg, rho_inf[1] = 0.572958 deg", "rho_0 > rho_inf > 0"]),
    "rho 0": ({"rho_inf": [1e-4, 0, 1e-4]}, ["rho_inf[2] = 0 deg"]),
    "overshoot": ({"overshoot": [0, 1.5, 0]}, ["overshoot[2] = 1.5", "between 0 and 1"]),
    "margin": ({"barrier_margin": 0.6}, ["barrier_margin = 0.6", "below 0.5"]),
    "J": ({"J": [[1, 2, 0], [2, 1, 0], [0, 0, 1]]}, ["J is not positive definite", "smallest eigenvalue -1 kg.m2"]),
    "asymmetric": ({"J": [[9, 2, 0], [0, 9, 0], [0, 0, 9]]}, ["J is not symmetric", "differ by 2 kg.m2"]),
    "angle_unit": ({"angle_unit": 0.0}, ["angle_unit = 0 rad", "must be positive"]),
    "sigma": ({"sigma": -0.01}, ["sigma = -0.01 1/s3", "must be positive"]),
    "width": ({"width": 0.0}, ["width = 0: it must be positive"]),
    "mu_hat": ({"mu_hat": -0.5}, ["mu_hat = -0.5 1/s2", "must not be negative"]),
    "hold_step": ({"hold_step": -1.0}, ["hold_step = -1 s", "must not be negative"]),
    "Lambda": ({"Lambda": [0.1, 0, 0.1]}, ["Lambda[2] = 0 1/s: it must be positive"]),
    "K": ({"K": [0.5, 0.1, -0.5]}, ["K[3] = -0.5 1/s: it must not be negative"]),
    "tau_w": ({"tau_w": -0.5}, ["tau_w = -0.5 1/s2: it must not be negative"]),
    "tau_mu": ({"tau_mu": -0.5}, ["tau_mu = -0.5 1/s2: it must not be negative"]),
    "beta": ({"beta": -0.01}, ["beta = -0.01 s: it must not be negative"]),
    "gamma": ({"gamma": -0.01}, ["gamma = -0.01 s: it must not be negative"]),
}


@pytest.mark.parametrize("case", REFUSALS)
def test_refusals(case):
    values, words = REFUSALS[case]
    messages = Point(PrescribedPerformance(), **values).violated()
    assert any(all(word in message for word in words) for message in messages), messages


def test_zero_error_with_overshoot_is_allowed():
    assert Point(PrescribedPerformance(overshoot=[0.1] * 3), q_BN=[1, 0, 0, 0]).violated() == []


@pytest.mark.parametrize("law", [PrescribedPerformance, AdaptiveTracking, AdaptiveL2Gain, PID, IntegralSlidingMode])
@pytest.mark.parametrize("name", ["q_BN", "q_RN"])
def test_a_quaternion_of_zero_length_is_refused_by_every_law(law, name):
    (first, *_) = Point(law(), **{name: np.zeros(4)}).violated()
    assert first.startswith(f"{name} has norm 0 at the start, a unit quaternion (within 1e-6) is needed.")
