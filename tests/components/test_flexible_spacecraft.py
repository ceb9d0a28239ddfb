"""The flexible spacecraft: conservation laws, closed forms, limits, refusals."""

import numpy as np
import pytest
from helpers import Point, numbers, split
from numpy.testing import assert_allclose
from published import as_in
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

FlexibleSpacecraft = as_in("zhang2018-ppatc", "plant")


PLANT = FlexibleSpacecraft()
RNG = np.random.default_rng(7)
TUMBLING = dict(
    q_BN=Rotation.from_euler("XYZ", [0.4, -0.3, 0.8]).as_quat(scalar_first=True),
    omega_BN_B=[0.03, -0.02, 0.04],
    eta=0.02 * RNG.uniform(-1, 1, 8),
    eta_dot=0.02 * RNG.uniform(-1, 1, 8),
)
J = np.array([[120.0, 5.0, -3.0], [5.0, 90.0, 4.0], [-3.0, 4.0, 150.0]])


def test_feedthrough():
    """What is stored turns the body at once; the total momentum is a state."""
    moved = dict.fromkeys(("omega_BN_B", "eta_dot", "energy"), ("h_B",))
    assert FlexibleSpacecraft().direct_feedthrough == {"H_N": ()} | moved


def rows(point: Point, columns: np.ndarray) -> tuple[dict, dict]:
    """States and outputs of the columns of states, by name."""
    f, n = point.functions, columns.shape[1]
    y = f.outputs.map(n)(point.t, columns, point.u, point.p, point.c, point.m).full().T
    return split(point.component.states, columns.T), split(point.component.outputs_declared, y)


def stored(t: float) -> tuple[np.ndarray, np.ndarray]:
    """A momentum that actuators could have, and its rate: some newton metres."""
    phase = np.array([0.9, 1.7, 2.6]) * t + np.array([0.3, 1.1, 2.0])
    size, turns = np.array([3.0, -2.0, 4.0]), np.array([0.9, 1.7, 2.6])
    return size * np.sin(phase), size * turns * np.cos(phase)


def test_total_momenta_are_the_equations_of_rates():
    """Against (1) and (2) with their mass matrix, in w, eta', and -h_B' as a torque, on DOP853.

    The difference of two integrations at a relative tolerance of 1e-12 over 10 s; measured 1e-13 of the largest rates.
    """
    point = Point(PLANT, tau_B=[0.3, -0.2, 0.1], **TUMBLING)
    p, n, torque = split(PLANT.parameters, point.p), 8, np.array([0.3, -0.2, 0.1])
    mass = np.block([[p["J"], p["delta"].T], [p["delta"], np.eye(n)]])
    Omega, zeta = p["Omega"], p["zeta"]

    def rates(t, x):
        attitude, w, eta, eta_dot = np.split(x, [4, 7, 7 + n])
        h, h_dot = stored(t)
        turning = np.cross(w, p["J"] @ w + p["delta"].T @ eta_dot + h)
        force = np.concatenate([torque - h_dot - turning, -2 * zeta * Omega * eta_dot - Omega**2 * eta])
        scalar, vector = attitude[0], attitude[1:]
        turned = 0.5 * np.concatenate([[-vector @ w], scalar * w + np.cross(vector, w)])
        accelerations = np.linalg.solve(mass, force)
        return np.concatenate([turned, accelerations[:3], eta_dot, accelerations[3:]])

    def of_component(t, x):
        point.u[3:6] = stored(t)[0]
        return numbers(point.functions.rates(t, x, point.u, point.p, point.c))

    assert [v.name for v in PLANT.inputs][:2] == ["tau_B", "h_B"]
    point.u[3:6] = stored(0.0)[0]
    point.x = point.initial()
    times, exact = np.linspace(0, 10, 5), dict(method="DOP853", rtol=1e-12, atol=1e-14)
    start = np.concatenate([np.ravel(TUMBLING[name]) for name in ("q_BN", "omega_BN_B", "eta", "eta_dot")])
    expected = solve_ivp(rates, (0, 10), start, t_eval=times, **exact).y.T
    found = solve_ivp(of_component, (0, 10), point.x, t_eval=times, **exact).y
    for k, t in enumerate(times):
        point.u[3:6] = stored(t)[0]
        states, outputs = (part for part in rows(point, found[:, [k]]))
        flown = [states["q_BN"][0], outputs["omega_BN_B"][0], states["eta"][0], outputs["eta_dot"][0]]
        assert_allclose(np.concatenate(flown), expected[k], atol=1e-11)


def test_momentum_is_kept_whatever_curve_is_made_of_what_is_stored():
    """h_B jumps at every step, as a master without interpolation has it: H_N stays, to the rounding of 2000 steps."""
    point, jumps = Point(PLANT, **TUMBLING), np.random.default_rng(8).uniform(-2, 2, (2000, 3))
    start = point.outputs()["H_N"]
    for jump in jumps:
        point.u[3:6] = jump
        point.x = point.advance(1e-3)[:, 0]
    assert np.linalg.norm(point.outputs()["H_N"] - start) < 1e-13 * np.linalg.norm(start) * np.sqrt(len(jumps))


@pytest.fixture(scope="module")
def flight():
    """200 s without torque from a tumble, with momentum stored, in internal steps of 1 ms: a row every 0.1 s."""
    point = Point(FlexibleSpacecraft(), h_B=[3.0, -1.0, 2.0], **TUMBLING)
    return rows(point, point.advance(1e-3, 200_000)[:, ::100])


def test_total_momentum_is_constant(flight):
    H = flight[1]["H_N"]
    assert np.abs(H - H[0]).max() < 1e-10 * np.linalg.norm(H[0])


def test_quaternion_stays_a_unit_quaternion(flight):
    assert np.abs(np.linalg.norm(flight[0]["q_BN"], axis=1) - 1).max() < 1e-12


def test_damping_only_takes_energy(flight):
    energy = flight[1]["energy"]
    assert (np.diff(energy) <= 1e-15).all()
    assert energy[-1] < energy[0]


def flow(point: Point, time: float, rtol: float = 1e-12, count: int = 101):
    """Integrate the derivatives by scipy, inputs held: times and states as columns."""

    def rates(_, x):
        return numbers(point.functions.rates(0.0, x, point.u, point.p, point.c))

    solution = solve_ivp(rates, (0, time), point.x, "DOP853", np.linspace(0, time, count), rtol=rtol, atol=1e-15)
    return solution.t, solution.y


def test_energy_is_constant_without_damping():
    point = Point(FlexibleSpacecraft(), zeta=np.zeros(8), **TUMBLING)
    energy = rows(point, flow(point, 20.0)[1])[1]["energy"]
    assert_allclose(energy, energy[0], rtol=1e-10)


def test_energy_changes_by_power_and_damping():
    for _ in range(5):
        point = Point(FlexibleSpacecraft(), RNG, 0.3, J=J + 300 * np.eye(3))
        u, y, p = split(PLANT.inputs, point.u), point.outputs(), split(PLANT.parameters, point.p)
        power = y["omega_BN_B"] @ (u["tau_B"] + u["tau_dist_B"])
        lost = np.sum(2 * p["zeta"] * p["Omega"] * y["eta_dot"] ** 2)
        assert_allclose(point.output_rates()["energy"], power - lost, rtol=1e-11)


def test_total_momentum_changes_by_the_torque():
    """dH_N/dt = R (tau + d): the torque in inertial axes, whatever the modes do."""
    point = Point(FlexibleSpacecraft(), RNG, 0.3, q_BN=TUMBLING["q_BN"])
    u = split(PLANT.inputs, point.u)
    torque = Rotation.from_quat(TUMBLING["q_BN"], scalar_first=True).apply(u["tau_B"] + u["tau_dist_B"])
    assert_allclose(point.output_rates()["H_N"], torque, rtol=1e-11)


def test_symmetric_body_against_the_closed_form():
    """Torque-free body with J = diag(A, A, C): precession about H at |H| / A, spin about z at (A - C) / A omega_z."""
    A, C, omega, time = 100.0, 160.0, np.array([0.05, -0.02, 0.3]), 60.0
    start = Rotation.from_euler("XYZ", [0.4, -0.3, 0.8])
    plant = FlexibleSpacecraft(modes=0, J=np.diag([A, A, C]), omega_BN_B=omega, q_BN=start.as_quat(scalar_first=True))
    point = Point(plant)
    t, x = flow(point, time, 1e-13)
    states, outputs = rows(point, x)
    H = start.apply([A * omega[0], A * omega[1], C * omega[2]])
    spin = Rotation.from_rotvec(np.outer(t, [0, 0, (A - C) / A * omega[2]]))
    expected = Rotation.from_rotvec(np.outer(t, H / A)) * start * spin
    found = Rotation.from_quat(states["q_BN"], scalar_first=True)
    assert (expected.inv() * found).magnitude().max() < 1e-10
    rate = (C - A) / A * omega[2]
    assert_allclose(outputs["omega_BN_B"][:, 0], omega[0] * np.cos(rate * t) - omega[1] * np.sin(rate * t), atol=1e-11)


AT_REST = dict(q_BN=[1, 0, 0, 0], omega_BN_B=[0, 0, 0])


def poles(plant: FlexibleSpacecraft) -> np.ndarray:
    """Oscillating poles, those with a positive imaginary part, of the linearised plant at rest."""
    a, _ = plant.linearise(Point(plant, **AT_REST).x)
    values = np.linalg.eigvals(a)
    return values[values.imag > 1e-3]


def test_free_frequencies_and_damping_of_the_paper():
    found = poles(FlexibleSpacecraft())
    frequency = np.abs(found) / (2 * np.pi)
    free = [0.38534, 1.05350, 1.33163, 2.22827]  # zhang2018: both panels against the hub
    clamped = [0.379, 1.042, 1.331, 2.226]  # both panels in step: the hub does not move
    assert_allclose(np.sort(frequency), np.sort(free + clamped), atol=1e-4)
    first = found[np.argmin(np.abs(frequency - free[0]))]
    assert_allclose(-first.real / abs(first), 0.00508, atol=1e-4)


def test_one_mode_against_the_closed_form():
    coupling = np.array([[3.0, -2.0, 4.0]])
    plant = FlexibleSpacecraft(modes=1, J=J, delta=coupling, Omega=[2.5], zeta=[0.0])
    (pole,) = poles(plant)
    assert_allclose(abs(pole), 2.5 / np.sqrt(1 - (coupling @ np.linalg.solve(J, coupling.T))[0, 0]), rtol=1e-10)


def test_panels_move_against_each_other():
    """Equal panels on opposite sides, both at rest: eta of panel 2 = -eta of panel 1 for every torque."""
    point = Point(FlexibleSpacecraft(), tau_B=[0.6, -0.5, 0.2], tau_dist_B=[0.01, 0.02, -0.03])
    eta = rows(point, point.advance(1e-3, 20_000))[0]["eta"]
    assert np.abs(eta).max() > 1e-4
    assert np.abs(eta[:, :4] + eta[:, 4:]).max() < 1e-12


def test_stiff_modes_are_a_rigid_body():
    """The difference from the rigid body falls at least as 1 / Omega."""
    torque, time = [0.5, -0.3, 0.4], 4.0

    def flown(point, rtol):
        states, outputs = rows(point, flow(point, time, rtol)[1])
        return np.hstack([states["q_BN"], outputs["omega_BN_B"]])

    rigid = flown(Point(FlexibleSpacecraft(modes=0), tau_B=torque), 1e-12)
    differences = []
    for factor in (10.0, 20.0, 40.0):
        plant = FlexibleSpacecraft(zeta=0.5)
        stiff = Point(plant, Omega=factor * plant.parameters[2].start, tau_B=torque)
        differences.append(np.abs(flown(stiff, 1e-10) - rigid).max())
    assert differences[0] < 1e-4
    assert differences[1] < differences[0] / 1.9
    assert differences[2] < differences[1] / 1.9


def test_without_modes_it_is_the_rigid_body():
    plant = FlexibleSpacecraft(modes=0, J=J)
    omega, h, torque = np.array([0.03, -0.2, 0.1]), np.array([1.0, 2.0, -3.0]), np.array([0.5, 0.1, -0.2])
    point = Point(plant, omega_BN_B=omega, h_B=h, tau_B=torque)
    expected = np.linalg.solve(J, torque - np.cross(omega, J @ omega + h))  # Euler's equation
    assert_allclose(point.output_rates()["omega_BN_B"], expected, rtol=1e-12)
    assert_allclose(point.outputs()["energy"], omega @ J @ omega / 2, rtol=1e-14)
    assert point.violated() == []
    assert [v.name for v in plant.states if v.size] == ["q_BN", "L_B"]


@pytest.mark.parametrize("modes", [1, 3, 8, 11])
def test_start_values_for_any_number_of_modes(modes):
    """The modes of the one vehicle of the start values: each couples with one axis, in turn, and is the faster."""
    plant = FlexibleSpacecraft(modes=modes)
    delta, Omega = (next(v.start for v in plant.parameters if v.name == n) for n in ("delta", "Omega"))
    assert delta.shape == (modes, 3)
    assert_allclose(np.argmax(delta, axis=1), np.arange(modes) % 3)
    assert (np.count_nonzero(delta, axis=1) == 1).all() and (np.diff(Omega, prepend=0) > 0).all()
    assert Point(plant).violated() == []


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"J": J + np.eye(3, k=1) * [[1], [0], [0]]}, ["J is not symmetric", "differ by 1 kg.m2"]),
        ({"J": np.diag([100.0, -5.0, 100.0])}, ["J is not positive definite", "smallest eigenvalue -5 kg.m2"]),
        (
            {"J": np.diag([10.0, 300.0, 300.0])},
            ["J - delta^T delta is not positive definite", "-4.5", "more inertia than J"],
        ),
        ({"Omega": [1, 2, 3, 4, 5, 6, 7, -8]}, ["Omega[8] = -8 rad/s: it must not be negative"]),
        ({"zeta": [-0.01] + 7 * [0]}, ["zeta[1] = -0.01: it must not be negative"]),
        ({"q_BN": [1.0, 0.0, 0.0, 0.1]}, ["q_BN has norm 1.00499", "unit quaternion"]),
    ],
    ids=["asymmetric", "J", "hub", "Omega", "zeta", "q_BN"],
)
def test_refusals(values, words):
    messages = Point(FlexibleSpacecraft(), **values).violated()
    assert any(all(word in message for word in words) for message in messages), messages


@pytest.mark.parametrize("turn", [[0, 0, 0], [0.3, -0.8, 0.5]])
def test_inertia_of_no_body_is_refused_in_any_axes(turn):
    """A plate has the largest moment that there can be, the sum of the others; more has nothing."""
    C = Rotation.from_rotvec(turn).as_matrix()

    def messages(largest):
        return Point(FlexibleSpacecraft(modes=0), J=C @ np.diag([100.0, 50.0, largest]) @ C.T).violated()

    assert messages(150.0) == []
    assert messages(160.0) == [
        "J breaks the triangle inequality: its largest principal moment 160 kg.m2 is more than the sum 150 kg.m2 of "
        "the others. Check its diagonal."
    ]


def test_no_inertia_is_said_in_one_message():
    """It is symmetric, its moments are no triangle's fault, and without modes there is nothing that they could hold."""
    (message,) = Point(FlexibleSpacecraft(modes=0), J=np.zeros((3, 3))).violated()
    assert message == "J is not positive definite (smallest eigenvalue 0 kg.m2). Check its diagonal."


def test_undamped_and_fixed_modes_are_allowed():
    assert Point(FlexibleSpacecraft(), zeta=np.zeros(8), Omega=np.zeros(8)).violated() == []
