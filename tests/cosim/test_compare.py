"""The table controller x plant: what is flown, what a figure is, what stands in place of one."""

import json

import numpy as np
import pyarrow as pa
import pytest

from cosim import compare
from cosim.errors import UnknownName
from cosim.fmu_library import Library
from cosim.result import Result

LOCATE = Library()


@pytest.fixture(scope="module")
def controllers():
    return compare.controllers(LOCATE)


@pytest.fixture(scope="module")
def plants():
    return compare.plants(LOCATE)


def flight(error_deg: float, torque: float = 0.0) -> Result:
    """A run of 200 s with a constant error about x and a constant torque about z."""
    t = np.linspace(0.0, 200.0, 2001)
    half = np.radians(error_deg) / 2
    columns = {"time": t}
    for i, value in enumerate([np.cos(half), np.sin(half), 0.0, 0.0], 1):
        columns[f"plant.q_BN[{i}]"] = np.full_like(t, value)
        columns[f"guidance.q_RN[{i}]"] = np.full_like(t, float(i == 1))
    for i in (1, 2, 3):
        columns[f"actuators.tau_B[{i}]"] = np.full_like(t, torque * (i == 3))
    return Result(pa.table(columns), {"status": "finished"})


def test_every_paper_with_an_attitude_plant_gives_one(plants):
    assert {"zhang2018", "xiao2011"} <= set(plants)
    assert set(plants["zhang2018"].vehicle) == {"J", "delta", "Omega", "zeta"}


def test_a_controller_is_listed_once_for_each_of_its_parameter_sets(controllers):
    assert {"zhang2018-ppatc", "zhang2018-ppatc-half", "zhang2018-atc", "xiao2011-pid"} <= set(controllers)
    assert "xiao2011-pid-large" not in controllers  # the same gains from another start


def test_the_vehicle_is_carried_into_the_controller_and_its_gains_stay(plants, controllers):
    system = compare.cell(plants["xiao2011"], controllers["zhang2018-atc"], LOCATE)
    assert system.parameters["controller.J"] == plants["xiao2011"].vehicle["J"] == system.vehicle["J"]
    assert system.parameters["controller.K"] == controllers["zhang2018-atc"].parameters["controller.K"]


def test_figures_of_a_run_with_known_error_and_torque():
    cell = compare.measured("plant", "law", flight(0.005, 0.02))
    assert cell.figures["steady error (deg)"] == pytest.approx(0.005, rel=1e-6)
    assert cell.figures["settling time (s)"] == 0.0
    assert cell.figures["peak torque (N.m)"] == pytest.approx(0.02)
    assert cell.figures["torque impulse (N.m.s)"] == pytest.approx(0.02 * 200.0)


def test_a_run_that_does_not_settle_has_no_figures():
    cell = compare.measured("plant", "law", flight(1.0))
    assert not cell.figures
    assert cell.remark == "does not settle: 1 deg in the last 50 s"
    assert compare.row(cell)[-1] == cell.remark


def test_a_controller_outside_its_domain_says_why(plants, controllers, monkeypatch):
    monkeypatch.setattr(compare, "START_ERROR", (0.0, 0.0, 0.0))
    monkeypatch.setattr(compare, "STOP", 1.0)
    cell = compare.fly(plants["zhang2018"], controllers["zhang2018-ppatc"], LOCATE)
    assert cell.remark.startswith("refuses: the initial")
    assert "overshoot" in cell.remark


@pytest.mark.slow
def test_table_and_parameter_sets_are_written(tmp_path):
    names = ["zhang2018-atc", "xiao2011-pid"]
    table = compare.compare(["zhang2018"], names, tmp_path, LOCATE)
    assert [c.controller for c in table.cells] == names
    assert all(0 < c.figures["settling time (s)"] < 60 for c in table.cells)
    assert (tmp_path / "compare.md").read_text().count("\n") == 4
    data = json.loads((tmp_path / "compare.json").read_text())
    assert data["parameters"]["zhang2018-atc"]["controller.K"] == [0.5, 0.1, 0.5]


def test_an_unknown_controller_is_answered_with_the_nearest(tmp_path):
    with pytest.raises(UnknownName, match="Did you mean"):
        compare.compare([], ["zhang2018-act"], tmp_path, LOCATE)


@pytest.mark.slow
def test_the_command_prints_parameter_sets_and_table(adcs):
    done = adcs("compare", "--plants", "zhang2018", "--controllers", "xiao2011-pid", "--out", "table")
    assert done.status == 0
    assert "xiao2011-pid:\n" in done.out and "controller.K_p = " in done.out
    assert "settling" in done.out and "wrote table/compare.md" in done.out


def test_a_mistyped_plant_is_answered_at_the_command_line(adcs):
    done = adcs("compare", "--plants", "zang2018")
    assert done.status == 2
    assert 'Did you mean "zhang2018"' in done.err
