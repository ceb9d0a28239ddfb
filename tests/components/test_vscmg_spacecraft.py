"""The VSCMG plant: momentum, energy against the motors' work, what is left without gimbal inertia, refusals."""

import numpy as np
import pytest
from helpers import Monolithic, Point
from numpy.testing import assert_allclose
from published import as_in
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from components.plants.vscmg_spacecraft import VscmgSpacecraft
from cosim.studies.papers.ye2016 import system

RNG = np.random.default_rng(11)
DEVIATION = {
    "rotor_deviation": RNG.uniform(-0.05, 0.05, (3, 4)),
    "transverse_deviation": RNG.uniform(-0.05, 0.05, (3, 4)),
    "spin_deviation": RNG.uniform(-0.05, 0.05, (3, 3)),
}
HEAVY = {"I_cg": 0.8, "I_cs": 1.5, "I_ct": 0.4, "I_cws": 0.1}  # so that every term is of a size
MOVED = {
    "q_BN": Rotation.from_rotvec([0.4, -0.2, 0.9]).as_quat(scalar_first=True),
    "omega_BN_B": [0.05, -0.03, 0.04],
    "gimbal_angle": [0.2, -0.7, 1.9, 3.0],
    "gimbal_rate": [0.1, -0.05, 0.2, 0.02],
    "wheel_speed": [100.0, -80.0, 60.0],
}
COMMANDS = {
    "gimbal_rate_command": [-0.2, 0.15, 0.1, -0.3],
    "rotor_acceleration_command": [0.5, -1.0, 0.3, 2.0],
    "wheel_acceleration_command": [3.0, -5.0, 4.0],
}


def flown(part, time, **inputs):
    """H_N, energy, motor_work and the states in between, at eleven times."""
    whole = type(part)(**(part.given | inputs))
    system, t = Monolithic({"plant": whole}, []), np.linspace(0, time, 11)
    rows = system.solve(t, rtol=1e-12, atol=1e-13)
    return t, system.split(rows) | system.outputs(t, rows)


def test_feedthrough():
    """What a law measures follows from states and h_B: a loop through the plant's own gyros is not algebraic."""
    table = VscmgSpacecraft().direct_feedthrough
    assert table["H_N"] == table["singularity"] == () and table["acceleration_torque_B"] == ("gimbal_rate_command",)
    turning = ("omega_BN_B", "motor_work", "energy", "inertia_torque_B", "gyroscopic_torque_B")
    assert all(table[name] == ("h_B",) for name in turning)


def test_rotors_start_with_their_momentum():
    part = VscmgSpacecraft(rotor_momentum=(8.0, 7.0, 6.0, 5.0), I_cws=0.016)
    assert_allclose(Point(part).states()["rotor_speed"], [500.0, 437.5, 375.0, 312.5])


@pytest.mark.parametrize("deviation", [{}, DEVIATION], ids=["nominal", "deviating"])
def test_momentum_is_constant_without_torque(deviation):
    """To 1e-10 of itself, whatever the motors do."""
    _, run = flown(VscmgSpacecraft(**HEAVY, **MOVED, **deviation), 20.0, **COMMANDS)
    H = run["plant.H_N"]
    assert np.linalg.norm(H - H[0], axis=1).max() < 1e-10 * np.linalg.norm(H[0])
    assert np.abs(run["plant.omega_BN_B"] - run["plant.omega_BN_B"][0]).max() > 0.05


@pytest.mark.parametrize("deviation", [{}, DEVIATION], ids=["nominal", "deviating"])
def test_energy_is_what_the_motors_and_the_torques_do(deviation):
    part = VscmgSpacecraft(**HEAVY, **MOVED, **deviation)
    _, run = flown(part, 20.0, **COMMANDS)
    gained, work = (run[f"plant.{n}"] - run[f"plant.{n}"][0] for n in ("energy", "motor_work"))
    assert np.abs(work).max() > 100.0
    assert_allclose(gained, work, atol=1e-9 * np.abs(run["plant.energy"]).max())
    # with a torque from outside: its power is the rest, at an instant
    tau, h = np.array([0.7, -0.4, 0.9]), 1e-4
    point = Point(part, **MOVED, **COMMANDS, tau_B=tau, tau_dist_B=[0.1, 0.0, -0.2])
    rates, energies, works = point.rates_flat(), [], []
    for sign in (1, -1):
        moved = Point(part, **MOVED)
        moved.x = point.x + sign * h * rates
        energies.append(moved.outputs()["energy"])
        works.append(moved.outputs()["motor_work"])
    outside = np.dot(MOVED["omega_BN_B"], tau + np.array([0.1, 0.0, -0.2]))
    assert_allclose((energies[0] - energies[1] - works[0] + works[1]) / (2 * h), outside, rtol=1e-6)


def test_the_motors_work_is_theirs_when_further_actuators_move_the_body():
    """E' = w . (tau + d - h_B') + motor_work' with a momentum that others store and change; DOP853, h_B as it is."""
    point = Point(VscmgSpacecraft(**HEAVY, **MOVED), **COMMANDS)
    n, at = len(point.x), [v.name for v in point.component.inputs].index("h_B")
    first = sum(v.size for v in point.component.inputs[:at])

    def outputs(t, x):
        point.u[first : first + 3], point.x = [30 * np.sin(t), -20 * np.cos(2 * t), 10 * t], x[:n]
        return point.outputs()

    def rates(t, x):
        w = outputs(t, x)["omega_BN_B"]
        return [*point.rates_flat(), -w @ [30 * np.cos(t), 40 * np.sin(2 * t), 10.0]]

    outputs(0.0, point.x)
    start = np.append(point.initial(), 0.0)
    end = solve_ivp(rates, (0, 10), start, "DOP853", rtol=1e-11, atol=1e-12).y[:, -1]
    before, after = outputs(0.0, start), outputs(10.0, end)
    assert before["motor_work"] == pytest.approx(0, abs=1e-10) and abs(end[-1]) > 0.1
    gained = after["energy"] - before["energy"]
    assert_allclose(after["motor_work"] + end[-1], gained, atol=1e-9 * after["energy"])


def test_the_motors_torque_is_lagranges():
    """Of a gimbal: d/dt dE/d gamma' - dE/d gamma at given w; numerically from the energy alone."""
    part = VscmgSpacecraft(**HEAVY, **DEVIATION)
    point, h = Point(part, **MOVED, **COMMANDS), 1e-5
    now = point.states() | point.outputs()
    names = ("omega_BN_B", "gimbal_angle", "gimbal_rate", "rotor_speed", "wheel_speed")
    at = {name: sum(now[n].size for n in names[:i]) for i, name in enumerate(names)}
    places = np.cumsum([now[n].size for n in names])[:-1]

    def energy(z):
        values = dict(zip(names, np.split(z, places), strict=True))
        momentum = HEAVY["I_cws"] * values.pop("rotor_speed")
        return float(Point(part, rotor_momentum=momentum, **values).outputs()["energy"])

    def slope(x, name, i, step):
        moved = np.zeros_like(x)
        moved[at[name] + i] = step
        return (energy(x + moved) - energy(x - moved)) / (2 * step)

    moving = point.rates() | point.output_rates()
    (z, rates), power = (np.concatenate([of[n] for n in names]) for of in (now, moving)), 0.0
    for rate, angle, count in (("gimbal_rate", "gimbal_angle", 4), ("rotor_speed", "", 4), ("wheel_speed", "", 3)):
        for i in range(count):
            # E is a quadratic of the rates: a wide step is exact, and loses no digits
            pushed = [slope(z + sign * h * rates, rate, i, 1.0) for sign in (1, -1)]
            torque = (pushed[0] - pushed[1]) / (2 * h) - (slope(z, angle, i, 1e-4) if angle else 0)
            power += torque * z[at[rate] + i]
    assert_allclose(moving["motor_work"], power, rtol=1e-5)


@pytest.mark.parametrize("deviation", [{}, DEVIATION], ids=["nominal", "deviating"])
def test_without_gimbal_inertia_it_is_body_and_cluster(deviation):
    """Constant rotor speed, I_cg = I_cs = I_ct = 0: FlexibleSpacecraft with CmgCluster behind the same servo."""
    none = dict.fromkeys(DEVIATION, 0.0)
    numbers = none | {"gimbal_angle": MOVED["gimbal_angle"], "wheel_speed": MOVED["wheel_speed"], **deviation}
    body = {n: MOVED[n] for n in ("q_BN", "omega_BN_B")}
    commands = {n: v for n, v in COMMANDS.items() if "rotor" not in n}
    actuators = as_in("ye2016-adaptive", "actuators")(gimbal_lag=0.1, **numbers, **commands)
    plant = as_in("ye2016-adaptive", "plant")(**body)
    pair = {"actuators": actuators, "plant": plant}
    apart, t = Monolithic(pair, [("actuators.h_B", "plant.h_B")]), np.linspace(0, 20.0, 11)
    rows = apart.solve(t, rtol=1e-12, atol=1e-13)
    expected = apart.split(rows) | apart.outputs(t, rows)
    whole = VscmgSpacecraft(
        J=system.J, rotor_momentum=8.0, wheel_inertia=0.02, I_cg=0, I_cs=0, I_ct=0, gimbal_lag=0.1, **numbers, **body
    )
    _, run = flown(whole, 20.0, **commands)
    for name in ("q_BN", "omega_BN_B", "H_N"):
        assert_allclose(run[f"plant.{name}"], expected[f"plant.{name}"], atol=1e-9, err_msg=name)
    for name in ("gimbal_angle", "wheel_speed"):
        assert_allclose(run[f"plant.{name}"], expected[f"actuators.{name}"], atol=1e-9, err_msg=name)


def test_the_neglected_terms_are_what_the_equation_has_beyond_the_clusters():
    """J w' + w x h + the gyros' and wheels' torques of equation (5) is minus the three outputs."""
    part = VscmgSpacecraft(**HEAVY, **DEVIATION)
    point = Point(part, **MOVED, **COMMANDS)
    x, y = point.states(), point.outputs()
    rates = point.rates() | point.output_rates()
    gamma, turning = x["gimbal_angle"], x["gimbal_rate"]
    p = {v.name: np.asarray(v.start) for v in part.parameters}
    s_0 = p["rotor_axes_B"] + p["rotor_deviation"]
    t_0 = np.cross(p["gimbal_axes_B"].T, p["rotor_axes_B"].T).T + p["transverse_deviation"]
    s, t = s_0 * np.cos(gamma) + t_0 * np.sin(gamma), t_0 * np.cos(gamma) - s_0 * np.sin(gamma)
    a = p["spin_axes_B"] + p["spin_deviation"]

    def inertia(s, t):
        return 1.5 * s @ s.T + 0.4 * t @ t.T

    J = p["J"] + inertia(s, t) - inertia(s_0, t_0)
    w, h, h_w = y["omega_BN_B"], 0.1 * x["rotor_speed"], p["wheel_inertia"] * x["wheel_speed"]
    given = t @ (h * turning) + s @ (0.1 * rates["rotor_speed"]) + a @ (p["wheel_inertia"] * rates["wheel_speed"])
    left = J @ rates["omega_BN_B"] + np.cross(w, J @ w + s @ h + a @ h_w) + given
    missing = y["inertia_torque_B"] + y["acceleration_torque_B"] + y["gyroscopic_torque_B"]
    assert_allclose(left, -missing, rtol=1e-10)
    step = 1e-6  # J' by differences of the inertia along the gimbals' motion
    ahead, behind = ((s + k * step * t * turning, t - k * step * s * turning) for k in (1, -1))
    assert_allclose(y["inertia_torque_B"], (inertia(*ahead) - inertia(*behind)) / (2 * step) @ w, rtol=1e-6)


def test_gyros_alone_and_wheels_alone():
    for structure in ({"gimbals": 0}, {"wheels": 0}, {"gimbals": 7, "wheels": 0}):
        assert Point(VscmgSpacecraft(**structure)).violated() == []
        point = Point(VscmgSpacecraft(**structure), np.random.default_rng(1))
        assert np.isfinite(point.rates_flat()).all()


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"I_cws": (0.02, 0.0, 0.02, 0.02)}, "I_cws[2] = 0 kg.m2: it must be positive"),
        ({"I_cg": -0.01}, "I_cg[1] = -0.01 kg.m2: it must be positive"),
        ({"I_cs": (0.025, 0.025, 0.0, 0.025)}, "I_cs[3] = 0 kg.m2: it must be positive"),
        ({"I_ct": 0.0}, "I_ct[4] = 0 kg.m2: it must be positive"),
        ({"I_cws": 0.03}, "I_cws[1] = 0.03 kg.m2 is above I_cs = 0.025 kg.m2, which is that of gimbal and rotor"),
        ({"I_cg": 200.0}, "J without the gyros is not positive definite (smallest eigenvalue -"),
        ({"gimbal_lag": 0.0}, "gimbal_lag = 0 s: it must be positive"),
        (
            {"gimbal_lag": 1e-4, "solver.step": 1e-3},
            "gimbal_lag = 0.0001 s: it must be at least half the internal step, solver.step = 0.001",
        ),
        ({"rotor_momentum": (8.0, 8.0, 0.0, 8.0)}, "rotor_momentum[3] = 0 N.m.s: it must be positive"),
        ({"wheel_inertia": -0.02}, "wheel_inertia[1] = -0.02 kg.m2: it must be positive"),
        ({"spin_deviation": [[0, 0, 0], [0, -1, 0], [0, 0, 0]]}, "spin_deviation leaves wheel 2 no spin axis"),
        ({"J": -np.eye(3)}, "J is not positive definite"),
    ],
)
def test_refusals(values, message):
    assert any(message in text for text in Point(VscmgSpacecraft(**values)).violated())
