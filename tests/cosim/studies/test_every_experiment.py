"""Every experiment of every paper gets off the ground: no component refuses what its own paper's system sets."""

from dataclasses import replace

import pytest

from cosim import simulate
from cosim.studies.papers import describe, scenario


@pytest.mark.parametrize("name", describe())
def test_every_experiment_starts(name):
    """Its internal steps are set, whatever the communication step: what is measured stays when that is another."""
    flight, experiment = scenario(name)
    step = experiment.communication_step_size
    run = simulate(flight, replace(experiment, stop_time=step, every=1))
    assert (run.info["status"], run.time[-1]) == ("finished", step)
    taken, given = run.info["internal_steps"], run.info["parameters"]
    assert taken
    for instance, seconds in taken.items():
        assert 0 < seconds <= given[f"{instance}.solver.step"]["value"] * (1 + 1e-12), instance
