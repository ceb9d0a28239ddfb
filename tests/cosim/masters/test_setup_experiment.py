"""What FMUs are told before initialization, and in which order."""

import pytest

from cosim.cli import overrides
from cosim.system import Experiment
from fmus.description.description import DefaultExperiment

from .. import both, c_fmu
from ..c_fmu import real
from ..fakes import Clock, describe
from ..flights import run


class Told(Clock):
    """Keeps what fmi2SetupExperiment was told."""

    def __init__(self, tolerance=None):
        super().__init__("c", default_experiment=DefaultExperiment(tolerance=tolerance))

    def setup_experiment(self, t, tolerance=None, stop=None):
        super().setup_experiment(t)
        self.told = (t, tolerance, stop)


@pytest.mark.parametrize(
    ("own", "settings", "told"),
    [
        (None, {}, (2.0, None, None)),
        (1e-6, {}, (2.0, 1e-6, None)),
        (1e-6, {"tolerance": 1e-9}, (2.0, 1e-9, None)),
        (None, {"announce_stop_time": True}, (2.0, None, 3.0)),
    ],
)
def test_tolerance_and_stop_time(own, settings, told):
    clock = Told(own)
    result = run([clock], [], start_time=2.0, stop=3.0, **settings)
    assert clock.told == told
    assert result.info["tolerance"] == settings.get("tolerance")


def test_the_command_line_sets_both():
    changed = overrides.with_experiment(
        Experiment(stop_time=1.0, communication_step_size=0.1), tolerance=1e-8, announce_stop_time=True
    )
    assert (changed.tolerance, changed.announce_stop_time) == (1e-8, True)


def test_start_values_are_set_after_an_fmu_has_set_its_own(tmp_path):
    """The FMU of one exporter fills its variables in fmi2SetupExperiment, whatever was set before."""
    setup = "MEMORY; (void)i; m->now = t; return fmi2OK; }\nfmi2Status fmi2EnterInit"
    filling = setup.replace("m->now = t;", "m->now = t; m->real[0] = 7;")
    path = c_fmu.build(
        tmp_path,
        "Late",
        [real("k", "parameter", start=1.0), real("y")],
        outputs="y = k;",
        template=c_fmu.C.replace(setup, filling),
    )
    assert set(both.fly(both.of({"a": path}, [], parameters={"a.k": 3.0}))["a.y"]) == {3.0}
    assert describe(inputs=["u"]).default_experiment.tolerance is None
