"""The python back end as a host sees it: editable source, no two FMUs disturbing each other, clear refusals."""

import zipfile
from pathlib import Path

import fmpy
import pytest
from fmpy.fmi1 import FMICallException

from components.catalog import CATALOG
from cosim.errors import CallFailed
from cosim.masters.calls import assign, assignments
from cosim.slaves.fmi2 import FmuSlave
from fmus.errors import UnknownComponent
from fmus.export.python.python_fmu import build_python
from fmus.export.references import parse

SPRING = '''
"""A mass on a spring.

x'' = -STIFFNESS x  (1)
"""
import helper
from components.framework import Component, State

class Spring(Component):
    solver_step = 1e-3
    position = State(unit="m", start=1.0, output=True, doc="position")
    speed = State(unit="m/s", output=True, doc="speed")

    def derivatives(self, t, x, u, p):
        return {"position": x.speed, "speed": -helper.STIFFNESS * x.position}  # (1)
'''

COUNTER = '''
"""Counts steps, in plain Python."""
from components.framework import Output, PythonComponent, State, Input

class Counter(PythonComponent):
    limit = Input(unit="1", start=100.0, doc="where it breaks")
    count = State(unit="1", doc="steps")
    shown = Output(unit="1", doc="steps")

    def step(self, t, h, x, u, p):
        if x.count >= u.limit:
            raise ValueError("the counter is full")
        return {"count": x.count + 1}

    def outputs(self, t, x, u, p):
        return {"shown": x.count}
'''


def spring(folder: Path, stiffness: float) -> Path:
    """A user's folder with a component and its helper module, as an FMU."""
    folder.mkdir()
    (folder / "helper.py").write_text(f"STIFFNESS = {stiffness}\n")
    (folder / "spring.py").write_text(SPRING)
    return build_python(parse(f"{folder / 'spring.py'}:Spring").component(), folder / "Spring.fmu")


def edited(fmu: Path, target: Path, name: str, old: str, new: str) -> Path:
    """A copy of an FMU with one file inside changed, as somebody with an editor and a zip tool would make it."""
    with zipfile.ZipFile(fmu) as source, zipfile.ZipFile(target, "w") as copy:
        for entry in source.namelist():
            data = source.read(entry)
            if entry == f"resources/source/{name}":
                assert old.encode() in data
                data = data.replace(old.encode(), new.encode())
            copy.writestr(entry, data)
    return target


def start(path: Path, **inputs: float) -> FmuSlave:
    slave = FmuSlave("unit", path)
    slave.instantiate()
    for name, value in inputs.items():
        assign(slave, assignments([(slave.description.variables[name], value)]))
    slave.setup_experiment(0.0)
    slave.enter_initialization_mode()
    slave.exit_initialization_mode()
    return slave


def position_after(slave: FmuSlave, steps: int = 10, step: float = 0.1) -> float:
    for k in range(steps):
        slave.do_step(k * step, step)
    vr = slave.description.variables["position"].value_reference
    return float(slave.get_real((vr,))[0])


def test_the_archive_is_the_same_bytes_on_every_build(tmp_path):
    first = build_python(CATALOG["Sum"](), tmp_path / "a" / "Sum.fmu")
    second = build_python(CATALOG["Sum"](), tmp_path / "b" / "Sum.fmu")
    assert first.read_bytes() == second.read_bytes()


def test_two_users_with_a_helper_of_the_same_name_each_get_their_own(tmp_path):
    from math import cos, sqrt

    soft, hard = start(spring(tmp_path / "soft", 1.0)), start(spring(tmp_path / "hard", 4.0))
    assert position_after(hard) == pytest.approx(cos(sqrt(4.0)), abs=1e-9)
    assert position_after(soft) == pytest.approx(cos(sqrt(1.0)), abs=1e-9)


def test_an_edited_copy_beside_the_unedited_one_runs_its_own_equations(tmp_path):
    from math import cos, sqrt

    original = spring(tmp_path / "soft", 1.0)
    copy = edited(original, tmp_path / "Edited.fmu", "helper.py", "1.0", "9.0")
    unedited, changed, again = start(original), start(copy), start(original)
    assert position_after(unedited) == pytest.approx(cos(1.0), abs=1e-9)
    assert position_after(changed) == pytest.approx(cos(sqrt(9.0)), abs=1e-9)
    assert position_after(again) == pytest.approx(cos(1.0), abs=1e-9)


def test_two_instances_of_one_fmu_do_not_disturb_each_other(tmp_path):
    path = spring(tmp_path / "soft", 1.0)
    one, other = start(path), start(path)
    for k in range(10):
        one.do_step(k * 0.1, 0.1)
    assert position_after(other, 10) == float(one.get_real((one.description.variables["position"].value_reference,))[0])


def test_an_edit_that_changes_the_interface_is_refused_with_the_way_out(tmp_path):
    original = spring(tmp_path / "soft", 1.0)
    copy = edited(original, tmp_path / "Edited.fmu", "spring.py", "start=1.0", "start=2.0")
    with pytest.raises(CallFailed) as error:
        start(copy)
    assert "the variables of the edited source differ from modelDescription.xml (['position'" in str(error.value)
    assert "adcs build" in str(error.value)


def test_an_edit_with_a_mistake_says_which(tmp_path):
    original = spring(tmp_path / "soft", 1.0)
    more = 'doc="speed")\n    extra = State(unit="m", doc="extra")'
    with pytest.raises(CallFailed, match="derivatives does not return 'extra'"):
        start(edited(original, tmp_path / "Edited.fmu", "spring.py", 'doc="speed")', more))


def test_an_edit_that_changes_a_dependency_is_refused(tmp_path):
    path = build_python(CATALOG["HarmonicTorque"](), tmp_path / "HarmonicTorque.fmu")
    copy = edited(path, tmp_path / "E.fmu", "components/environment/harmonic_torque.py", "p.bias + ", "")
    with pytest.raises(CallFailed, match="the dependencies of the edited source differ"):
        start(copy)


def test_an_exception_inside_a_python_component_is_reported_with_its_text(tmp_path):
    (tmp_path / "counter.py").write_text(COUNTER)
    slave = start(
        build_python(parse(f"{tmp_path / 'counter.py'}:Counter").component(), tmp_path / "Counter.fmu"), limit=2.0
    )
    slave.do_step(0.0, 0.1)
    slave.do_step(0.1, 0.1)
    with pytest.raises(CallFailed) as error:
        slave.do_step(0.2, 0.1)
    assert "the counter is full" in str(error.value)


def test_a_violated_condition_is_refused_at_the_end_of_initialization(tmp_path):
    path = build_python(CATALOG["FlexibleSpacecraft"](), tmp_path / "FlexibleSpacecraft.fmu")
    with pytest.raises(CallFailed) as error:
        start(path, **{"J[1,1]": 1.0})
    assert "J - delta^T delta is not positive definite (smallest eigenvalue" in str(error.value)


def test_a_state_restores_with_the_same_bits_also_into_a_new_instance(tmp_path):
    path = build_python(CATALOG["PrescribedPerformance"](), tmp_path / "PrescribedPerformance.fmu")
    slave, fresh = start(path), FmuSlave("fresh", path)
    everything = tuple(v.value_reference for v in slave.description.variables.values())
    slave.do_step(0.0, 0.001)
    state = slave.get_state()
    slave.do_step(0.001, 0.001)
    expected = slave.get_real(everything)
    slave.set_state(state)
    slave.do_step(0.001, 0.001)
    assert slave.get_real(everything).tobytes() == expected.tobytes()
    fresh.instantiate()
    fresh.set_state(fresh.deserialize_state(slave.serialize_state(state)))
    fresh.do_step(0.001, 0.001)
    assert fresh.get_real(everything).tobytes() == expected.tobytes()


def test_damaged_bytes_of_a_state_are_refused(tmp_path):
    slave = start(build_python(CATALOG["PrescribedPerformance"](), tmp_path / "PrescribedPerformance.fmu"))
    data = slave.serialize_state(slave.get_state())
    with pytest.raises(CallFailed, match="the bytes are damaged: their checksum is another") as error:
        slave.deserialize_state(data[:-3] + bytes([data[-3] ^ 1]) + data[-2:])
    assert error.value.function == "fmi2DeSerializeFMUstate"


def test_fmpy_reports_the_failure_too(tmp_path):
    path = build_python(CATALOG["FlexibleSpacecraft"](), tmp_path / "FlexibleSpacecraft.fmu")
    with pytest.raises(FMICallException):
        fmpy.simulate_fmu(str(path), stop_time=0.01, start_values={"J[1,1]": 1.0})


@pytest.mark.parametrize(
    ("reference", "words"),
    [
        ("FlexibelSpacecraft", 'unknown component "FlexibelSpacecraft". Did you mean "FlexibleSpacecraft"'),
        ("missing.py:Law", "there is no file missing.py"),
        ("Sum:n", "'n' is not NAME=VALUE, as in Sum:modes=6."),
    ],
)
def test_a_wrong_reference_is_answered_with_what_there_is(reference, words):
    with pytest.raises(UnknownComponent) as error:
        parse(reference).component()
    assert words in str(error.value)


def test_a_class_that_a_file_lacks_is_answered_with_those_that_it_has(tmp_path):
    (tmp_path / "counter.py").write_text(COUNTER)
    with pytest.raises(UnknownComponent, match=r'defines no component "Conter"\. Did you mean "Counter"'):
        parse(f"{tmp_path / 'counter.py'}:Conter").component()


def test_a_file_with_one_component_needs_no_class_and_takes_a_structure(tmp_path):
    (tmp_path / "counter.py").write_text(COUNTER)
    assert parse(str(tmp_path / "counter.py")).name == "Counter"
    assert parse("FlexibleSpacecraft:modes=3").model_name == "FlexibleSpacecraft_modes3"
    assert parse("FlexibleSpacecraft:modes=3").component().structure == {"modes": 3}
