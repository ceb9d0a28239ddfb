"""A sample takes the input of its own instant, whatever the timing of the connection and the communication step."""

from pathlib import Path

import numpy as np
import pytest

from cosim import simulate
from cosim.cli.library import Library
from cosim.errors import WiringErrors
from cosim.masters.explicit import Explicit
from cosim.system import Connection, Experiment, System

FILE = Path(__file__).parents[1] / "sampled.py"
T = 0.1


@pytest.mark.parametrize("backend", ["native", "python"])
@pytest.mark.parametrize("step", [0.1, 0.05, 0.02])
@pytest.mark.parametrize(
    ("timing", "extrapolation"),
    [("at_point", 0), ("at_point", 1), ("after_step", 0), ("ramp", 0), ("smooth", 0)],
)
def test_every_sample_adds_the_time_of_its_own_instant_once(timing, extrapolation, step, backend):
    system = System(
        name="samples",
        components={"line": f"{FILE}:Line", "total": f"{FILE}:Total"},
        connections=[Connection("line.y", "total.u", timing)],
    )
    experiment = Experiment(stop_time=1.0, communication_step_size=step, master=Explicit(extrapolation=extrapolation))
    result = simulate(system, experiment, locate=Library(backend))
    taken = np.floor(result.time / T + 1e-6)  # samples 0 ... taken
    np.testing.assert_allclose(result["total.shown"], T * taken * (taken + 1) / 2, rtol=1e-12)


@pytest.mark.parametrize(
    ("sample_time", "step", "steps", "fits"),
    [
        (0.25, 0.1, 1, "0.25, 0.125, 0.05, 0.025 s"),
        (0.25, 0.3, 1, "0.25, 0.125, 0.05, 0.025 s"),
        (0.1, 0.04, 1, "0.1, 0.05, 0.02, 0.01 s"),
        (0.1, 0.05, 3, "0.1, 0.05, 0.02, 0.01 s"),
    ],
)
def test_a_sample_time_that_steps_do_not_meet_is_refused(sample_time, step, steps, fits):
    """A 0.25 s controller at 0.1 s would sample at 0.2, 0.3, 0.5 s, ... with filters made for 0.25 s."""
    system = System(
        name="samples",
        components={"total": f"{FILE}:Total"},
        held={"total.u": 1.0},
        parameters={"total.sample_time": sample_time},
        steps={"total": steps},
    )
    with pytest.raises(WiringErrors) as caught:
        simulate(system, Experiment(stop_time=3.0, communication_step_size=step))
    (mistake,) = map(str, caught.value.mistakes)
    assert mistake == (
        f"total samples every {sample_time:g} s, but steps of {step * steps:g} s do not meet that. "
        f"Choose a communication step of {fits}, or a multiple of the sample time."
    )
