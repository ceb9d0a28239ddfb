"""Gyro, star tracker, filter and wheels in systems: rates, delay, both back ends, a slew on estimates, events."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial.transform import Rotation

from cosim import Experiment, simulate
from cosim.cli.library import Library
from cosim.slaves.fmi2 import FmuSlave

from .sensed import closed_loop, open_loop

H = 0.01


def attitude(run, port):
    return Rotation.from_quat(run[port], scalar_first=True)


@pytest.mark.parametrize("late", [0, 2, 5])
def test_each_samples_at_its_own_rate_and_late_by_its_latency(late):
    """At 0.01, 0.02 and 0.1 s; a master that steps the tracker at its own rate gives the same flight, bit by bit."""
    rates = {"tracker.sample_time": 0.02, "tracker.samples_per_measurement": 5, "tracker.latency": late * 0.02}
    system, setup = open_loop(**rates), Experiment(stop_time=2.0, communication_step_size=H)
    run = simulate(system, setup)
    k = np.arange(len(run.time))
    measured = (k - 2 * late) // 10 * 10  # the last step of which a measurement has arrived
    assert_array_equal(run["tracker.valid"], measured >= 0)
    shown = np.maximum(measured, 0)
    assert_allclose(run["tracker.exposure_time"], run.time[shown], rtol=1e-15)
    assert_allclose(run["tracker.q_BN"], run["plant.q_BN"][shown], atol=1e-15)
    # of the body's motion over a step the mean is that at its middle, to h^2 / 24 of its second derivative
    rate = run["plant.omega_BN_B"]
    assert_allclose(run["gyro.omega_BN_B"][1:], (rate[1:] + rate[:-1]) / 2, atol=1e-8)
    error = (attitude(run, "filter.q_BN").inv() * attitude(run, "plant.q_BN")).magnitude()
    assert error[measured >= 0].max() < 1e-10
    slow = simulate(replace(system, steps={"tracker": 2}), setup)
    for column in run.table.column_names:
        assert slow.table[column].equals(run.table[column]), column


@pytest.mark.slow
def test_native_and_python_fly_the_same():
    """To 1e-12 of each variable's maximum, with noise, in the closed loop."""
    system, experiment = closed_loop(2.0)
    links = [replace(c, timing="at_point") if c.target == "plant.h_B" else c for c in system.connections]
    native, python = (
        simulate(replace(system, connections=links), experiment, locate=Library(b)) for b in ("native", "python")
    )
    for column in native.table.column_names:
        a, b = (run.table[column].to_numpy() for run in (native, python))
        assert np.abs(a - b).max() <= 1e-12 * np.abs(a).max(), column


@pytest.mark.slow
def test_a_slew_on_estimates():
    """60 deg in 120 s: errors of attitude and bias within 3 sigma, wheels within their limits, momentum kept."""
    run = simulate(*closed_loop(300.0))
    error = (attitude(run, "filter.q_BN").inv() * attitude(run, "plant.q_BN")).as_rotvec()
    within = np.abs(error) < 3 * run["filter.sigma_q_BN"]
    assert within.mean() > 0.99  # 0.9973 of normal errors
    bias = run["gyro.bias"] - run["filter.bias"]
    assert (np.abs(bias) < 3 * run["filter.sigma_bias"])[10:].mean() > 0.98
    assert np.abs(np.degrees(bias[-1]) * 3600).max() < 3 * 0.11  # of 3 to 4 deg/h at the start
    # cross noise of 5 arcsec at 5 Hz: better than a single measurement by more than two
    assert np.sqrt((error[20000:, :2] ** 2).mean(axis=0)).max() * 206265 < 2.5
    assert np.degrees((attitude(run, "guidance.q_RN").inv() * attitude(run, "plant.q_BN")).magnitude()).max() < 0.1
    assert run.metrics["momentum drift, relative (1)"] < 1e-12
    assert np.abs(run["wheels.wheel_momentum"]).max() > 1.0


@pytest.mark.parametrize("backend", ["native", "python"])
def test_what_is_tunable_is_changed_between_steps(backend):
    """Health, weight of a wheel, availability of a tracker: in force from the next step on."""
    library = Library(backend)
    wheels = started(library("ReactionWheels:wheels=4"))
    variables = wheels.description.variables
    of = lambda *names: tuple(variables[n].value_reference for n in names)  # noqa: E731
    wheels.set_real(of("tau_command_B[1]", "tau_command_B[2]", "tau_command_B[3]"), [0.03, -0.05, 0.02])
    wheels.do_step(0.0, 0.1)
    tau = of("tau_B[1]", "tau_B[2]", "tau_B[3]")
    assert_allclose(wheels.get_real(tau), [0.03, -0.05, 0.02], rtol=1e-12)
    wheels.set_real(of("health[2]"), [0.0])
    wheels.do_step(0.1, 0.1)
    assert wheels.get_real(of("motor_torque[2]")) == [0.0]
    assert np.abs(wheels.get_real(tau) - np.array([0.03, -0.05, 0.02])).max() > 0.01
    wheels.set_real(of("allocation_weight[2]"), [0.0])
    wheels.do_step(0.2, 0.1)
    assert_allclose(wheels.get_real(tau), [0.03, -0.05, 0.02], rtol=1e-12)
    tracker = started(library("StarTracker"))
    valid = (tracker.description.variables["valid"].value_reference,)
    available = (tracker.description.variables["available"].value_reference,)
    found = []
    for k in range(4):
        tracker.set_real(available, [float(k != 2)])
        tracker.do_step(0.2 * k, 0.2)
        found.append(float(tracker.get_real(valid)[0]))
    assert found == [1, 1, 0, 1]


def started(path) -> FmuSlave:
    slave = FmuSlave("unit", path)
    slave.instantiate()
    slave.setup_experiment(0.0)
    slave.enter_initialization_mode()
    slave.exit_initialization_mode()
    return slave
