"""Drag, sunlight and gusts of a low orbit."""

import numpy as np
import pytest
from helpers import Point, split
from numpy.testing import assert_allclose
from published import as_in
from scipy.integrate import solve_ivp, trapezoid
from scipy.spatial.transform import Rotation

from cosim.studies.papers.li2014.start import orbit

LowOrbit = as_in("li2014-nn", "environment")
OrbitFrameFromState = as_in("li2014-nn-lvlh", "guidance")

START_R_N, START_V_N = orbit()
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


def test_the_air_is_denser_at_noon():
    """The bulge is 30 % of the mean density towards the Sun and as much less opposite to it."""
    radius, across = np.linalg.norm(START_R_N), 7.7e3 * np.cross(SUN, [0, 0, 1])
    noon, dusk, midnight = (
        np.linalg.norm(outputs(r_N=radius * r, v_N=across)["drag_B"])
        for r in (SUN, across / np.linalg.norm(across), -SUN)
    )
    assert_allclose([noon / dusk, midnight / dusk], [1.3, 0.7], rtol=1e-12)


def shadow(along, above):
    """Sunlight at l m along the Sun's line, at a distance from it that is the Earth's radius and so many m."""
    side = np.cross(SUN, [0, 0, 1])
    return outputs(r_N=along * SUN + (6378136.3 + above) * side / np.linalg.norm(side))["sunlight"]


def test_widths_of_terminator_and_penumbra():
    """One width from its middle, half of a tanh has the part (1 + tanh 1)/2 = 0.8808 of its way behind it."""
    part = 1 / (1 + np.exp(-2.0))
    at_edge, in_shadow = (shadow(l, 0) for l in (2e5, -2e5)), (shadow(-6e6, above) for above in (2e4, -2e4))
    assert_allclose(list(at_edge), [0.5 + part / 2, 1 - part / 2], rtol=1e-9)
    assert_allclose(list(in_shadow), [part, 1 - part], rtol=1e-6)


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


def gusts(seed=1.0, stop=500.0, density=(7e-4, 1.4e-4, 0.0), **values):
    """Gusts at every second, in B; the attitude is that of the orbit frame if it is not given."""
    part = LowOrbit(rho_0=0.0, solar_force=0.0, gust_density=density, seed=seed)
    f = part.functions.outputs
    point = Point(part, **({"q_BN": Point(OrbitFrameFromState(), **around(0)).outputs()["q_RN"]} | values))
    t = np.arange(0, stop, 1.0)
    none = np.zeros((0, len(t)))
    y = f.map(len(t))(t[None], none, *(np.tile(v[:, None], len(t)) for v in (point.u, point.p, point.c)), none)
    return y.full()[3:6].T


TUMBLED = Rotation.from_euler("xyz", [2.0, -0.9, 0.7])


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_gusts_blow_along_and_across_the_track_whatever_the_attitude(axis):
    """Along the velocity, along the orbit normal, and at right angles to both, on an ellipse too."""
    climbing = dict(r_N=START_R_N, v_N=START_V_N + 900.0 * START_R_N / np.linalg.norm(START_R_N))
    density = 1e-4 * np.eye(3)[axis]
    rows = TUMBLED.apply(gusts(stop=50.0, density=density, q_BN=TUMBLED.as_quat(scalar_first=True), **climbing))
    normal = np.cross(climbing["r_N"], climbing["v_N"])
    line = (climbing["v_N"], normal, np.cross(normal, climbing["v_N"]))[axis]
    size = np.abs(rows @ line).max() / np.linalg.norm(line)
    assert size > 1e-5 and np.abs(np.cross(rows, line)).max() < 1e-12 * size * np.linalg.norm(line)


def test_gusts_of_a_satellite_that_points_to_the_earth_are_those_of_its_axes():
    """Each axis of the body has the lines of its own density, phases and sign included."""
    part = LowOrbit(gust_density=[7e-4, 1.4e-4, 2e-4])
    c = split(part.calculated_parameters, Point(part).c)
    turns = np.arange(0, 50.0)[:, None, None] * c["gust_frequency"] + c["gust_phase"]
    expected = (c["gust_amplitude"] * np.cos(2 * np.pi * turns)).sum(axis=2)
    assert_allclose(gusts(stop=50.0, density=[7e-4, 1.4e-4, 2e-4]), expected, atol=1e-12 * np.abs(expected).max())


def test_power_of_the_gusts_is_that_of_their_density():
    rows = gusts(stop=10000.0)
    f = np.linspace(2e-3, 0.2, 200001)
    power = trapezoid(1 / (1 + (f / 0.01) ** 2), f)
    assert_allclose(rows[:, 0].std(), 7e-4 * np.sqrt(power), rtol=0.03)
    assert_allclose(rows[:, 1].std(), 1.4e-4 * np.sqrt(power), rtol=0.03)
    assert np.abs(rows[:, 2]).max() < 1e-12 * np.abs(rows[:, 1]).max()


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
        (dict(r_N=[0, 6e6, 0]), "r_N is 6000 km from the Earth's centre at the start, earth_radius is 6378.14 km"),
        (dict(v_N=[0, 0, 0]), "r_N and v_N are parallel or zero at the start (|r_N| = 6.63814e+06 m, |v_N| = 0 m/s)"),
        (dict(rho_0=-1e-12), "rho_0 = -1e-12 kg/m3: it must not be negative."),
        (dict(CdA=-1.0), "CdA = -1 m2: it must not be negative."),
        (dict(solar_force=-1.0), "solar_force = -1 N: it must not be negative."),
        (dict(gust_density=[0, 0, -1]), "gust_density[3] = -1 N/Hz^(1/2): it must not be negative."),
        (dict(bulge=1.1), "bulge = 1.1: the night's density 1 - b is that of a gas for 0 <= b <= 1 only."),
        (dict(bulge=-0.3), "bulge = -0.3: the night's density"),
        (dict(earth_radius=0.0), "earth_radius = 0 m: it must be positive."),
        (dict(terminator_width=0.0), "terminator_width = 0 m: it must be positive."),
        (dict(penumbra_width=0.0), "penumbra_width = 0 m: it must be positive."),
        (dict(sun_N=[1, 1, 0]), "sun_N has length 1.41421, a unit vector"),
        (dict(scale_height=0.0), "scale_height = 0 m: it must be positive."),
        (dict(gust_corner=-1.0), "gust_corner = -1 1/s: it must be positive."),
        (dict(gust_band=[0.2, 0.1]), "gust_band is 0.2 to 0.1 Hz: 0 < lowest < highest is needed."),
    ],
)
def test_bad_input(values, message):
    assert any(text.startswith(message) for text in Point(CALM, **values).violated())
