"""A parameter of the vehicle that nobody set and that instances hold different values of."""

import pytest

from cosim import Experiment, System, prepare
from cosim.system.shared import disagreements

from ..fakes import Fake, describe
from ..wired import wired


class Part(Fake):
    """A component with J, marked as shared or not."""

    def __init__(self, name, J, marked=True, unit="kg.m2"):
        parameters = {f"J[{i + 1}]": value for i, value in enumerate(J)} | {"gain": 1.0 + len(name)}
        units = {"J": unit}
        marks = frozenset(k for k in parameters if k[0] == "J") if marked else frozenset()
        super().__init__(name, describe(parameters=parameters, units=units, shared=marks))


def found(*parts, **options):
    return disagreements(wired([], parts, held={}, **options))


def test_each_value_is_told_with_who_holds_it():
    parts = Part("plant", [1.0, 2.0]), Part("law", [1.0, 3.0]), Part("observer", [1.0, 3.0])
    assert found(*parts) == [
        "nothing sets J, and its start values differ: [1.0, 2.0] in plant; [1.0, 3.0] in law, observer. "
        'Set it for all: System(vehicle={"J": ...}), --set "*.J=..."'
    ]


def test_an_fmu_that_marks_nothing_is_meant_where_another_marks_the_parameter():
    assert len(found(Part("plant", [1.0, 2.0]), Part("foreign", [5.0, 5.0], marked=False))) == 1


@pytest.mark.parametrize(
    ("parts", "options"),
    [
        ([Part("plant", [1.0]), Part("law", [1.0])], {}),
        ([Part("plant", [1.0], marked=False), Part("law", [2.0], marked=False)], {}),
        ([Part("plant", [1.0]), Part("law", [2.0])], {"parameters": {"law.J": [2.0]}}),
        ([Part("plant", [1.0]), Part("law", [2.0])], {"vehicle": {"J": [3.0]}}),
        ([Part("plant", [1.0]), Part("law", [1.0, 2.0])], {}),
        ([Part("plant", [1.0]), Part("law", [2.0], marked=False, unit="N.m")], {}),
    ],
    ids=["equal", "of no vehicle", "one is set", "all are set", "of another size", "of another unit"],
)
def test_nothing_is_told(parts, options):
    assert found(*parts, **options) == []


def test_a_flight_whose_parameters_settle_it_is_not_told(caplog, monkeypatch):
    """And one that leaves it open is, in run.json and once on the terminal."""
    monkeypatch.setattr("cosim.flight._told", set())
    parts = {"plant": Part("plant", [1.0]), "law": Part("law", [2.0])}
    system = System(name="two", components=dict.fromkeys(parts, ""))
    experiment = Experiment(stop_time=0.2, communication_step_size=0.1)
    with prepare(system, slaves=parts) as prepared:
        settled = prepared.fly(experiment, parameters={"plant.J": [3.0], "law.J": [3.0]})
        assert settled.info["warnings"] == [] and "nothing sets" not in caplog.text
        for _ in range(2):
            (line,) = prepared.fly(experiment).info["warnings"]
        assert caplog.messages.count(line) == 1 and line.startswith("nothing sets J")
