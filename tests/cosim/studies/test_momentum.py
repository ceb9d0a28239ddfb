"""The total inertial momentum of a body and its actuators, which are units of their own.

A body that takes their momentum keeps it whatever a master makes of that between two communication points; one that
takes their torque keeps it because the torque is the mean over the step.
"""

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from cosim import Explicit, simulate
from cosim.masters.error_controlled import ErrorControlled
from cosim.masters.iterated import Iterated
from cosim.system import Connection, Experiment, System

FILE = Path(__file__).parents[1] / "wheel.py"
WHEEL, TORQUE_BODY = f"{FILE}:Wheel", f"{FILE}:TorqueBody"
BODY = "FlexibleSpacecraft:modes=0"
FAST = {  # a torque that reverses every 30 s, a body that tumbles at 3 deg/s
    "command.bias": [0.0, 0.0, 0.0],
    "command.sine": [0.3, -0.2, 0.25],
    "command.cosine": [0.1, 0.2, -0.3],
    "command.frequency": 0.1,
    "body.omega_BN_B": [0.05, -0.03, 0.02],
}


def fly(body: str, momentum: str | None, step: float, torque: str = "", master=None):
    """20 s of the wheels on a body; `torque`: the wheels' output that the body takes as a torque."""
    system = System(
        name="momentum",
        components={"command": "HarmonicTorque", "wheel": WHEEL, "body": body},
        connections=[
            Connection("command.tau_dist_B", "wheel.tau_command_B", "ramp"),  # so that the torque changes in a step
            Connection("wheel.h_B", "body.h_B", momentum),
            *([Connection(f"wheel.{torque}", "body.tau_B", "after_step")] if torque else []),
        ],
        parameters=FAST,
        held={f"body.{name}": [0.0] * 3 for name in (["tau_B", "tau_dist_B"] if body == BODY else [])},
    )
    return simulate(system, Experiment(stop_time=20.0, communication_step_size=step, master=master))


def change(total: np.ndarray) -> float:
    """The largest change of a vector, relative to its size."""
    return float(np.max(np.linalg.norm(total - total[0], axis=1)) / np.linalg.norm(total[0]))


def drift(momentum: str | None, step: float, torque: str = "tau_B") -> float:
    """Of the body that takes the torque."""
    return change(fly(TORQUE_BODY, momentum, step, torque)["body.H_N"])


# ---- a body that takes the momentum --------------------------------------------------------------------------------


@pytest.mark.parametrize("timing", [None, "at_point", "after_step", "midpoint", "ramp"])
def test_a_body_that_takes_the_momentum_keeps_it_in_every_timing(timing):
    """By what was recorded of both units, too: J w + h in inertial axes, at every row but where h is one step late."""
    run = fly(BODY, timing, 0.01)
    assert change(run["body.H_N"]) < 1e-13
    body = run["body.omega_BN_B"] * [300.0, 200.0, 250.0] + run["wheel.h_B"]
    total = Rotation.from_quat(run["body.q_BN"], scalar_first=True).apply(body)
    assert change(total) < (1e-12 if timing not in ("at_point", "midpoint") else 1e-3)


def test_a_momentum_that_says_no_timing_is_ramped():
    first, second = (fly(BODY, timing, 0.1)["body.q_BN"] for timing in (None, "ramp"))
    assert first.tobytes() == second.tobytes()


# ---- a body that takes the torque ----------------------------------------------------------------------------------


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


@pytest.mark.parametrize(
    "master",
    [Explicit(inputs="smooth", extrapolation=1), Iterated("ramp"), Iterated("smooth"), ErrorControlled(1e-5)],
    ids=str,
)
def test_repeated_steps_keep_it(master):
    """A momentum beside its mean torque is a line, whatever the master makes of other inputs."""
    assert change(fly(TORQUE_BODY, None, 0.05, "tau_B", master)["body.H_N"]) < 1e-12
