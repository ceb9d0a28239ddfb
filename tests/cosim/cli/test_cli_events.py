"""adcs run --at: parameters that change in flight."""

import pytest
from numpy.testing import assert_allclose

from cosim.results.result import Result

SYSTEM = """
from tests.cosim.oscillator import Damper, Mass

from cosim import Connection, Experiment, System


def oscillator():
    links = [Connection("mass.v", "damper.v", "after_step"), Connection("damper.f", "mass.f")]
    system = System(name="oscillator", components={"mass": Mass, "damper": Damper}, connections=links)
    return system, Experiment(stop_time=0.2, communication_step_size=0.01)
"""


@pytest.fixture
def run(adcs, folder):
    (folder / "own.py").write_text(SYSTEM)
    return lambda *arguments: adcs("run", "own.py", "--out", "out", *arguments)


def test_several_in_either_writing(run, adcs, folder):
    done = run("--at", "50ms", "mass.k=9", "--at", "0.1 damper.c=2 1/s", "--at", "1/9", "mass.k=1 1/s2")
    assert done.status == 0, done.err
    result = Result.read(folder / "out")
    assert [event["time"] for event in result.info["events"]] == [0.05, 0.1, 1 / 9]
    assert result.info["events"][1]["values"] == {"damper.c": {"value": 2.0, "unit": "1/s"}}
    at = result.time == 0.05
    for text in (done.out, adcs("show", "out").out):
        assert (
            "event: at 0.05 s mass.k = 9.0 1/s2\nevent: at 0.1 s damper.c = 2.0 1/s\nevent: at 0.111111111111 s mass"
            in text
        )
    assert_allclose(result["mass.a"][at], result["mass.f"][at] - 9 * result["mass.x"][at], rtol=1e-14)
    assert 1 / 9 in result.time


@pytest.mark.parametrize(
    "arguments, message",
    [
        (("--at", "50ms"), "event at 50ms: nothing is said to change then. Write --at 50s controller.kp=30."),
        (("mass.k=9",), "mass.k=9 has no --at before it"),
        (("--at", "soon", "mass.k=9"), "--at is 'soon'"),
        (("--at", "1s", "mass.k=9"), "the time of an event is 1 s: it must be from start_time, 0 s, on and before"),
        (("--at", "50ms", "mass.mass=9"), "mass.mass is a fixed parameter, which cannot change after the start"),
        (("--at", "50ms", "mass.k"), "it is not INSTANCE.NAME=VALUE"),
    ],
)
def test_what_is_refused(run, arguments, message):
    done = run(*arguments)
    assert done.status == 2
    assert message in " ".join(done.err.split())
