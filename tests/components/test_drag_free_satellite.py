"""The drag-free plant: conservation, an outside reference in inertial coordinates, its cage, bad input."""

import numpy as np
import pytest
from helpers import Point, numbers, split
from numpy.testing import assert_allclose
from published import as_in
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from components.mathematics import gravity
from components.numbers.earth import EARTH_RADIUS, J2, MU

DragFreeSatellite = as_in("li2014-nn", "plant")

ZERO = [0.0, 0.0, 0.0]
QUIET = dict(mu=0.0, D=0.0, D_r=0.0, r_N=ZERO, v_N=ZERO, q_SN=[1, 0, 0, 0])
EARTH = gravity.Earth(MU, J2, EARTH_RADIUS)


def test_feedthrough():
    assert DragFreeSatellite().direct_feedthrough == {"H_N": (), "energy": (), "residual_acceleration_S": ()}


def inertial_axes(q):
    return Rotation.from_quat(q, scalar_first=True)


def test_momenta_and_energy_are_constant():
    """Gravity and commands off, no damping, at rest: relative to the largest contribution, over three periods."""
    point = Point(DragFreeSatellite(), **QUIET)
    x = split(point.component.states, point.advance(1.0, 20000).T)
    S, T = inertial_axes(x["q_SN"]), inertial_axes(x["q_TS"])
    rho = np.array([0.05, -0.03, 0.02]) + x["r_rel"]
    v_tm = x["v_N"] + S.apply(x["v_rel"] + np.cross(x["omega_SN_S"], rho))
    parts = 1050.0 * x["v_N"], 1.0 * v_tm
    total = sum(parts)
    assert np.abs(total - total[0]).max() < 1e-11 * max(np.abs(p).max() for p in parts)
    where = x["r_N"], x["r_N"] + S.apply(rho)
    w_tm = S.apply(T.apply(x["omega_TS_T"]) + x["omega_SN_S"])
    spin = 200.0 * S.apply(x["omega_SN_S"]), 2.667e-4 * w_tm
    turning = *(np.cross(r, p) for r, p in zip(where, parts, strict=True)), *spin
    total = sum(turning)
    assert np.abs(total - total[0]).max() < 1e-11 * max(np.abs(p).max() for p in turning)
    th = T.as_rotvec()
    stored = 0.5e-6 * (x["r_rel"] ** 2).sum(axis=1), 0.5e-9 * (th**2).sum(axis=1)
    moving = 525.0 * (x["v_N"] ** 2).sum(axis=1), 0.5 * (v_tm**2).sum(axis=1)
    turns = 100.0 * (x["omega_SN_S"] ** 2).sum(axis=1), 0.5 * 2.667e-4 * (w_tm**2).sum(axis=1)
    energy = sum((*stored, *moving, *turns))
    assert stored[0].min() < 0.3 * stored[0].max()  # it did move
    assert np.abs(energy - energy[0]).max() < 1e-11 * max(np.abs(p).max() for p in (*stored, *moving, *turns))


def test_momentum_and_energy_that_it_shows():
    part = DragFreeSatellite(**QUIET)
    point = Point(part, **QUIET)
    rows = point.advance(1.0, 8000)
    at = [numbers(part.functions.outputs(0, rows[:, k], point.u, point.p, point.c, [])) for k in (0, 2500, 7999)]
    H, energy = np.array([y[:3] for y in at]), np.array([y[3] for y in at])
    assert np.abs(H - H[0]).max() < 1e-10 * 2.667e-4 * 1.7e-2 * 2e-3
    assert_allclose(energy, energy[0], rtol=1e-10)


def earth(r):
    """Gravity with J2, in the test's own words: minus the gradient of its potential."""
    x, y, z = r
    R = np.sqrt(r @ r)
    k, tilt = 1.5 * 1.08262668e-3 * (6378136.3 / R) ** 2, 5 * z**2 / R**2
    flat, up = 1 + k * (1 - tilt), 1 + k * (3 - tilt)
    return -3.986004418e14 / R**3 * np.array([x * flat, y * flat, z * up])


def test_against_two_bodies_in_inertial_coordinates():
    """Newton and Euler for satellite and test mass, each from the Earth's centre; commands and disturbances on."""
    command, tau_command = np.array([0.03, -0.02, 0.01]), np.array([5e-3, -2e-3, 1e-3])
    drag, tau_drag = np.array([-0.01, 0.01, -0.005]), np.array([-3e-3, 1e-3, 2e-3])
    f, tau, tau_t = command + drag, tau_command + tau_drag, np.array([1e-8, 2e-8, -1e-8])
    part = DragFreeSatellite(J=np.diag([180.0, 220.0, 200.0]), K=1e-3, D=1e-4, K_r=1e-6, D_r=1e-8, cage_gap=1.0)
    inputs = dict(f_command_S=command, tau_command_S=tau_command, f_dist_S=drag, tau_dist_S=tau_drag)
    point = Point(part, **inputs, tau_command_T=tau_t, omega_SN_S=[1e-3, 2e-3, -1e-3])
    x0, J, r_h = point.states(), np.diag([180.0, 220.0, 200.0]), np.array([0.05, -0.03, 0.02])
    stop = 40.0
    found = split(part.states, point.advance(0.02, round(stop / 0.02)).T)

    def spun(w):  # q' = 1/2 q (x) (0, w)
        x, y, z = w
        return 0.5 * np.array([[0, -x, -y, -z], [x, 0, z, -y], [y, -z, 0, x], [z, y, -x, 0]])

    def rates(t, s):  # offset of the test mass from the satellite, so that 1e-9 m can be told from an orbit
        r, v, d, d_dot, q, w, q_t, w_t = np.split(s, [3, 6, 9, 12, 16, 19, 23])
        S, M = inertial_axes(q), inertial_axes(q_t)
        rel = S.inv() * M
        rho = S.inv().apply(d)
        slide = S.inv().apply(d_dot) - np.cross(w, rho)
        turn = w_t - rel.inv().apply(w)
        F = -1e-3 * (rho - r_h) - 1e-4 * slide
        T = -1e-6 * rel.as_rotvec() - 1e-8 * turn
        acceleration = earth(r) + S.apply(f - F) / 1050
        far = 1e4  # the difference of gravity is linear over some km to 1e-3 of itself: take it over a longer base
        tide = (earth(r + far * d) - earth(r - far * d)) / (2 * far)
        down = S.inv().apply(r)
        drive = tau - rel.apply(T + tau_t) - np.cross(rho, F) - np.cross(w, J @ w)
        drive += 3 * 3.986004418e14 / np.linalg.norm(r) ** 5 * np.cross(down, J @ down)
        w_dot, w_t_dot = np.linalg.solve(J, drive), (T + tau_t) / 2.667e-4
        d_ddot = tide + S.apply(F) / 1.0 - S.apply(f - F) / 1050
        return np.concatenate([v, acceleration, d_dot, d_ddot, spun(w) @ q, w_dot, spun(w_t) @ q_t, w_t_dot])

    S0, rel0 = inertial_axes(x0["q_SN"]), inertial_axes(x0["q_TS"])
    rho0 = r_h + x0["r_rel"]
    start = [x0["r_N"], x0["v_N"], S0.apply(rho0), S0.apply(np.cross(x0["omega_SN_S"], rho0)), x0["q_SN"]]
    start += [x0["omega_SN_S"], (S0 * rel0).as_quat(scalar_first=True), rel0.inv().apply(x0["omega_SN_S"])]
    end = solve_ivp(rates, (0, stop), np.concatenate(start), "DOP853", rtol=1e-11, atol=1e-14).y[:, -1]
    S, M = inertial_axes(end[12:16]), inertial_axes(end[19:23])
    assert np.linalg.norm(found["r_rel"][-1]) > 3e-3
    assert_allclose(found["r_rel"][-1], S.inv().apply(end[6:9]) - r_h, atol=1e-10)
    assert (inertial_axes(found["q_TS"][-1]).inv() * (S.inv() * M)).magnitude() < 1e-9
    assert (inertial_axes(found["q_SN"][-1]).inv() * S).magnitude() < 1e-10
    assert_allclose(found["r_N"][-1], end[:3], atol=1e-6)


@pytest.mark.parametrize("size", [1e-3, 0.06, 30.0])
def test_difference_of_gravity_without_cancellation(size):
    """Point mass against extended precision, J2 against differences over a longer base."""
    r = np.array([5534543.169, 2889505.428, 2254871.133])
    s = size * np.array([0.6, -0.64, 0.48])
    found = numbers(gravity.difference(gravity.Earth(MU, 0, 1.0), r, s))
    R, d = r.astype(np.longdouble), s.astype(np.longdouble)
    E = R + d
    far = -np.longdouble(MU) * (E / np.sqrt((E**2).sum()) ** 3 - R / np.sqrt((R**2).sum()) ** 3)
    assert_allclose(found, far.astype(float), rtol=1e-11 / size, atol=0)
    oblate = numbers(gravity.difference(EARTH, r, s)) - found
    longer = 2e3 / size
    ends = r + longer * s, r - longer * s
    wide = [earth(end) + MU * end / np.linalg.norm(end) ** 3 for end in ends]
    assert_allclose(oblate, (wide[0] - wide[1]) / (2 * longer), rtol=1e-5, atol=1e-7 * np.abs(oblate).max())


def test_residual_acceleration_is_that_of_the_test_mass():
    """What its inertial velocity gains in a short time: no gravity, spring and damper, a turned satellite."""
    h, at_rest = 1e-3, QUIET | dict(q_SN=[0.5, 0.5, -0.5, 0.5])
    point = Point(DragFreeSatellite(), **at_rest | dict(D=0.2, K=1.0), v_rel=[1e-3, 2e-3, 0])
    rows = np.column_stack([point.x, point.advance(h, 1)]).T
    x, shown = split(point.component.states, rows), []
    for row in rows:
        point.x = row
        shown.append(point.outputs()["residual_acceleration_S"])
    shown = inertial_axes(x["q_SN"]).apply(shown)
    rho = np.array([0.05, -0.03, 0.02]) + x["r_rel"]
    v_tm = x["v_N"] + inertial_axes(x["q_SN"]).apply(x["v_rel"] + np.cross(x["omega_SN_S"], rho))
    assert_allclose((v_tm[1] - v_tm[0]) / h, shown.mean(axis=0), rtol=1e-6)  # trapezoid: (D h/m)^2/12 and the like


def test_the_cage_holds_the_test_mass():
    point = Point(DragFreeSatellite(), **QUIET, r_rel=ZERO, v_rel=[0, -1e-3, 0], K=0.0)
    x = split(point.component.states, point.advance(0.01, 600).T)
    assert x["cage_contact"][[0, 398, 401]].tolist() == [0, 0, 1]
    assert_allclose(x["contact_time"][-1], 4.0, atol=0.011)
    assert_allclose(x["r_rel"][-1], [0, -4e-3, 0], atol=1.1e-5)
    assert np.abs(x["v_rel"][-1]).max() == 0 and np.abs(x["omega_TS_T"][-1]).max() == 0
    assert (x["cage_contact"][401:] == 1).all()


def test_the_test_mass_does_not_turn_in_the_grip_of_its_cage():
    """A torque that would turn it by many degrees."""
    turning = dict(omega_TS_T=[0, 0.01, 0], tau_command_T=[1e-5, 0, 0])
    point = Point(DragFreeSatellite(), **QUIET, r_rel=ZERO, v_rel=[0, -1e-3, 0], **turning)
    x = split(point.component.states, point.advance(0.01, 800).T)
    q = inertial_axes(x["q_TS"])
    assert (q[0].inv() * q[390]).magnitude() > 0.1
    assert (q[405].inv() * q[405:]).magnitude().max() < 1e-14
    held = Point(DragFreeSatellite(), cage_contact=1.0, v_rel=[1e-3, 0, 0], **turning).rates()
    assert all(np.abs(held[n]).max() == 0 for n in ("r_rel", "v_rel", "q_TS", "omega_TS_T"))


@pytest.mark.parametrize(
    ("values", "message"),
    [
        (
            dict(J=np.diag([100.0, 50.0, 160.0])),
            "J breaks the triangle inequality: its largest principal moment 160 kg.m2",
        ),
        (dict(J=-np.eye(3)), "J is not positive definite (smallest eigenvalue -1 kg.m2)"),
        (dict(I_tm=0.0), "I_tm = 0 kg.m2: it must be positive."),
        (dict(m_tm=-1.0), "m_tm = -1 kg: it must be positive."),
        (dict(m_sc=0.0), "m_sc = 0 kg: it must be positive."),
        (dict(cage_gap=0.0), "cage_gap = 0 m: it must be positive."),
        (dict(D=-1e-11), "D = -1e-11 N.s/m: it must not be negative."),
        (dict(D_r=-1e-14), "D_r = -1e-14 N.m.s/rad: it must not be negative."),
        (dict(mu=-1.0), "mu = -1 m3/s2: it must not be negative."),
        (dict(earth_radius=0.0), "earth_radius = 0 m: it must be positive."),
        (dict(r_N=[6.3e6, 0, 0]), "r_N is 6300 km from the Earth's centre at the start, earth_radius is 6378.14 km"),
        (dict(v_N=[0, 0, 0]), "perigee of r_N and v_N at the start is 0 km from the Earth's centre"),
        (dict(r_rel=[0, -5e-3, 0]), "r_rel has an element of 5 mm at the start, its cage is at 4 mm (cage_gap)."),
        (dict(q_SN=[0, 0, 0, 0]), "q_SN has norm 0 at the start"),
        (dict(q_TS=[2, 0, 0, 0]), "q_TS has norm 2 at the start"),
    ],
)
def test_bad_input(values, message):
    assert any(text.startswith(message) for text in Point(DragFreeSatellite(), **values).violated())


@pytest.mark.parametrize(
    ("lowest", "highest"), [(6300.0, 6638.0), (6390.0, 6638.0), (6390.0, 42164.0), (6300.0, 42164.0)]
)
@pytest.mark.parametrize("turn", [0.4, 2.0, -1.0])
def test_an_orbit_into_the_ground_is_refused(lowest, highest, turn):
    """Kepler's ellipse of two distances (km), entered anywhere above the ground, climbing or falling."""
    a, e = 5e2 * (lowest + highest), (highest - lowest) / (highest + lowest)
    p, tilt = a * (1 - e**2), Rotation.from_euler("xz", [1.1, 0.3])
    turn = np.pi * np.sign(turn) - turn if lowest < 6378 else turn  # near the apogee
    r = p / (1 + e * np.cos(turn)) * np.array([np.cos(turn), np.sin(turn), 0])
    v = np.sqrt(3.986004418e14 / p) * np.array([-np.sin(turn), e + np.cos(turn), 0])
    found = Point(DragFreeSatellite(), r_N=tilt.apply(r), v_N=tilt.apply(v)).violated()
    text = (
        f"perigee of r_N and v_N at the start is {lowest:g} km from the Earth's centre, earth_radius is 6378.14 km: "
        "the orbit leads into the ground. Check v_N."
    )
    assert found == ([text] if lowest < 6378 else [])


def test_a_spring_may_push_away():
    """As the electrostatic one of a real suspension does."""
    assert Point(DragFreeSatellite(), K=-1e-6, K_r=-1e-9).violated() == []
