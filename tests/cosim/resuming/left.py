"""Runs that were interrupted at a checkpoint."""

import pytest

from cosim import flights
from cosim.results.checkpoint import CheckpointRefused
from cosim.resuming import resume as go_on

from ..c_fmu import build, real

COUNT = {"outputs": "y = (double)m->whole[0];", "step": "m->whole[0]++;"}


def counter(folder, name="Counter", **more):
    return build(folder, name, [real("y")], **{**COUNT, **more})


class Cut(Exception):
    """Ends a run at a checkpoint."""


def interrupted(system, setup, folder, at=0.5, every=0.25, **more):
    """A run that ended at its first checkpoint from `at` s on."""

    def progress(t, _stop):
        if t >= at - 1e-9:
            raise Cut

    with pytest.raises(Cut):
        flights.simulate(system, setup, out=folder, checkpoint=every, progress=progress, **more)
    return folder


def refused(folder, *, kind=CheckpointRefused, **more) -> str:
    with pytest.raises(kind) as caught:
        go_on(folder, **more)
    return str(caught.value)
