"""The design model of li2014: an outside integration, its limit, what is coupled with what, bad input."""

import numpy as np
import pytest
from helpers import Point, numbers, split
from numpy.testing import assert_allclose
from published import as_in
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

DesignModel = as_in("li2014-design-model-nn", "plant")
DragFreeSatellite = as_in("li2014-nn", "plant")

ZERO = [0.0, 0.0, 0.0]
STATES = ("r_rel", "v_rel", "phi_SN", "omega_SN_S", "phi_TS", "omega_TS_T")
COMMANDS = dict(f_command_S=[0.03, -0.02, 0.01], tau_command_S=[5e-3, -2e-3, 1e-3], tau_command_T=[1e-8, 2e-8, -1e-8])
DISTURBANCES = dict(f_dist_S=[-0.01, 0.01, -0.005], tau_dist_S=[-3e-3, 1e-3, 2e-3])


def test_feedthrough():
    assert DesignModel().direct_feedthrough == {"q_SN": (), "q_TS": ()}


@pytest.mark.parametrize("printed", [0.0, 1.0])
def test_against_an_outside_integration(printed):
    """(7) to (9) with f of both kinds, per axis, in the test's own words."""
    rng = np.random.default_rng(7)
    W = [1e-4 * rng.normal(size=(3, 25)) for _ in range(3)]
    vehicle = dict(J=np.diag([180.0, 220.0, 200.0]), K=0.1, D=0.02, K_r=1e-5, D_r=2e-6, printed_signs=printed)
    part = DesignModel(**vehicle, **{f"W_{i + 1}": weights for i, weights in enumerate(W)})
    point = Point(part, **COMMANDS, **DISTURBANCES)
    found = split(part.states, point.advance(0.01, 1000)[:, -1])
    centres = [(a, b) for a in (-1, -0.5, 0, 0.5, 1) for b in (-1, -0.5, 0, 0.5, 1)]
    sizes = ((1e-3, 1e-3), (2e-2, 2e-2), (2e-2, 2e-2))
    force, torque, held = (np.array(v) for v in COMMANDS.values())
    drag, push = (np.array(v) for v in DISTURBANCES.values())
    sign = 1 if printed else -1

    def unknown(i, axis, x1, x2):
        a, b = x1 / sizes[i][0], x2 / sizes[i][1]
        near = [np.exp(-2 * ((a - p) ** 2 + (b - q) ** 2)) for p, q in centres]
        return np.dot(W[i][axis], near)

    def rates(t, s):
        out = []
        for axis, inertia in enumerate((180.0, 220.0, 200.0)):
            r, v, phi, w, th, w_rel = s[6 * axis : 6 * axis + 6]
            f = [unknown(i, axis, *pair) for i, pair in enumerate(((r, v), (phi, w), (th, w_rel)))]
            slide = -0.1 * r - 0.02 * v - (force + drag)[axis] / 1050 + f[0]
            turn = (torque + push)[axis] / inertia + f[1]
            twist = sign * (1e-5 * th + 2e-6 * w_rel) + held[axis]
            out += [v, slide, w, turn, w_rel, twist / 2.667e-4 - (torque + push)[axis] / inertia + f[2]]
        return out

    start = np.column_stack([point.states()[name] for name in STATES]).ravel()
    end = solve_ivp(rates, (0, 10.0), start, "DOP853", rtol=1e-11, atol=1e-15).y[:, -1].reshape(3, 6)
    for i, name in enumerate(STATES):
        assert_allclose(found[name], end[:, i], rtol=1e-7, atol=1e-7 * np.abs(end[:, i]).max(), err_msg=name)


def test_the_printed_signs_make_the_test_mass_unstable():
    """It grows by e in 516 s, as equations/li2014.md says; with those of (5) it swings, in the same time a radian."""
    for printed, slope in ((0.0, np.cos), (1.0, np.cosh)):
        free = dict(printed_signs=printed, D_r=0.0, W_3=np.zeros((3, 25)), phi_TS=[1e-2, 0, 0])
        part = DesignModel(**free)
        x = split(part.states, Point(part).advance(1.0, 1032).T)["phi_TS"][:, 0]
        time = np.arange(1, 1033)
        assert_allclose(x, 1e-2 * slope(time / np.sqrt(2.667e-4 / 1e-9)), rtol=1e-9, atol=1e-11)
    assert np.sqrt(2.667e-4 / 1e-9) == pytest.approx(516, abs=0.5)


def test_it_is_the_limit_of_the_full_plant():
    """Without gravity and lever arm, a light test mass: what differs falls with the square of angles and rates."""
    rng, vehicle = np.random.default_rng(4), dict(J=1e9 * np.eye(3), m_sc=1e12, K=0.1, D=0.02, K_r=1e-5, D_r=2e-6)
    start = {name: rng.uniform(-1, 1, 3) for name in STATES}
    push = {"f_command_S": 1e12, "tau_command_S": 1e9, "tau_command_T": 2.667e-4}
    push = {name: size * rng.uniform(-1, 1, 3) for name, size in push.items()}
    free = dict(mu=0.0, r_N=ZERO, v_N=ZERO, r_h=ZERO, cage_gap=10.0)
    differ = []
    for size in (1e-2, 1e-3):
        x = {name: size * value for name, value in start.items()}
        u = {name: size * value for name, value in push.items()}
        model = DesignModel(**vehicle, **{f"W_{i}": np.zeros((3, 25)) for i in (1, 2, 3)})
        simple = split(model.states, Point(model, **x, **u).advance(0.01, 300)[:, -1])
        turned = {f"q_{n}": Rotation.from_euler("ZYX", x.pop(f"phi_{n}")[::-1]) for n in ("SN", "TS")}
        full = DragFreeSatellite(**vehicle, **free)
        attitudes = {name: q.as_quat(scalar_first=True) for name, q in turned.items()}
        whole = split(full.states, Point(full, **x, **u, **attitudes).advance(0.01, 300)[:, -1])
        rows = [whole[n] - simple[n] for n in ("r_rel", "v_rel", "omega_SN_S", "omega_TS_T")]
        for n in ("SN", "TS"):
            angles = Rotation.from_quat(whole[f"q_{n}"], scalar_first=True).as_euler("ZYX")[::-1]
            rows.append(angles - simple[f"phi_{n}"])
        differ.append([np.abs(row).max() for row in rows])
    assert differ[0][2] < 1e-12  # the rate of a satellite of a sphere's inertia feels no product of two of them
    assert_allclose(np.divide(*differ)[[0, 1, 3, 4, 5]], 100, rtol=0.2)


def test_no_axis_and_no_loop_acts_on_another():
    """But the torque on the satellite on its test mass, whose angles are to the satellite."""
    A, B = DesignModel().linearise(np.full(18, 1e-3))
    x, u = np.arange(18) % 3, np.arange(15) % 3
    assert not A[x[:, None] != x].any() and not B[x[:, None] != u].any()
    loop, of = np.arange(18) // 6, np.array([0, 1, 2, 0, 1]).repeat(3)
    assert not A[loop[:, None] != loop].any()
    crossed = B * (loop[:, None] != of)
    assert_allclose(crossed[15:18, [3, 4, 5, 12, 13, 14]], np.tile(-np.eye(3) / 200, 2))
    crossed[15:18, [3, 4, 5, 12, 13, 14]] = 0
    assert not crossed.any()


def test_quaternions_are_those_of_the_angles():
    angles = np.array([0.3, -0.5, 0.9])
    y = Point(DesignModel(), phi_SN=angles, phi_TS=-angles).outputs()
    for q, phi in ((y["q_SN"], angles), (y["q_TS"], -angles)):
        assert_allclose(q, Rotation.from_euler("ZYX", phi[::-1]).as_quat(scalar_first=True), atol=1e-15)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        (dict(J=[[200, 1, 0], [1, 200, 0], [0, 0, 200]]), "J has an element of 1 kg.m2 beside its diagonal: "),
        (dict(J=-np.eye(3)), "J is not positive definite (smallest eigenvalue -1 kg.m2)"),
        (dict(m_sc=0.0), "m_sc = 0 kg: it must be positive."),
        (dict(m_tm=-1.0), "m_tm = -1 kg: it must be positive."),
        (dict(I_tm=0.0), "I_tm = 0 kg.m2: it must be positive."),
        (dict(D=-1e-11), "D = -1e-11 N.s/m: it must not be negative."),
        (dict(D_r=-1e-14), "D_r = -1e-14 N.m.s/rad: it must not be negative."),
        (dict(width=0.0), "width = 0: it must be positive."),
        (dict(scale_angle=[1.0, 0.0]), "scale_angle[2] = 0 rad: it must be positive."),
        (dict(printed_signs=0.5), "printed_signs = 0.5: it must be 0 or 1."),
        (dict(phi_SN=[0, np.pi / 2, 0]), "phi_SN[2] = 90 deg at the start: a pitch of angles 3-2-1 is"),
        (dict(phi_TS=[0, -2.0, 0]), "phi_TS[2] = -114.592 deg at the start: a pitch of angles 3-2-1 is within"),
    ],
)
def test_bad_input(values, message):
    assert any(text.startswith(message) for text in Point(DesignModel(), **values).violated())


def test_a_spring_may_push_away():
    assert Point(DesignModel(), K=-1e-6, K_r=-1e-9).violated() == []


def test_unknown_at_zero_error_is_that_of_remark_2_1():
    """f_1 = -F_D/m_sc, f_2 = T_D/I_sc, f_3 = -f_2: a drag of 7 mN against the velocity, with its lever arm."""
    part = DesignModel(r_rel=ZERO, phi_SN=ZERO, phi_TS=ZERO)
    at = split(part.states, numbers(part.functions.rates(0, Point(part).x, Point(part).u, Point(part).p, [])))
    force = -1050 * at["v_rel"]
    assert np.linalg.norm(force) == pytest.approx(7e-3)
    v = next(state.start for state in DragFreeSatellite().states if state.name == "v_N")
    assert_allclose(force / 7e-3, -v / np.linalg.norm(v), atol=1e-12)
    assert_allclose(200 * at["omega_SN_S"], np.cross([0.10, 0.02, -0.01], force), rtol=1e-12)
    assert_allclose(at["omega_TS_T"], -at["omega_SN_S"], rtol=1e-12)
