"""Ten steps of a paper's flight."""

from dataclasses import replace

from cosim.studies.papers import scenario

NAME = "zhang2018-ppatc"


def short(**changes):
    """The paper's system and ten steps of its experiment, every row of it."""
    system, experiment = scenario(NAME)
    return system, replace(experiment, stop_time=0.01, every=1, **changes)
