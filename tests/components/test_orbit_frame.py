"""The orbit frame, on a circle and from position and velocity, and the gravity gradient in it."""

import numpy as np
import pytest
from helpers import Point, monolithic
from numpy.testing import assert_allclose
from published import as_in
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from components.environment.gravity_gradient import GravityGradient
from components.guidance.orbit_frame_from_state import OrbitFrameFromState
from components.plants.flexible_spacecraft import FlexibleSpacecraft

OrbitFrame = as_in("xiao2011-pid", "guidance")

MU = 3.986004418e14
RATE = 1.078e-3


def rotation(q) -> Rotation:
    return Rotation.from_quat(q, scalar_first=True)


def axes(q) -> np.ndarray:
    """The axes of R in N, as rows."""
    return rotation(q).apply(np.eye(3))


@pytest.mark.parametrize("t", [0.0, 300.0, 2500.0, 9000.0])
def test_axes_of_a_circular_orbit(t):
    """Body at r = -z_R, moving along x_R, orbit normal -y_R: written out from the position on the circle."""
    y = Point(OrbitFrame(phase=0.3), t=t).outputs()
    a = RATE * t + 0.3
    # at a = 0 R is N: position -z_N, velocity x_N
    position, velocity = [np.sin(a), 0, -np.cos(a)], [np.cos(a), 0, np.sin(a)]
    assert_allclose(axes(y["q_RN"]), [velocity, [0, 1, 0], np.negative(position)], atol=1e-14)
    assert_allclose(np.cross(position, velocity), [0, -1, 0], atol=1e-14)
    assert_allclose(y["omega_RN_R"], [0, -RATE, 0])
    assert_allclose(y["omega_dot_RN_R"], 0)


def turning(q_of, t, h) -> np.ndarray:
    """Rate of R relative to N in R by central differences."""
    return (rotation(q_of(t - h)).inv() * rotation(q_of(t + h))).as_rotvec() / (2 * h)


def test_rate_is_that_of_the_frame():
    def q(t):
        return Point(OrbitFrame(), t=t).outputs()["q_RN"]

    assert_allclose(turning(q, 500.0, 1.0), [0, -RATE, 0], atol=1e-12)


def kepler(e: float, J2: float = 0.0):
    """Position and velocity on an inclined orbit that scipy integrates, with the potential's J2 written out."""
    a = 7e6
    turn = Rotation.from_euler("ZXZ", [40, 60, 25], degrees=True)
    r, v = turn.apply([a * (1 - e), 0, 0]), turn.apply([0, np.sqrt(MU / a * (1 + e) / (1 - e)), 0])

    def rates(t, y):
        r, (_, _, z) = np.linalg.norm(y[:3]), y[:3]
        oblate = 1.5 * J2 * 6378136.3**2 / r**2 * (np.array([1, 1, 3]) - 5 * z**2 / r**2)
        return [*y[3:], *(-MU * y[:3] / r**3 * (1 + oblate))]

    return solve_ivp(rates, (0, 7000), [*r, *v], "DOP853", rtol=1e-12, atol=1e-6, dense_output=True).sol


@pytest.mark.parametrize("e", [0.0, 0.3])
@pytest.mark.parametrize("t", [100.0, 2000.0, 4000.0, 6000.0])
def test_frame_of_position_and_velocity(e, t):
    orbit, h = kepler(e), 5.0

    def outputs(moment):
        return Point(OrbitFrameFromState(), J2=0.0, r_N=orbit(moment)[:3], v_N=orbit(moment)[3:]).outputs()

    r, v = np.split(orbit(t), 2)
    y, normal = outputs(t), np.cross(r, v) / np.linalg.norm(np.cross(r, v))
    x, minus_normal, nadir = axes(y["q_RN"])
    assert_allclose(nadir, -r / np.linalg.norm(r), atol=1e-13)
    assert_allclose(minus_normal, -normal, atol=1e-13)
    assert x @ v > 0
    assert_allclose(np.linalg.norm(y["q_RN"]), 1, rtol=1e-14)
    assert_allclose(y["omega_RN_R"], turning(lambda s: outputs(s)["q_RN"], t, h), rtol=1e-4, atol=1e-9)
    slope = (outputs(t + h)["omega_RN_R"] - outputs(t - h)["omega_RN_R"]) / (2 * h)
    assert_allclose(y["omega_dot_RN_R"], slope, rtol=1e-4, atol=1e-11)


def test_the_plane_of_an_orbit_about_an_oblate_earth_turns():
    """With J2 the frame turns about nadir too, some 1e-6 rad/s: omega_RN_R has it."""
    orbit, J2, h = kepler(0.01, 1.08262668e-3), 1.08262668e-3, 5.0

    def outputs(moment):
        return Point(OrbitFrameFromState(), J2=J2, r_N=orbit(moment)[:3], v_N=orbit(moment)[3:]).outputs()

    for t in (300.0, 1500.0, 3100.0):
        y = outputs(t)
        assert_allclose(y["omega_RN_R"], turning(lambda s: outputs(s)["q_RN"], t, h), atol=1e-9)
        assert 1e-8 < abs(y["omega_RN_R"][2]) < 5e-6


def test_both_agree_on_a_circle():
    r, t = 7e6, 777.0
    n = np.sqrt(MU / r**3)
    a = n * t
    state = Point(
        OrbitFrameFromState(),
        J2=0.0,
        r_N=[r * np.sin(a), 0, -r * np.cos(a)],
        v_N=[r * n * np.cos(a), 0, r * n * np.sin(a)],
    ).outputs()
    circle = Point(OrbitFrame(orbit_rate=n), t=t).outputs()
    assert_allclose(axes(state["q_RN"]), axes(circle["q_RN"]), atol=1e-14)
    assert_allclose(state["omega_RN_R"], circle["omega_RN_R"], rtol=1e-12, atol=1e-18)


def test_no_plane_is_refused():
    messages = Point(OrbitFrameFromState(), r_N=[7e6, 0, 0], v_N=[-3, 0, 0]).violated()
    assert messages and "r_N and v_N are parallel or zero" in messages[0] and "7e+06 m" in messages[0]


def test_an_orbit_below_the_surface_is_refused():
    (message,) = Point(OrbitFrameFromState(), r_N=[6.3e6, 0, 0]).violated()
    assert message.startswith(
        "r_N is 6300 km from the Earth's centre at the start, earth_radius is 6378.14 km: the orbit"
    )
    for part in (OrbitFrame, GravityGradient):
        (message,) = Point(part(orbit_rate=1.3e-3)).violated()
        assert message.startswith("orbit_rate = 0.0013 rad/s: the orbit is below the surface of the Earth")


@pytest.mark.parametrize("part", [OrbitFrame, GravityGradient])
@pytest.mark.parametrize("rate", [0.0, -1.078e-3])
def test_an_orbit_that_stands_or_runs_backwards_is_refused(part, rate):
    """The orbit normal is -y_N: a rate below zero would contradict the frame."""
    assert Point(part(orbit_rate=rate)).violated() == [f"orbit_rate = {rate:.6g} rad/s: it must be positive."]


def test_an_earth_without_size_or_that_repels_is_refused():
    found = Point(OrbitFrameFromState(), mu=-1.0, earth_radius=0.0).violated()
    assert found == ["earth_radius = 0 m: it must be positive.", "mu = -1 m3/s2: it must not be negative."]


def test_gravity_gradient_is_the_difference_of_weights():
    """Against two masses on a rod: the sum of their moments in the field 1/r^2, far smaller than the orbit."""
    r, t, length, mass = MU ** (1 / 3) / RATE ** (2 / 3), 400.0, 50.0, 3.0
    body = Rotation.from_euler("xyz", [0.3, -0.7, 1.1])
    rod_B = np.array([2.0, -1.0, 2.0]) / 3 * length
    a = RATE * t
    centre = r * np.array([np.sin(a), 0, -np.cos(a)])
    moment = np.zeros(3)
    for arm_B in (rod_B, -rod_B):
        arm = body.apply(arm_B)
        place = centre + arm
        moment += np.cross(arm, -MU * mass * place / np.linalg.norm(place) ** 3)
    J = 2 * mass * ((rod_B @ rod_B) * np.eye(3) - np.outer(rod_B, rod_B))
    part = Point(GravityGradient(J=J, orbit_rate=RATE), q_BN=body.as_quat(scalar_first=True), t=t)
    assert_allclose(part.outputs()["tau_dist_B"], body.inv().apply(moment), rtol=2e-5)


def test_libration_has_the_frequency_of_the_textbook():
    """Small pitch about the orbit frame: theta'' = -3 n^2 (J_x - J_z) / J_y theta."""
    J, n, pitch = np.diag([900.0, 1000.0, 400.0]), 0.01, 1e-4
    frequency = n * np.sqrt(3 * (900 - 400) / 1000)
    q = Rotation.from_euler("y", pitch).as_quat(scalar_first=True)
    components = {
        "environment": GravityGradient(J=J, orbit_rate=n),
        "plant": FlexibleSpacecraft(modes=0, J=J, q_BN=q, omega_BN_B=[0, -n, 0]),
        "guidance": OrbitFrame(orbit_rate=n),
    }
    connections = [("plant.q_BN", "environment.q_BN"), ("environment.tau_dist_B", "plant.tau_dist_B")]
    t, x, y = monolithic(components, connections, 1000.0, np.linspace(0, 1000, 101))
    error = rotation(y["guidance.q_RN"]).inv() * rotation(x["plant.q_BN"])
    assert_allclose(error.as_rotvec()[:, 1], pitch * np.cos(frequency * t), atol=1e-6 * pitch)


def test_gravity_gradient_refuses_what_is_no_inertia():
    messages = Point(GravityGradient(J=[[1, 2, 0], [2, 1, 0], [0, 0, 1]])).violated()
    assert any("J is not positive definite" in m for m in messages)
