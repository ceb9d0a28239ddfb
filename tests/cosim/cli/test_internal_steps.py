"""`adcs show` and run.json tell the internal steps of a system."""

import math

import numpy as np
import pytest

from components.framework.component import start_vector
from components.plants.flexible_spacecraft import FlexibleSpacecraft
from cosim.results.result import Result

FILE = """
from cosim import Experiment, System, Value

def flown():
    plant = "FlexibleSpacecraft"
    system = System(
        name="two",
        components={"one": plant, "other": plant, "guidance": "AttitudeStep"},
        parameters={"other.solver.step": Value(0.02, "s"), **PARAMETERS},
        hold_unconnected=True,
    )
    return system, Experiment(stop_time=1.0, communication_step_size=0.1)
"""


def write(folder, parameters="{}"):
    (folder / "two.py").write_text(FILE.replace("PARAMETERS", parameters))


def told(text):
    """The lines of show about internal steps."""
    lines = text.splitlines()
    at = next(i for i, line in enumerate(lines) if line.startswith("internal steps"))
    return [line.strip() for line in lines[at + 1 : lines.index("", at)]]


def test_show_and_run_tell_what_is_taken(adcs, folder):
    write(folder)
    plant = FlexibleSpacecraft()
    fastest = np.abs(np.linalg.eigvals(plant.linearise(start_vector(plant.states))[0])).max()
    step = 0.1 / math.ceil(0.1 / (0.1 / fastest * 0.95))  # whole ones in 100 ms; digits cut off take less than a tenth
    one, other = told(adcs("show", "two.py").out)
    name, seconds, _, why = one.replace(":", "").split()
    assert (name, why) == ("one", "(automatic)")
    assert 0.85 * step <= float(seconds) <= 0.1 / fastest
    assert other == "other: 0.02 s (solver.step = 0.02 s)"
    assert adcs("run", "two.py", "--out", "out").status == 0
    steps = Result.read(folder / "out").info["internal_steps"]
    assert steps.keys() == {"one", "other"}  # the guidance has no states
    assert steps["one"] == pytest.approx(float(seconds), rel=1e-5)  # six digits are shown


def test_show_of_a_system_that_does_not_fly(adcs, folder):
    write(folder, '{"one.zeta": -1.0, "one.J": [[1, 0, 0], [0, 1, 0], [0, 0, -1]]}')
    one, other = told(adcs("show", "two.py").out)
    assert one.startswith("one: automatic; not flown: one cannot be initialized")
    assert other.startswith("other: solver.step = 0.02 s; not flown: ")
