"""An FMU alone, and inputs that nothing is connected to."""

import zipfile

import pytest

from cosim import Experiment, System, simulate
from cosim.errors import WiringErrors
from cosim.results.result import Result

from .. import c_fmu
from ..c_fmu import boolean, real, string

STEP = "m->state[0] += h * u;"
PROPOSED = '<DefaultExperiment startTime="1" stopTime="3" stepSize="0.5"/>'


@pytest.fixture
def integrator(tmp_path):
    """y' = u with u = 2 from its start, and inputs of other types beside it."""
    inputs = [real("u", "input", start=2.0), boolean("on", "input", start=True), string("s", "input", start="a")]
    return c_fmu.build(tmp_path, "Integrator", [*inputs, real("y")], outputs="y = m->state[0];", step=STEP)


def proposing(path, target, proposal=PROPOSED):
    """The FMU with a DefaultExperiment."""
    with zipfile.ZipFile(path) as old, zipfile.ZipFile(target, "w") as new:
        for name in old.namelist():
            data = old.read(name)
            if name == "modelDescription.xml":
                data = data.replace(b"<VendorAnnotations>", proposal.encode() + b"<VendorAnnotations>")
            new.writestr(name, data)
    return target


def test_it_flies_as_its_default_experiment_says(adcs, integrator, folder):
    proposing(integrator, folder / "mine.fmu")
    done = adcs("run", "mine.fmu")
    assert done.status == 0, done.err
    assert "held at start values: mine.u = 2.0, mine.on = True, mine.s = a" in done.out
    result = Result.read("results/mine")
    assert result.time.tolist() == [1.0, 1.5, 2.0, 2.5, 3.0]
    assert result["mine.y"].tolist() == [0.0, 1.0, 2.0, 3.0, 4.0]


def test_without_a_stop_time_it_says_so(adcs, integrator, folder):
    proposing(integrator, folder / "mine.fmu", "")
    done = adcs("run", "mine.fmu")
    told = "mine.fmu has no stop time in its DefaultExperiment. Give it one: --stop 10."
    assert (done.status, told in done.err) == (2, True)
    assert adcs("run", "mine.fmu", "--stop", "0.5").status == 0
    assert Result.read("results/mine").time[-1] == 0.5


def test_unconnected_inputs_are_refused_with_their_own_start_values(integrator):
    system = System(name="s", components={"a": str(integrator)})
    with pytest.raises(WiringErrors) as caught:
        simulate(system, Experiment(stop_time=1.0, communication_step_size=0.5))
    first = str(caught.value.mistakes[0])
    assert first == 'input a.u is not connected. Connect it, or hold it: held={"a.u": 2.0}.'


def test_those_that_are_held_by_name_keep_their_value(integrator):
    system = System(name="s", components={"a": str(integrator)}, held={"a.u": 3.0}, hold_unconnected=True)
    result = simulate(system, Experiment(stop_time=1.0, communication_step_size=0.5))
    assert result["a.y"].tolist() == [0.0, 1.5, 3.0]
    assert {name: held["value"] for name, held in result.info["held"].items()} == {"a.u": 3.0, "a.on": True, "a.s": "a"}
