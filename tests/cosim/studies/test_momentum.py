"""Two units that exchange a torque keep their total inertial momentum, because the torque is the mean over the step."""

from pathlib import Path

import numpy as np
import pytest

from cosim import simulate
from cosim.system import Connection, Experiment, System

WHEEL = f"{Path(__file__).parents[1] / 'wheel.py'}:Wheel"
FAST = {  # a torque that reverses every 30 s, a body that tumbles at 3 deg/s
    "command.bias": [0.0, 0.0, 0.0],
    "command.sine": [0.3, -0.2, 0.25],
    "command.cosine": [0.1, 0.2, -0.3],
    "command.frequency": 0.1,
    "body.omega_BN_B": [0.05, -0.03, 0.02],
}


def drift(momentum: str | None, step: float, torque: str = "tau_B") -> float:
    """The change of the total inertial momentum over 20 s, relative to its size."""
    system = System(
        name="momentum",
        components={"command": "HarmonicTorque", "wheel": WHEEL, "body": "FlexibleSpacecraft:modes=0"},
        connections=[
            Connection("command.tau_dist_B", "wheel.tau_command_B", "ramp"),  # so that the torque changes in a step
            Connection(f"wheel.{torque}", "body.tau_B", "after_step"),
            Connection("wheel.h_B", "body.h_B", momentum),
        ],
        parameters=FAST,
        held={"body.tau_dist_B": [0.0, 0.0, 0.0]},
    )
    total = simulate(system, Experiment(stop_time=20.0, communication_step_size=step))["body.H_N"]
    return float(np.max(np.linalg.norm(total - total[0], axis=1)) / np.linalg.norm(total[0]))


def test_ramped_momentum_is_kept_to_rounding():
    # The body sees h_B linear, its torque is exactly minus the slope: what is left is its own RK4 (1 ms) and rounding.
    assert drift("ramp", 0.01) < 1e-13


def test_momentum_that_says_no_timing_is_ramped_to_the_body_that_takes_its_torque():
    """For the mean torque and the momentum are two sides of one exchange."""
    assert drift(None, 0.01) == drift("ramp", 0.01)


def test_midpoint_momentum_is_kept_to_second_order():
    coarse, fine = drift("midpoint", 0.02), drift("midpoint", 0.01)
    assert fine < 1e-7
    assert np.log2(coarse / fine) == pytest.approx(2.0, abs=0.1)


def test_momentum_of_the_end_of_the_step_drifts_with_first_order():
    coarse, fine = drift("after_step", 0.02), drift("after_step", 0.01)
    assert np.log2(coarse / fine) == pytest.approx(1.0, abs=0.1)
    assert fine > 1e3 * drift("midpoint", 0.01)


def test_the_torque_of_the_end_of_the_step_drifts_where_the_mean_does_not():
    coarse, fine = drift("ramp", 0.02, "tau_end_B"), drift("ramp", 0.01, "tau_end_B")
    assert np.log2(coarse / fine) == pytest.approx(1.0, abs=0.1)
    assert fine > 1e-5
