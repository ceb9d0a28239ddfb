"""Every experiment of every paper gets off the ground: no component refuses what its own paper's system sets."""

from dataclasses import replace

import pytest

from cosim import simulate
from cosim.studies.papers import describe, scenario


@pytest.mark.parametrize("name", describe())
def test_every_experiment_starts(name):
    flight, experiment = scenario(name)
    step = experiment.communication_step_size
    run = simulate(flight, replace(experiment, stop_time=step, every=1))
    assert (run.info["status"], run.time[-1]) == ("finished", step)
