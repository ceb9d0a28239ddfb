"""The law of li2014: its first commands, its Lyapunov function, its options, bad input."""

import casadi as ca
import numpy as np
import pytest
from helpers import Point
from numpy.testing import assert_allclose
from published import as_in
from scipy.spatial.transform import Rotation

DragFreeBackstepping = as_in("li2014-nn", "controller")


LAW = DragFreeBackstepping


def quaternion(angles):
    """Scalar-first, of angles 3-2-1 given as (roll, pitch, yaw)."""
    return Rotation.from_euler("ZYX", angles[::-1]).as_quat(scalar_first=True)


def point(seed=3, **values):
    """Random errors and weights; the error angles are e_2 and e_3."""
    rng = np.random.default_rng(seed)
    drawn = {
        "r_rel": rng.normal(size=3) * 1e-3,
        "v_rel": rng.normal(size=3) * 1e-3,
        "q_SN": quaternion(rng.normal(size=3) * 1e-2),
        "omega_SN_S": rng.normal(size=3) * 1e-2,
        "q_TS": quaternion(rng.normal(size=3) * 1e-2),
        "omega_TS_T": rng.normal(size=3) * 1e-2,
        **{f"W_{i}": rng.normal(size=(3, 25)) * 1e-3 for i in (1, 2, 3)},
    }
    return Point(LAW(), **(drawn | values))


def test_first_commands():
    y = Point(LAW()).outputs()
    assert_allclose(y["f_command_S"][0], 2.09999895, rtol=1e-7)
    assert_allclose(y["tau_command_T"][0], -1.39643619e-5, rtol=1e-6)


def test_feedthrough():
    table = LAW().direct_feedthrough
    assert table["f_command_S"] == ("r_rel", "v_rel")
    assert table["tau_command_S"] == ("q_SN", "omega_SN_S", "q_RN", "omega_RN_R")
    assert set(table["tau_command_T"]) - set(table["tau_command_S"]) == {"q_TS", "omega_TS_T"}


def test_rest_is_an_equilibrium():
    one = [1.0, 0.0, 0.0, 0.0]
    rest = Point(LAW(), r_rel=[0] * 3, q_SN=one, q_TS=one)
    y = rest.outputs()
    assert max(np.abs(y[n]).max() for n in ("f_command_S", "tau_command_S", "tau_command_T")) == 0
    assert np.abs(rest.rates_flat()).max() == 0


@pytest.mark.parametrize("loop", [1, 2, 3])
def test_lyapunov_function_falls(loop):
    """V' = -lambda k1 x1^2 - k2 z^2 where f is what a network of the true weights W* says, in the test's own plant."""
    gains = dict(stiffness=[0.7, 1.2, 0.9], k_1=[0.8, 1.1, 1.3], k_2=[0.6, 0.9, 1.4], Gamma=[2.0, 0.5, 3.0])
    p, true = point(consistent_feedforward=1.0, **gains), np.random.default_rng(8).normal(size=(3, 25)) * 1e-3
    y, x = p.outputs(), p.states()
    lam, k1, k2, Gamma = (gains[n][loop - 1] for n in ("stiffness", "k_1", "k_2", "Gamma"))
    u = {v.name: part for v, part in zip(p.component.inputs, np.split(p.u, [3, 6, 10, 13, 17, 20, 24]), strict=True)}
    x1 = {1: u["r_rel"], 2: y["phi_SR"], 3: y["phi_TS"]}[loop]
    x2 = {1: u["v_rel"], 2: u["omega_SN_S"], 3: u["omega_TS_T"]}[loop]
    z = x2 + k1 * x1
    W, W_dot = x[f"W_{loop}"], p.rates()[f"W_{loop}"]
    h = W_dot * Gamma / z[:, None]
    f = (true * h).sum(axis=1)
    if loop == 1:
        x2_dot = -1e-6 * x1 - 1.4e-11 * x2 - y["f_command_S"] / 1050 + f
    elif loop == 2:
        x2_dot = y["tau_command_S"] / 200 + f
    else:  # the satellite is moved by its command and by what loop 2 has learnt of its disturbance
        learnt = (x["W_2"] * (p.rates()["W_2"] * 0.5 / (u["omega_SN_S"] + 1.1 * y["phi_SR"])[:, None])).sum(axis=1)
        moved = y["tau_command_S"] / 200 + learnt
        x2_dot = (-1e-9 * x1 - 3.3e-14 * x2 + y["tau_command_T"]) / 2.667e-4 - moved + f
    V_dot = lam * x1 * x2 + z * (x2_dot + k1 * x2) - Gamma * ((true - W) * W_dot).sum(axis=1)
    assert_allclose(V_dot, -lam * k1 * x1**2 - k2 * z**2, rtol=1e-9)


def test_network_off_learns_nothing():
    assert np.abs(point(network=0.0).rates_flat()).max() == 0
    assert np.abs(point().rates_flat()).max() > 0


def test_consistent_feedforward_adds_what_loop_2_learnt():
    plain, consistent = (point(consistent_feedforward=c) for c in (0.0, 1.0))
    other = point(W_2=np.zeros((3, 25)))
    learnt = (other.outputs()["tau_command_S"] - plain.outputs()["tau_command_S"]) / 200
    change = consistent.outputs()["tau_command_T"] - plain.outputs()["tau_command_T"]
    assert_allclose(change, 2.667e-4 * learnt, rtol=1e-9, atol=1e-18)


def test_printed_signs_turn_what_the_spring_is_answered_by():
    """Twice spring and damper of the test mass; nothing else."""
    plain, printed = (point(printed_signs=s, K_r=1e-3, D_r=1e-4) for s in (0.0, 1.0))
    a, b = plain.outputs(), printed.outputs()
    omega = plain.u[17:20]
    assert [v.name for v in plain.component.inputs][5] == "omega_TS_T"
    assert_allclose(b["tau_command_T"] - a["tau_command_T"], -2 * (1e-3 * a["phi_TS"] + 1e-4 * omega), rtol=1e-9)
    assert all((a[n] == b[n]).all() for n in a if n != "tau_command_T")


def test_a_turning_reference_is_followed():
    """Attitude and rate of the reference: no torque for a satellite that moves as it does."""
    q, rate = quaternion([0.3, -0.2, 0.5]), [1e-3, -2e-3, 5e-4]
    y = point(q_SN=q, q_RN=-q, omega_SN_S=rate, omega_RN_R=rate, W_2=np.zeros((3, 25))).outputs()
    assert np.abs(y["tau_command_S"]).max() < 1e-12 and np.abs(y["attitude_error"]).max() < 1e-12


def test_a_satellite_that_turns_with_its_reference_feels_its_attitude_error_only():
    """Both at one inertial rate, in the axes of each, whatever the angles between them: no error of the rate."""
    S, R = (Rotation.from_euler("xyz", angles) for angles in ([0.3, -0.5, 0.9], [-0.7, 0.4, 0.2]))
    rate_N = [0.02, -0.03, 0.01]
    at = dict(q_SN=S.as_quat(scalar_first=True), q_RN=R.as_quat(scalar_first=True), W_2=np.zeros((3, 25)))
    turning = dict(omega_SN_S=S.inv().apply(rate_N), omega_RN_R=R.inv().apply(rate_N))
    still = dict(omega_SN_S=[0] * 3, omega_RN_R=[0] * 3)
    together, held = (point(**at, **rates) for rates in (turning, still))
    assert_allclose(together.outputs()["tau_command_S"], held.outputs()["tau_command_S"], rtol=1e-12)
    assert_allclose(together.rates()["W_2"], held.rates()["W_2"], rtol=1e-9, atol=1e-15)


def test_a_known_drag_is_cancelled():
    """At rest, nothing learnt: the command is the force fed forward, which with an opposite drag makes none."""
    rest = dict(r_rel=[0] * 3, v_rel=[0] * 3, W_1=np.zeros((3, 25)))
    drag = np.array([-7e-3, 1e-3, -2e-3])
    assert_allclose(point(**rest, f_feedforward_S=-drag).outputs()["f_command_S"] + drag, 0, atol=1e-18)


@pytest.mark.parametrize("pitched", ["q_SN", "q_TS", "q_RN"])
def test_a_pitch_of_90_degrees_is_reported_and_finite(pitched):
    at = {"q_SN": [1.0, 0, 0, 0], "q_TS": [1.0, 0, 0, 0], "q_RN": [1.0, 0, 0, 0]}
    y = Point(LAW(), **at | {pitched: quaternion([0, np.pi / 2, 0])}).outputs()
    assert y["gimbal_lock"] == 1 and all(np.isfinite(v).all() for v in y.values())
    assert Point(LAW(), **at | {pitched: quaternion([0, np.radians(89.9), 0])}).outputs()["gimbal_lock"] == 0


@pytest.mark.parametrize(
    ("values", "message"),
    [
        (dict(J=np.zeros((3, 3))), "J is not positive definite"),
        (dict(I_tm=-1.0), "I_tm = -1 kg.m2: it must be positive."),
        (dict(m_sc=0.0), "m_sc = 0 kg: it must be positive."),
        (dict(Gamma=[1.0, 0.0, 1.0]), "Gamma[2] = 0 s2: it must be positive."),
        (dict(width=0.0), "width = 0: it must be positive."),
        (dict(scale_rate=[1.0, 0.0]), "scale_rate[2] = 0 rad/s: it must be positive."),
        (dict(D=-1.0), "D = -1 N.s/m: it must not be negative."),
        (dict(D_r=-1.0), "D_r = -1 N.m.s/rad: it must not be negative."),
        (dict(network=-1.0), "network = -1: it must be 0 or 1."),
        (dict(consistent_feedforward=0.5), "consistent_feedforward = 0.5: it must be 0 or 1."),
        (dict(printed_signs=2.0), "printed_signs = 2: it must be 0 or 1."),
        (dict(k_1=[1, 1, -1.0]), "k_1[3] + k_2[3] = 0 1/s: it must be positive, or the loop is unstable."),
        (dict(k_1=[1, -1.5, 1], k_2=[1, 2, 1]), "stiffness[2] + k_1[2] k_2[2] = -2 1/s2: it must be positive, or"),
        (dict(k_1=[-0.1, 1, 1]), "k_1[1] = -0.1 1/s: it must not be negative where the network learns (network = 1)."),
        (dict(k_2=[1, -0.1, 1]), "k_2[2] = -0.1 1/s: it must not be negative where the network learns (network = 1)."),
        (dict(q_TS=quaternion([0, np.pi / 2, 0])), "pitch of q_TS is 90 deg at the start"),
        (dict(q_SN=quaternion([0, np.pi / 2, 0])), "pitch of q_SN is 90 deg at the start"),
    ],
)
def test_bad_input(values, message):
    assert any(text.startswith(message) for text in Point(LAW(), **values).violated())


def loop_1():
    """Function of the parameters: the matrix of r', v', W' near zero error, the plant in the test's own words."""
    part = LAW()
    f, point = part.functions, Point(part, r_rel=[0] * 3)
    x, u, p = (ca.MX.sym(n, len(v)) for n, v in (("x", point.x), ("u", point.u), ("p", point.p)))
    command = f.outputs(0, x, u, p, point.c, [])[0]
    v_dot = -command / 1050 - 1e-6 * u[0] - 1.4e-11 * u[3]
    rates = ca.vertcat(u[3], v_dot, f.rates(0, x, u, p, point.c)[:25])
    A = ca.horzcat(ca.jacobian(rates, u)[:, [0, 3]], ca.jacobian(rates, x)[:, :25])
    rest = ca.Function("A", [x, u, p], [A])
    return lambda values: rest(point.x, point.u, Point(part, **values).p).full()


@pytest.mark.parametrize("network", [0.0, 1.0])
def test_gains_that_pass_make_a_stable_loop(network):
    """No pole of the law's own linearisation is in the right half plane; where it does not learn, one is if refused."""
    rng, matrix, refused = np.random.default_rng(6), loop_1(), 0
    for _ in range(100):
        stiffness, k_1, k_2 = rng.uniform(-1, 2, 3)
        gains = dict(stiffness=[stiffness, 1, 1], k_1=[k_1, 1, 1], k_2=[k_2, 1, 1], network=network)
        bad = bool(Point(LAW(), **gains).violated())
        unstable = np.linalg.eigvals(matrix(gains)).real.max() > 1e-6  # weights that answer nothing have poles at 0
        assert not unstable if not bad else unstable or network, gains
        refused += bad
    assert 20 < refused < 80
