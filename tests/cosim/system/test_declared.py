"""Systems and experiments that are written as plain data are read as what they were."""

import json
import math
from fractions import Fraction

import numpy as np
import pytest

from cosim.errors import NotSupported
from cosim.masters.error_controlled import ErrorControlled
from cosim.masters.iterated import Iterated
from cosim.results import again
from cosim.system import At, Connection, Experiment, Signal, System, Value

SYSTEM = System(
    name="all",
    components={"a": "A.fmu", "b": "Flexible:modes=3", "c": "own.py:Law"},
    connections=[Connection("a.y", "b.u", "smooth", factor=2.0, offset=0.5), Connection("a.z", "b.w")],
    parameters={"a.J": np.eye(2), "b.k": Value("0.005 deg"), "b.text": Value('"3 m"'), "b.limit": math.inf},
    vehicle={"zeta": 0.1},
    held={"b.h": [0, 0, 1]},
    inputs={"b.x": Signal(([0.0, 0.1, 1 / 3], [[1.0, np.pi], [2.0, -0.0], [3.0, 1e-300]]), unit="N.m")},
    steps={"b": 4},
    isolated=["a"],
    source={"function": "own.py:make"},
)
EXPERIMENT = Experiment(
    stop_time=Fraction(1, 3),
    communication_step_size=np.float32(0.1),
    master=ErrorControlled(relative=1e-7, tolerances={"a.y": 1e-9}, least_step=Fraction(1, 3000)),
    record=["a.*"],
    events=[At(0.1, {"b.k": Value(3, "deg")})],
    stop_when="a.done",
)


def told(system=SYSTEM, experiment=EXPERIMENT):
    return json.loads(json.dumps(again.record(system, experiment, {}, {}, "csv"), allow_nan=False))


def test_all_of_it_comes_back(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    read = again.system_of(told())
    here = {"a": str(tmp_path / "A.fmu"), "b": "Flexible:modes=3", "c": f"{tmp_path / 'own.py'}:Law"}
    assert read.components == here  # from wherever it is read
    for name in ("connections", "parameters", "vehicle", "held", "inputs", "steps", "isolated", "source"):
        assert getattr(read, name) == getattr(SYSTEM, name), name
    assert read.inputs["b.x"].values.tobytes() == SYSTEM.inputs["b.x"].values.tobytes()
    assert read.inputs["b.x"].label == SYSTEM.inputs["b.x"].label
    experiment = again.experiment_of(told())
    assert experiment.communication_step_size == Fraction(1, 10)
    for name in ("stop_time", "master", "record", "events", "stop_when"):
        assert getattr(experiment, name) == getattr(EXPERIMENT, name), name


def test_what_cannot_be_written_is_refused_by_name():
    with pytest.raises(NotSupported, match=r"^this flight cannot be written .*: System\.parameters: a object can"):
        told(System(name="s", components={}, parameters={"a.b": object()}))


@pytest.mark.parametrize(
    ("change", "where", "was", "now"),
    [
        ({"stop_time": 2.0}, "experiment.stop_time", "1/3", "2.0"),
        ({"master": Iterated()}, "experiment.master", "ErrorControlled(relative=1e-07, ", "Iterated()"),
        ({"every": 3}, "experiment.every", "not set", "3"),
        ({"events": ()}, "experiment.events", "[At(time=0.1, values={b.k: Value(value=3, unit='deg')})]", "not set"),
    ],
)
def test_a_difference_is_told_with_both_values(change, where, was, now):
    from dataclasses import replace

    found = again.difference(told(), told(experiment=replace(EXPERIMENT, **change)))
    assert found is not None
    assert (found[0], found[2]) == (where, now)
    assert found[1].startswith(was)


def test_samples_are_compared_by_their_checksum():
    from dataclasses import replace

    other = replace(SYSTEM, inputs={"b.x": Signal(([0.0, 1.0], [[1.0, 2.0], [2.0, 0.0]]), unit="N.m")})
    long = again.short(told())["system"]["inputs"]["b.x"]["!Signal"]
    assert len(long["rows"]) < again.LONG
    assert again.difference(told(), told(other))[0] == "system.inputs.b.x"
    assert again.difference(told(), told()) is None
