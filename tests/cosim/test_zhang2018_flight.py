"""zhang2018 flown from native FMUs: every figure of its table, and the approach to the solution as one ODE."""

from dataclasses import replace

import numpy as np
import pytest
from helpers import monolithic
from numpy.testing import assert_allclose
from zhang2018_loop import CONNECTIONS, loop

from components.controllers.adaptive_tracking import AdaptiveTracking
from components.controllers.prescribed_performance import PrescribedPerformance
from cosim.masters.explicit import Explicit
from cosim.papers import scenario
from cosim.simulate import simulate


def fly(name: str, **changes):
    system, experiment = scenario(name)
    return simulate(system, replace(experiment, **changes))


@pytest.fixture(scope="module")
def ppatc():
    return fly("zhang2018-ppatc")


@pytest.fixture(scope="module")
def atc():
    return fly("zhang2018-atc")


def late(run):
    return run.time >= 100.0


def degrees(run):
    return np.degrees(run["controller.e"])


class TestTable:
    """The rows of 'Figures that a correct implementation shows', tolerances as given there."""

    def test_torque_at_the_start(self, ppatc):
        assert_allclose(ppatc["controller.tau_command_B"][0], [-0.656759, 0.546986, 0.199056], atol=1e-5)

    def test_filtered_and_transformed_error_at_the_start(self, ppatc):
        assert_allclose(ppatc["controller.s"][0], [0.183090, -0.4525, -0.039572], atol=1e-6)
        assert_allclose(ppatc["controller.epsilon"][0], [0.804719, 0, -0.346574], atol=1e-6)

    def test_steady_error_of_ppatc(self, ppatc):
        assert_allclose(degrees(ppatc)[late(ppatc)].mean(axis=0), [0.0025, 0.0025, -0.0025], atol=3e-5)

    def test_the_barrier_is_never_touched(self, ppatc):
        assert ppatc["controller.barrier_hits"].max() == 0
        assert ppatc["controller.barrier_time"][-1] == 0
        assert_allclose(ppatc["controller.z"][:, 1].min(), 0.400, atol=0.003)

    def test_pitch_undershoot_of_atc(self, atc):
        pitch = degrees(atc)[:, 1]
        assert_allclose(pitch.min(), -0.0433, atol=0.0005)
        assert_allclose(atc.time[pitch.argmin()], 4.9, atol=0.1)

    def test_the_panels_move_against_each_other(self, ppatc, atc):
        for run in (ppatc, atc):
            assert np.abs(run["plant.eta"][:, :4] + run["plant.eta"][:, 4:]).max() < 1e-12

    def test_estimated_bound(self, ppatc, atc):
        assert_allclose(ppatc["controller.mu_hat"][-1], 0.052255, atol=1e-5)
        assert_allclose(atc["controller.mu_hat"][-1], 0.038704, atol=1e-5)

    def test_steady_error_of_atc(self, atc):
        assert_allclose(np.abs(degrees(atc)[late(atc)]).max(axis=0), [7.52e-5, 5.68e-5, 4.88e-5], atol=2e-6)


class TestApproach:
    """The FMUs at steps of h against plant, controller, guidance and disturbance as one ODE (DOP853, rtol 1e-10)."""

    STOP = 60.0  # past 47-50 s, where the gain is largest: 570 1/s

    @pytest.mark.parametrize("master", [Explicit(), Explicit(centred=True)], ids=["held", "centred"])
    @pytest.mark.parametrize(
        ("name", "law"),
        [("zhang2018-ppatc", PrescribedPerformance), ("zhang2018-atc", AdaptiveTracking)],
        ids=["ppatc", "atc"],
    )
    def test_the_attitude_error_approaches_it_with_slope_1(self, name, law, master):
        rows = np.linspace(0.0, self.STOP, 601)
        _, _, y = monolithic(loop(law()), CONNECTIONS, self.STOP, rows)
        steps = np.array([2e-3, 1e-3, 5e-4])
        distance = []
        for h in steps:
            run = fly(name, stop_time=self.STOP, communication_step_size=float(h), every=round(0.1 / h), master=master)
            distance.append(np.abs(np.degrees(run["controller.e"] - y["controller.e"])).max())
        assert distance[1] < 1e-5
        slopes = np.diff(np.log(distance)) / np.diff(np.log(steps))
        assert_allclose(slopes, 1.0, atol=0.05)


@pytest.mark.parametrize("name", ["zhang2018-ppatc", "zhang2018-atc"])
def test_a_pitch_of_90_degrees_is_reported_and_the_run_goes_on(name):
    """The body turns through the singularity of Euler angles 1-2-3: the controller says where, finite to the end."""
    system, experiment = scenario(name)
    start = {
        "plant.q_BN": [np.cos(np.radians(40)), 0.0, np.sin(np.radians(40)), 0.0],
        "plant.omega_BN_B": [0.0, 0.3, 0.0],
    }
    wide = {"controller.rho_0": [4.0] * 3, "controller.overshoot": [0.9] * 3} if "ppatc" in name else {}
    system = replace(system, parameters=system.parameters | start | wide)
    run = simulate(system, replace(experiment, stop_time=5.0, every=1))
    lock = run["controller.gimbal_lock"]
    assert run.info["status"] == "finished" and run.time[-1] == 5.0
    assert lock.max() == 1 and lock[0] == lock[-1] == 0
    w, x, y, z = run["plant.q_BN"][lock > 0].T
    assert np.degrees(np.arcsin(2 * (w * y + x * z))).min() > 89.9
    assert all(np.isfinite(run.table.column(c).to_numpy()).all() for c in run.table.column_names)


class TestBits:
    def run(self, **master):
        run = fly("zhang2018-ppatc", stop_time=5.0, every=1, master=Explicit(centred=True, **master))
        return b"".join(column.to_numpy().tobytes() for column in run.table.columns)

    def test_two_runs_are_equal(self):
        assert self.run() == self.run()

    def test_kernel_and_python_loop_are_equal(self):
        assert self.run(kernel="always") == self.run(kernel="never")
