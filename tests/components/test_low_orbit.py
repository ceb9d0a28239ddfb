"""Drag, sunlight and gusts of a low orbit."""

import numpy as np
import pytest
from helpers import Point
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp, trapezoid
from scipy.spatial.transform import Rotation

from components.drag_free import START_R_N, START_V_N
from components.environment.low_orbit import LowOrbit
from components.guidance.orbit_frame_from_state import OrbitFrameFromState

LEVEL = dict(q_BN=[1, 0, 0, 0])
SUN = np.array([0.6, -0.64, 0.48])


def around(turn):
    """Position and velocity on the circular orbit of the start, turned on."""
    speed, radius = np.linalg.norm(START_V_N), np.linalg.norm(START_R_N)
    c, s = np.cos(turn), np.sin(turn)
    return dict(r_N=c * START_R_N + s * START_V_N * radius / speed, v_N=c * START_V_N - s * START_R_N * speed / radius)


CALM = LowOrbit(lines=2)


def outputs(**values):
    return Point(CALM, **(LEVEL | values)).outputs()


def test_feedthrough():
    table = LowOrbit().direct_feedthrough
    assert table["sunlight"] == ("r_N",)
    assert all(table[n] == ("r_N", "v_N", "q_BN") for n in ("f_dist_B", "tau_dist_B", "drag_B"))


def test_mean_drag_over_an_orbit():
    drags = [np.linalg.norm(outputs(**around(turn))["drag_B"]) for turn in np.linspace(0, 2 * np.pi, 73)[:-1]]
    assert_allclose(np.mean(drags), 7e-3, rtol=1e-6)


def test_drag_is_against_the_velocity_and_falls_with_height():
    low = outputs(**around(0.7))
    assert_allclose(np.cross(low["drag_B"], around(0.7)["v_N"]), 0, atol=1e-14)
    assert low["drag_B"] @ around(0.7)["v_N"] < 0
    r = around(0.7)["r_N"]
    up = around(0.7) | {"r_N": r * (1 + 45e3 / np.linalg.norm(r))}
    assert_allclose(outputs(**up)["drag_B"], low["drag_B"] / np.e, rtol=1e-12)


def test_sunlight_and_shadow():
    radius = np.linalg.norm(START_R_N)
    assert outputs(r_N=radius * SUN)["sunlight"] == pytest.approx(1, abs=1e-12)
    assert outputs(r_N=-radius * SUN)["sunlight"] == pytest.approx(0, abs=1e-9)
    side = np.cross(SUN, [0, 0, 1])
    assert outputs(r_N=radius * side / np.linalg.norm(side))["sunlight"] == pytest.approx(1, abs=1e-6)
    no_drag = outputs(r_N=radius * SUN, rho_0=0.0)
    assert_allclose(no_drag["f_dist_B"], -5.9e-5 * SUN, rtol=1e-9)


def test_torque_acts_at_the_centre_of_pressure():
    y = outputs(**around(2.0), q_BN=[0.6, 0, 0.8, 0])
    assert_allclose(y["tau_dist_B"], np.cross([0.10, 0.02, -0.01], y["f_dist_B"]), atol=1e-18)


def test_attitude_turns_the_force():
    turned = outputs(q_BN=[np.sqrt(0.5), 0, 0, np.sqrt(0.5)])["f_dist_B"]  # 90 deg about z
    f = outputs()["f_dist_B"]
    assert_allclose(turned, [f[1], -f[0], f[2]], atol=1e-15)


def gusts(seed=1.0, stop=500.0):
    density = [7e-4, 1.4e-4, 0.0]
    part = LowOrbit(rho_0=0.0, solar_force=0.0, gust_density=density, seed=seed)
    f = part.functions.outputs
    point = Point(part, **LEVEL)
    t = np.arange(0, stop, 1.0)
    none = np.zeros((0, len(t)))
    y = f.map(len(t))(t[None], none, *(np.tile(v[:, None], len(t)) for v in (point.u, point.p, point.c)), none)
    return y.full()[3:6].T


def test_power_of_the_gusts_is_that_of_their_density():
    rows = gusts(stop=10000.0)
    f = np.linspace(2e-3, 0.2, 200001)
    power = trapezoid(1 / (1 + (f / 0.01) ** 2), f)
    assert_allclose(rows[:, 0].std(), 7e-4 * np.sqrt(power), rtol=0.03)
    assert_allclose(rows[:, 1].std(), 1.4e-4 * np.sqrt(power), rtol=0.03)
    assert np.abs(rows[:, 2]).max() == 0


def test_gusts_are_repeatable_and_differ_by_seed_and_axis():
    a, b, c = gusts(), gusts(), gusts(seed=2.0)
    assert (a == b).all()
    assert abs(np.corrcoef(a[:, 0], c[:, 0])[0, 1]) < 0.5 and abs(np.corrcoef(a[:, 0], a[:, 1])[0, 1]) < 0.5


def oblate(t, s):
    """A satellite under gravity with J2, in the test's own words."""
    r, v = s[:3], s[3:]
    R, k = np.linalg.norm(r), 1.5 * 1.08262668e-3 * 6378136.3**2
    lean = np.array([1, 1, 3]) - 5 * r[2] ** 2 / R**2
    return np.concatenate([v, -3.986004418e14 / R**3 * r * (1 + k / R**2 * lean)])


def test_rate_of_the_orbit_frame_where_the_earth_is_oblate():
    h = 0.5
    start = np.concatenate([START_R_N, START_V_N])
    ends = [solve_ivp(oblate, (0, k * h), start, "DOP853", rtol=1e-13).y[:, -1] for k in (-1, 1)]
    shown = [Point(OrbitFrameFromState(), r_N=s[:3], v_N=s[3:]).outputs() for s in (ends[0], start, ends[1])]
    before, _, after = (Rotation.from_quat(y["q_RN"], scalar_first=True) for y in shown)
    rate = (before.inv() * after).as_rotvec() / (2 * h)
    assert abs(rate[2]) > 1e-7  # what J2 does to the plane
    assert_allclose(shown[1]["omega_RN_R"], rate, atol=2e-9)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        (dict(r_N=[0, 6e6, 0]), "r_N is 6000 km from the Earth's centre, its radius is 6378.14 km: the orbit is below"),
        (dict(sun_N=[1, 1, 0]), "sun_N has length 1.41421: a unit vector"),
        (dict(scale_height=0.0), "scale_height = 0 m: it must be positive."),
        (dict(gust_corner=-1.0), "gust_corner = -1 1/s: it must be positive."),
        (dict(gust_band=[0.2, 0.1]), "gust_band is 0.2 to 0.1 Hz: 0 < lowest < highest is needed."),
    ],
)
def test_bad_input(values, message):
    assert any(text.startswith(message) for text in Point(CALM, **values).violated())
