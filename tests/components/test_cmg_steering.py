"""Steering of parallel gyros and wheels: the singular measure, what it delivers, limits, hand-over, refusals."""

import numpy as np
import pytest
from helpers import Point
from numpy.testing import assert_allclose
from published import as_in

CmgSteering = as_in("geng2012-compensated", "steering")


STEERING = CmgSteering()
H_0 = 15.0
FAR = dict(attitude_error=[0.0, -1.0, 0.0])
RNG = np.random.default_rng(5)


def momentum(angles):
    return H_0 * np.array([np.cos(angles).sum(), np.sin(angles).sum()])


def cluster_torque(y, angles, inertia=0.02):
    """The torque on the hub of a cluster that carries the commands out: minus the rate of its momentum."""
    h = 1e-6
    ahead, behind = (momentum(angles + s * h * y["gimbal_rate_command"]) for s in (1, -1))
    return -np.append((ahead - behind) / (2 * h), 0) - inertia * y["wheel_acceleration_command"]


def test_feedthrough():
    table = STEERING.direct_feedthrough
    everything = ("tau_command_B", "attitude_error", "omega_BN_B", "gimbal_angle")
    assert table["gimbal_rate_command"] == everything
    assert table["singularity"] == ("gimbal_angle",)
    assert table["share"] == ("attitude_error", "omega_BN_B")


def test_measure_of_singularity():
    """det(A A^T) = m (1 - m/4), m = |h|^2 / h_0^2: none at rest, none where all momentum is used."""
    for angles in [*RNG.uniform(-np.pi, np.pi, (50, 2)), [np.pi / 4, 5 * np.pi / 4], [0.3, 0.3]]:
        m = np.sum(momentum(angles) ** 2) / H_0**2
        y = Point(STEERING, gimbal_angle=angles).outputs()
        assert_allclose(y["singularity"], m * (1 - m / 4), atol=1e-12)


def test_torque_at_the_start():
    """geng2012, figures: u(0) = [-.023, 3.504, -.015] becomes [-1.503, 2.003, -.015] N m."""
    u = [-0.02282028, 3.50448732, -0.01490761]
    y = Point(STEERING, tau_command_B=u, attitude_error=[0, -np.pi / 3, 0]).outputs()
    assert_allclose(y["tau_planned_B"], [-1.503, 2.003, -0.015], atol=0.005)
    assert (y["saturated"], y["share"]) == (1, 1)


def test_the_plan_is_what_the_cluster_will_give():
    for _ in range(20):
        angles, u = RNG.uniform(-np.pi, np.pi, 2), RNG.normal(0, 1, 3)
        y = Point(STEERING, tau_command_B=u, gimbal_angle=angles, attitude_error=RNG.normal(0, 0.01, 3)).outputs()
        assert_allclose(cluster_torque(y, angles), y["tau_planned_B"], atol=1e-7)


def test_a_command_within_all_limits_is_met_exactly():
    u = np.array([0.2, -0.24, 0.1])
    for away in (0.0, np.radians(0.6), 1.0):
        y = Point(STEERING, tau_command_B=u, gimbal_angle=[0.3, 1.8], attitude_error=[0, away, 0]).outputs()
        assert_allclose(y["tau_planned_B"], u, atol=1e-12)
        assert y["saturated"] == 0


def test_singularity_robust_law():
    """Of all rates, (4) has the least gamma' W^-1 gamma' + r V^-1 r with r what the gyros do not give."""
    angles, u, t = np.array([0.4, 2.6]), np.array([0.05, -0.08]), 1.3
    y = Point(STEERING, t=t, tau_command_B=[*u, 0], gimbal_angle=angles, **FAR).outputs()
    A = np.array([-np.sin(angles), np.cos(angles)])
    lam, k = 0.01 * np.exp(-10 * np.linalg.det(A @ A.T)), 0.1 * np.cos(t)
    V, W = lam * np.array([[1, k], [k, 1]]), np.array([[1, lam], [lam, 1]])
    V_half, W_half = (np.linalg.cholesky(np.linalg.inv(M)).T for M in (V, W))
    rows, right = np.vstack([W_half, V_half @ A]), np.concatenate([[0, 0], V_half @ (-u / H_0)])
    assert_allclose(y["gimbal_rate_command"], np.linalg.lstsq(rows, right, rcond=None)[0], rtol=1e-9)


def test_off_diagonal_weights_lead_away_from_a_singular_direction():
    """Gyros in line and a torque along them: without off-diagonal weights no rate at all would come."""
    stuck = dict(tau_command_B=[1.0, 0, 0], gimbal_angle=[0.0, np.pi], **FAR)
    assert_allclose(Point(STEERING, k_0=0.0, **stuck).outputs()["gimbal_rate_command"], 0, atol=1e-12)
    assert np.abs(Point(STEERING, **stuck).outputs()["gimbal_rate_command"]).max() > 1e-3


def test_rate_limit_keeps_the_direction():
    command = dict(tau_command_B=[-1.0, 3.3, 0], gimbal_angle=[0.2, 2.9], **FAR)
    free = Point(STEERING, gimbal_rate_limit=1e3, **command).outputs()["gimbal_rate_command"]
    limited = Point(STEERING, **command).outputs()["gimbal_rate_command"]
    assert np.abs(free).max() > 3.5 / 15
    assert_allclose(np.abs(limited).max(), 3.5 / 15, rtol=1e-12)
    assert_allclose(limited / free, limited[0] / free[0], rtol=1e-12)


def test_dead_zone():
    u = np.array([4e-3, 1e-3, 0])
    command = dict(tau_command_B=u, gimbal_angle=[0.3, 1.8], **FAR)
    free = Point(STEERING, gimbal_dead_zone=0.0, **command).outputs()["gimbal_rate_command"]
    y = Point(STEERING, **command).outputs()
    below = np.abs(free) < np.radians(0.02)
    assert below.any()
    assert_allclose(y["gimbal_rate_command"], np.where(below, 0, free))
    assert_allclose(y["tau_planned_B"], u, atol=1e-15)  # the wheels take it over


def test_plane_and_wheel_limits():
    y = Point(
        STEERING, tau_command_B=[30.0, 40.0, 5.0], gimbal_angle=[0.3, 1.8], gimbal_rate_limit=10.0, **FAR
    ).outputs()
    assert_allclose(y["tau_planned_B"][:2], [2.1, 2.8], rtol=1e-9)
    assert_allclose(y["tau_planned_B"][2], 0.25)


def test_hand_over():
    """c is 0 up to 0.3 deg, 1/2 at 0.65 deg, 1 from 1 deg on, of |e| + 4 s |w|; smooth at both ends."""
    degree = np.radians(1.0)

    def share(e, w=0.0, **values):
        return Point(STEERING, attitude_error=[0, e * degree, 0], omega_BN_B=[w * degree, 0, 0], **values).outputs()[
            "share"
        ]

    assert_allclose([share(e) for e in (0, 0.3, 0.65, 1.0, 60)], [0, 0, 0.5, 1, 1], atol=1e-12)
    assert_allclose(share(0.25, 0.1), 0.5)
    assert_allclose([share(0.3 + 1e-4), share(1 - 1e-4)], [0, 1], atol=1e-6)
    assert share(0, hand_over=0) == 1


def test_the_gyros_rest_near_the_reference():
    y = Point(STEERING, tau_command_B=[0.1, -0.2, 0.1], gimbal_angle=[0.3, 1.8]).outputs()
    assert_allclose(y["gimbal_rate_command"], 0)
    assert_allclose(-0.02 * y["wheel_acceleration_command"], [0.1, -0.2, 0.1])


def test_wheels_about_z_only():
    values = dict(trim_wheels=0, hand_over=0, tau_command_B=[0.1, -0.2, 0.1], gimbal_angle=[np.pi / 4, 5 * np.pi / 4])
    y = Point(STEERING, **values).outputs()
    assert_allclose(-0.02 * y["wheel_acceleration_command"], [0, 0, 0.1], atol=1e-15)
    assert y["saturated"] == 1


@pytest.mark.parametrize("hand_over", [0, 1])
def test_wheels_about_x_and_y_in_the_end_phase_only(hand_over):
    """From |e| + 4 s |w| = 1 deg on the gyros are alone, nearer the wheels trim as if they always did."""
    command = dict(tau_command_B=[0.1, -0.2, 0.1], gimbal_angle=[np.pi / 4, 5 * np.pi / 4], hand_over=hand_over)

    def at(degrees, trim, rate=0.0):
        e, w = np.radians([[0, degrees, 0], [rate, 0, 0]])
        return Point(STEERING, trim_wheels=trim, attitude_error=e, omega_BN_B=w, **command).outputs()

    for degrees, rate in ((1.0, 0.0), (60.0, 0.0), (0.0, 0.3), (0.9, 0.1)):  # rates in deg/s
        alone, far = at(degrees, 0, rate), at(degrees, 2, rate)
        for name in alone:
            assert_allclose(far[name], alone[name], err_msg=name)
        assert_allclose(-0.02 * far["wheel_acceleration_command"], [0, 0, 0.1], atol=1e-15)
        assert far["saturated"] == 1  # gyros against each other: singular
    for degrees, rate in ((0.999, 0.0), (0.5, 0.0), (0.5, 0.1)):
        always, near = at(degrees, 1, rate), at(degrees, 2, rate)
        for name in always:
            assert_allclose(near[name], always[name], err_msg=name)
        assert_allclose(near["tau_planned_B"], command["tau_command_B"], atol=1e-12)


def test_skew_wheels_give_what_the_gyros_lack():
    """Four wheels of a pyramid, then three along no body axis: the plan is what the commands give about their axes."""
    pyramid = np.array([[1, 0, -1, 0], [0, 1, 0, -1], [0.7, 0.7, 0.7, 0.7]]) / np.sqrt(1.49)
    skew, _ = np.linalg.qr(RNG.normal(size=(3, 3)))
    skew[:, 0] = (skew[:, 0] + 0.4 * skew[:, 1]) / np.sqrt(1.16)
    for axes in (pyramid, skew):
        part = CmgSteering(wheels=axes.shape[1], spin_axes_B=axes, wheel_inertia=0.02)
        assert Point(part).violated() == []
        for trim, limit in ((0, 0.25), (1, 0.25), (1, 0.03)):
            angles, u = np.array([0.3, 1.8]), np.array([0.1, -0.2, 0.15])
            values = dict(tau_command_B=u, gimbal_angle=angles, trim_wheels=trim, wheel_torque_limit=limit)
            y = Point(part, gimbal_dead_zone=1e-2, **FAR, **values).outputs()
            accelerations = y.pop("wheel_acceleration_command")
            gyros = cluster_torque(y | {"wheel_acceleration_command": np.zeros(3)}, angles)
            planned = gyros - axes @ (0.02 * accelerations)
            assert_allclose(y["tau_planned_B"], planned, atol=1e-8)
            if limit > 0.1:
                lacking = (u - gyros) * [trim, trim, 1]
                assert_allclose(planned - gyros, lacking, atol=1e-8)
            else:
                assert y["saturated"] == 1
                assert_allclose(np.abs(0.02 * accelerations).max(), limit)


def test_more_gyros():
    u = np.array([0.3, -0.4, 0.1])
    y = Point(CmgSteering(gimbals=3), tau_command_B=u, gimbal_angle=[0.3, 1.8, 4.0], **FAR).outputs()
    assert_allclose(y["tau_planned_B"], u, atol=1e-12)


def test_what_is_inverted_stays_regular_where_the_cluster_is_singular():
    """det and least singular value of A W A^T + V, of any gyros at any time, written out with NumPy."""
    for angles in [*RNG.uniform(-np.pi, np.pi, (20, 2)), [0.3, 0.3 + np.pi], [0.3, 0.3]]:
        t = RNG.uniform(0, 10)
        y = Point(STEERING, t=t, gimbal_angle=angles).outputs()
        A = np.array([-np.sin(angles), np.cos(angles)])
        lam, k = 0.01 * np.exp(-10 * np.linalg.det(A @ A.T)), 0.1 * np.cos(t)
        N = A @ np.array([[1, lam], [lam, 1]]) @ A.T + lam * np.array([[1, k], [k, 1]])
        assert_allclose(y["inverted_determinant"], np.linalg.det(N), rtol=1e-9)
        assert_allclose(y["inverted_singular_value"], np.linalg.svd(N)[1].min(), rtol=1e-9)
        assert y["inverted_singular_value"] > 0


def test_before_the_manoeuvre_the_gimbals_are_turned_and_nothing_else():
    """At an even rate, so that they are there in time; gyros against each other give no torque."""
    before = dict(tau_command_B=[0.1, 3.0, 0.2], start_time=10.0, gimbal_start=[np.pi / 4, 5 * np.pi / 4], **FAR)
    for t, turned in ((0.0, 0.0), (4.0, 0.1 * np.pi)):
        y = Point(STEERING, t=t, gimbal_angle=[turned, np.pi + turned], **before).outputs()
        assert_allclose(y["gimbal_rate_command"], np.pi / 40, rtol=1e-12)
        assert_allclose(y["tau_planned_B"], 0, atol=1e-14)
        assert not y["wheel_acceleration_command"].any()
    late = Point(STEERING, t=9.0, gimbal_angle=[0, np.pi], **before).outputs()
    assert_allclose(late["gimbal_rate_command"], 3.5 / 15)  # the limit holds here too
    command = {n: before[n] for n in ("tau_command_B", "attitude_error")}
    begun, plain = (Point(STEERING, t=10.0, **values).outputs() for values in (before, command))
    assert all(np.array_equal(begun[name], plain[name]) for name in plain)


REFUSALS = {
    "spin axes": ({"spin_axes_B": np.diag([1, 1, 2.0])}, ["spin_axes_B", "2", "unit vector"]),
    "span": ({"spin_axes_B": [[1, 0, 1], [0, 1, 0], [0, 0, 0]]}, ["spin_axes_B", "do not span"]),
    "momentum": ({"rotor_momentum": [15, 0]}, ["rotor_momentum[2] = 0 N.m.s: it must be positive"]),
    "limit": ({"wheel_torque_limit": [0.25, -1, 0.25]}, ["wheel_torque_limit[2] = -1 N.m: it must be positive"]),
    "dead zone": ({"gimbal_dead_zone": -0.1}, ["gimbal_dead_zone = -0.1 rad/s", "must not be negative"]),
    "hand-over": ({"far": 0.0}, ["near = 0.3 deg, far = 0 deg", "far > near"]),
    "trim": ({"trim_wheels": 3}, ["trim_wheels = 3: it must be 0, 1 or 2"]),
    "trim in between": ({"trim_wheels": 0.5}, ["trim_wheels = 0.5: it must be 0, 1 or 2"]),
    "weights": ({"k_0": 1.0}, ["k_0 = 1", "V is positive definite"]),
}


@pytest.mark.parametrize("case", REFUSALS)
def test_refusals(case):
    values, words = REFUSALS[case]
    messages = Point(STEERING, **values).violated()
    assert any(all(word in message for word in words) for message in messages), messages
