"""li2014 flown from native FMUs: every figure of its table, its spectral densities, its verdicts, its figures."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from cosim import simulate
from cosim.masters.explicit import Explicit
from cosim.studies.papers import PAPERS, scenario
from cosim.studies.papers.claims import judge
from cosim.studies.papers.li2014 import spectrum, system
from cosim.system import Experiment, System

from ..figures import cut_off

ZERO = [0.0, 0.0, 0.0]
INPUTS = ("f_command_S", "tau_command_S", "tau_command_T", "f_dist_S", "tau_dist_S")


def fly(name, changed=None, locate=None, **changes):
    flight, experiment = scenario(name)
    flight = replace(flight, parameters=flight.parameters | (changed or {}))
    return simulate(flight, replace(experiment, **changes), locate=locate)


@pytest.fixture(scope="module")
def runs():
    return {name: fly(name) for name in PAPERS["li2014"].experiments}


def alone(stop, every=1, **values):
    """The paper's plant without gravity, commands and disturbances, at rest, no damping; steps of 1 s."""
    paper, _ = scenario(system.NN)
    quiet = dict(mu=0.0, D=0.0, D_r=0.0, r_N=ZERO, v_N=ZERO, q_SN=[1.0, 0, 0, 0]) | {"solver.step": 1.0} | values
    parameters = {port: value for port, value in paper.parameters.items() if port.startswith("plant.")}
    parameters |= {"plant.J": paper.vehicle["J"]} | {f"plant.{name}": value for name, value in quiet.items()}
    held = {f"plant.{name}": ZERO for name in INPUTS}
    flight = System(name="alone", components={"plant": "DragFreeSatellite"}, parameters=parameters, held=held)
    return simulate(flight, Experiment(stop_time=stop, communication_step_size=1.0, every=every))


@pytest.mark.slow
class TestTable:
    """The rows of 'Figures that a correct implementation shows', tolerances as given there."""

    def test_first_commands(self, runs):
        assert_allclose(runs[system.NN]["controller.f_command_S"][0, 0], 2.09999895, rtol=1e-7)
        assert_allclose(runs[system.NN]["controller.tau_command_T"][0, 0], -1.39643619e-5, rtol=1e-6)

    @pytest.mark.parametrize(
        ("name", "expected"),
        [
            (system.NN, 2.37e-9),
            (system.NO_NN, 3.38e-6),
            (system.NN_LVLH, 3.46e-10),
            (system.NO_NN_LVLH, 3.84e-6),
        ],
    )
    def test_tail_of_the_relative_position(self, runs, name, expected):
        assert_allclose(spectrum.tail(runs[name], runs[name]["plant.r_rel"]), expected, rtol=0.05)

    def test_tail_with_ten_times_gamma(self, runs):
        run = runs[system.GAMMA_10]
        assert_allclose(spectrum.tail(run, run["plant.r_rel"]), 2.37e-8, rtol=0.05)

    def test_tail_of_the_attitudes(self, runs):
        for name, expected in ((system.NN, 7.8e-10), (system.NO_NN, 1.7e-6)):
            for angles in (spectrum.attitude, spectrum.relative_attitude):
                assert_allclose(spectrum.tail(runs[name], angles(runs[name])), expected, rtol=0.05)

    def test_conservation(self):
        run = alone(20000.0, 10)
        mass = 1050.0 * 1.0 / 1051.0
        speed = np.linalg.norm(run["plant.v_rel"], axis=1).max()
        drift = 1050.0 * run["plant.v_N"] + (run["plant.v_N"] + _inertial_velocity(run))
        assert np.abs(drift - drift[0]).max() < 1e-11 * mass * speed
        H = run["plant.H_N"]
        largest = 2.667e-4 * np.linalg.norm(run["plant.omega_TS_T"], axis=1).max()
        assert np.abs(H - H[0]).max() < 1e-11 * largest
        energy = run["plant.energy"]
        assert np.abs(energy - energy[0]).max() < 1e-11 * energy.max()

    def test_translational_frequency(self):
        run = alone(8000.0, r_h=ZERO, r_rel=[1e-3, 0.0, 0.0], q_TS=[1.0, 0, 0, 0])
        x, v = run["plant.r_rel"][:, 0], run["plant.v_rel"][:, 0]
        zeros = []
        for k in np.flatnonzero(np.diff(np.sign(x))):  # the cubic through both ends and their slopes
            a, b, da, db = x[k], x[k + 1], v[k], v[k + 1]
            c2, c3 = 3 * (b - a) - 2 * da - db, 2 * (a - b) + da + db
            root = brentq(lambda s, a=a, da=da, c2=c2, c3=c3: a + s * (da + s * (c2 + s * c3)), 0, 1, xtol=1e-15)
            zeros.append(run.time[k] + root)
        assert_allclose(np.pi / (zeros[1] - zeros[0]), 1.0004761e-3, rtol=1e-7)


def _inertial_velocity(run):
    """Velocity of the test mass relative to the satellite, inertial axes."""
    rho = np.array(system.CAGE) + run["plant.r_rel"]
    turned = spectrum.rotations(run["plant.q_SN"])
    return turned.apply(run["plant.v_rel"] + np.cross(run["plant.omega_SN_S"], rho))


@pytest.mark.slow
class TestWhatHolds:
    def test_verdicts(self, runs):
        found = judge(PAPERS["li2014"].claims, runs)
        assert [v.word for v in found if not v.beyond] == [
            "reproduced",
            "reproduced",
            "in one reading (design model)",
            "partly",
        ]
        assert [v.word for v in found if v.beyond] == ["not reproduced", "reproduced", "reproduced", "partly"]
        assert found[2].failing == "full equations: 0.1 Hz"
        assert {part.partition(": ")[2] for part, good in found[3].holds.items() if not good} == {"negative definite"}

    def test_spectral_densities(self, runs):
        """The file's figures are of other phases of the gusts: within 15 %."""
        table = {system.NN_SPECTRUM: 1.45e-14, system.NO_NN_SPECTRUM: 2.98e-13, system.ACTUATORS: 1.1e-13}
        for name, expected in table.items():
            assert_allclose(spectrum.highest(spectrum.residual_density(runs[name])), expected, rtol=0.15)
        assert_allclose(spectrum.highest(spectrum.drag_density(runs[system.NN_SPECTRUM])), 6.0e-7, rtol=0.05)

    def test_the_network_acts_as_an_integrator(self, runs):
        """1.4e3 times in the tail, 50 at 5 mHz, 3 at 0.1 Hz."""
        on, off = (runs[name] for name in (system.NN, system.NO_NN))
        tails = [spectrum.tail(run, spectrum.relative_position(run)) for run in (off, on)]
        assert_allclose(tails[0] / tails[1], 1.4e3, rtol=0.05)
        (f, without), (_, with_network) = (
            spectrum.residual_density(runs[n]) for n in (system.NO_NN_SPECTRUM, system.NN_SPECTRUM)
        )
        gain = without[:, 0] / np.maximum(with_network[:, 0], 1e-300)
        for at, expected in ((5e-3, 50), (0.1, 3)):
            assert_allclose(np.median(gain[np.abs(f - at) <= 0.1 * at]), expected, rtol=0.1)

    def test_attitudes_in_the_tail(self, runs):
        """7.8e-10 rad each; 1.7e-6 without the network."""
        for name, expected in ((system.NN, 7.8e-10), (system.NO_NN, 1.7e-6)):
            for angles in (spectrum.attitude, spectrum.relative_attitude):
                assert_allclose(spectrum.tail(runs[name], angles(runs[name])), expected, rtol=0.03)

    def test_the_test_mass_reaches_its_cage(self, runs):
        """At 41.1 s with an ion thruster that starts from nothing; here it starts from its least force, 1 mN."""
        run = runs[system.PRINTED_START]
        assert run.info["status"] == "finished"
        assert spectrum.contact(run) == pytest.approx(41.0, abs=0.6)
        assert run.info["event"]["time"] == run.time[-1] == pytest.approx(spectrum.contact(run), abs=0.1)
        assert_allclose(np.abs(run["plant.r_rel"][-1]).max(), 4e-3, rtol=1e-3)
        for name in {n for n in runs if "design-model" not in n} - {system.PRINTED_START}:
            assert spectrum.contact(runs[name]) is None

    def test_figures(self, runs):
        drawn = PAPERS["li2014"].draw(runs)
        assert all(cut_off(figure) == [] for figure in drawn.values())
        assert set(drawn) == {
            "fig01_relative_position",
            "fig02_attitude",
            "fig03_relative_attitude",
            "commands",
            "variants",
            "lyapunov",
            "printed_start_with_limits",
            "actuators",
            "residual_acceleration",
        }


@pytest.mark.slow
class TestDesignModel:
    """The flights on (7) to (9): what theory says of them, in the test's own words."""

    def test_first_commands_are_those_of_the_full_equations(self, runs):
        for name in (system.DESIGN, system.DESIGN_CONSISTENT, system.DESIGN_GAMMA):
            assert_allclose(runs[name]["controller.f_command_S"][0, 0], 2.09999895, rtol=1e-7)
            assert_allclose(runs[name]["controller.tau_command_T"][0, 0], -1.39643619e-5, rtol=1e-6)

    @pytest.mark.parametrize("name", [system.DESIGN, system.DESIGN_PRINTED, system.DESIGN_CONSISTENT])
    def test_networks_leave_nothing(self, runs, name):
        """An error that is some rounding of its start."""
        for angles, start in zip(MOTIONS, (1e-3, np.radians(0.5), np.radians(1.0)), strict=True):
            assert spectrum.tail(runs[name], angles(runs[name])) < 4 * np.finfo(float).eps * start

    def test_without_networks_the_law_is_a_spring(self, runs):
        """It stays where (lambda + k1 k2) x1 = f(x1); 3.11e-6 m, 1.6e-6 rad."""
        for angles, f, scale in zip(MOTIONS, unknown_at_rest(), (1e-3, 2e-2, 2e-2), strict=True):
            x = f / 2
            for _ in range(20):
                x = f * sum(np.exp(-2 * (x / scale - c) ** 2) for c in LINE) / sum(np.exp(-2 * c**2) for c in LINE) / 2
            assert_allclose(angles(runs[system.DESIGN_NO_NN])[-1], x, rtol=1e-6)

    def test_networks_are_integrators(self, runs):
        """With Gamma = 10: the slow pole of s (s^2 + (2 + d) s + 2 + k) + |h(0)|^2 / Gamma (s + 1).

        k and d are slopes of what the network has learnt on its way, W^T dh/dx: 2 % of the pole.
        """
        run = runs[system.DESIGN_GAMMA]
        h = np.exp(-2 * (CENTRES**2).sum(axis=1))
        k, d = run["controller.W_1"].reshape(-1, 3, 25)[-1, 0] @ (4 * CENTRES * h[:, None]) / 1e-3
        gain = h @ h / 10
        pole = max(np.roots([1, 2 + d, 2 + k + gain, gain]), key=lambda root: root.real).real
        x = np.abs(spectrum.relative_position(run)[:, 0])
        at = [int(np.argmin(np.abs(run.time - t))) for t in (60.0, 100.0)]
        assert_allclose(np.log(x[at[1]] / x[at[0]]) / 40.0, pole, rtol=5e-3)

    def test_printed_signs(self, runs):
        """In the law alone they move the test mass by 2e-8 rad, as the file says; in plant and law they cancel."""
        angles = {n: spectrum.relative_attitude(runs[n]) for n in (system.PRINTED, system.NN)}
        assert_allclose(np.abs(angles[system.PRINTED] - angles[system.NN]).max(), 2e-8, rtol=0.05)
        both = [runs[n]["plant.phi_TS"] for n in (system.DESIGN_PRINTED, system.DESIGN)]
        assert np.abs(both[0] - both[1]).max() < 1e-10

    def test_against_an_outside_closed_loop(self):
        """(7) to (9) with (21), (22), (33), (34), (44), (45): slopes make an error of second order."""
        h = (8e-3, 4e-3, 2e-3)
        runs = [fly(system.DESIGN, stop_time=8.0, communication_step_size=step, every=round(0.2 / step)) for step in h]
        reference = closed_loop(runs[0].time)
        found = [np.stack([angles(run) for angles in MOTIONS], axis=1) for run in runs]
        size = np.abs(reference).max(axis=(0, 2), keepdims=True)
        errors = [np.abs((rows - reference) / size).max() for rows in found]
        assert_allclose(np.diff(np.log2(errors)), -2.0, atol=0.05)
        assert errors[-1] < 1e-6


LINE = (-1.0, -0.5, 0.0, 0.5, 1.0)
MOTIONS = (spectrum.relative_position, spectrum.attitude, spectrum.relative_attitude)
CENTRES = np.array([(a, b) for a in LINE for b in LINE])


def unknown_at_rest():
    """f_1, f_2, f_3 at zero error: 7 mN against the velocity of the circle, at its lever arm."""
    v = np.array(scenario(system.NN)[0].parameters["plant.v_N"].value)
    force = -7e-3 * v / np.linalg.norm(v)
    torque = np.cross([0.10, 0.02, -0.01], force)
    return -force / 1050, torque / 200, -torque / 200


def closed_loop(time):
    """x1 of the three loops, three axes each, by DOP853; states [loop, axis, x1, x2 and 25 weights]."""
    nodes_0 = np.exp(-2 * (CENTRES**2).sum(axis=1)).sum()
    scale, at_rest = np.array([1e-3, 2e-2, 2e-2])[:, None], np.array(unknown_at_rest())
    a, b = np.array([[1e-6, 0, 1e-9 / 2.667e-4], [1.4e-11, 0, 3.3e-14 / 2.667e-4]])[..., None] * -1

    def rates(t, s):
        x1, x2, W = (part.squeeze() for part in np.split(s.reshape(3, 3, 27), [1, 2], axis=2))
        x = np.stack([x1, x2], axis=-1) / scale[..., None]
        h = np.exp(-2 * ((x[:, :, None] - CENTRES) ** 2).sum(axis=-1))
        f = at_rest * h.sum(axis=-1) / nodes_0
        z = x2 + x1
        wanted = -x1 - a * x1 - b * x2 - (W * h).sum(axis=-1) - x2 - z  # c u, without feed-forward
        moved = wanted[1]
        wanted[2] += moved
        acceleration = a * x1 + b * x2 + wanted + f
        acceleration[2] -= moved
        return np.concatenate([x2[..., None], acceleration[..., None], h * z[..., None]], axis=2).ravel()

    start = np.zeros((3, 3, 27))
    start[:, :, 0] = [[1e-3, -5e-4, 8e-4], np.radians([0.5, -0.3, 0.4]), np.radians([1.0, -0.5, 0.8])]
    rows = solve_ivp(rates, (0, time[-1]), start.ravel(), "DOP853", t_eval=time, rtol=1e-10, atol=1e-13).y.T
    return rows.reshape(-1, 3, 3, 27)[..., 0]


@pytest.mark.parametrize(
    ("master", "order", "far", "turned"),
    [
        (Explicit(), 1, 0.95 * 2.7e-6, [0.95 * 3.4e-5, 0.95 * 5.1e-5]),  # less those of 0.5 ms
        (system.SLOPES, 2, 1.27e-8, [1.39e-7, 2.24e-7]),
    ],
    ids=["held", "slopes"],
)
def test_order_of_the_exchange(master, order, far, turned):
    """Against steps of 0.5 ms, over 60 s: errors of r_rel (m) and of both attitudes (rad) at 10 ms, and their order."""
    near = fly(system.NN, stop_time=60.0, communication_step_size=5e-4, every=200, master=master)
    errors = []
    for h in (2e-2, 1e-2, 5e-3):
        run = fly(system.NN, stop_time=60.0, communication_step_size=h, every=round(0.1 / h), master=master)
        angles = (spectrum.attitude, spectrum.relative_attitude)
        errors.append(
            [np.abs(run["plant.r_rel"] - near["plant.r_rel"]).max()]
            + [np.abs(angle(run) - angle(near)).max() for angle in angles]
        )
    assert_allclose(errors[1], [far, *turned], rtol=0.03)
    assert_allclose(np.diff(np.log2([r[0] for r in errors])), -order, atol=0.15)


def test_kernel_and_python_loop_are_equal():
    short = dict(stop_time=3.0, every=1)
    a, b = (fly(system.ACTUATORS, master=Explicit(kernel=k), **short) for k in ("always", "never"))
    assert all(np.asarray(a.table[c]).tobytes() == np.asarray(b.table[c]).tobytes() for c in a.table.column_names)
