"""A sample takes the input of its own instant, whatever the timing of the connection and the communication step."""

from pathlib import Path

import numpy as np
import pytest

from cosim import simulate
from cosim.cli.library import Library
from cosim.masters.explicit import Explicit
from cosim.system import Connection, Experiment, System

FILE = Path(__file__).parents[1] / "sampled.py"
T = 0.1


@pytest.mark.parametrize("backend", ["native", "python"])
@pytest.mark.parametrize("step", [0.1, 0.05, 0.02])
@pytest.mark.parametrize(
    ("timing", "centred"), [("at_point", False), ("after_step", False), ("after_step", True), ("ramp", False)]
)
def test_every_sample_adds_the_time_of_its_own_instant_once(timing, centred, step, backend):
    system = System(
        name="samples",
        components={"line": f"{FILE}:Line", "total": f"{FILE}:Total"},
        connections=[Connection("line.y", "total.u", timing)],
    )
    experiment = Experiment(stop_time=1.0, communication_step_size=step, master=Explicit(centred=centred))
    result = simulate(system, experiment, locate=Library(backend))
    taken = np.floor(result.time / T + 1e-6)  # samples 0 ... taken
    np.testing.assert_allclose(result["total.shown"], T * taken * (taken + 1) / 2, rtol=1e-12)
