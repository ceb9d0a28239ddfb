"""The table controller x plant: what is flown, what a figure is, what stands in place of one."""

import json
import signal
import threading

import numpy as np
import pyarrow as pa
import pytest
from numpy.testing import assert_allclose

from components.numbers import geng2012
from cosim.cli.library import Library
from cosim.errors import ResultExists, ResultUnwritable, UnknownName
from cosim.results.result import Result
from cosim.studies import comparison, papers
from cosim.studies.comparison import Mission, laws, vehicles
from cosim.studies.comparison import cell as cells
from cosim.studies.papers.geng2012 import gains
from cosim.system.expand import wire
from cosim.system.graph import stepping_order
from fmus.description.read import read_description

LOCATE = Library()
MISSION = Mission()


@pytest.fixture(scope="module")
def controllers():
    return laws.find_controllers(LOCATE)


@pytest.fixture(scope="module")
def plants():
    return vehicles.find_plants(LOCATE)


def system(plant, controller):
    """The system of one cell, and its FMUs' descriptions."""
    found = cells.make_system(plant, laws.fit(controller, plant, LOCATE), MISSION, LOCATE)
    return found, {name: read_description(LOCATE(reference)) for name, reference in found.components.items()}


def run_of(error_deg: float, torque: float = 0.0) -> Result:
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


def test_every_paper_with_an_attitude_plant_gives_one_with_a_cluster(plants):
    assert list(plants) == [key for key in papers.PAPERS if key != "li2014"]
    assert {name: list(plant.components.values()) for name, plant in plants.items()} == {
        "zhang2018": ["ReactionWheels"],  # an ideal torque in the paper
        "xiao2011": ["ReactionWheels"],
        "geng2012": ["CmgSteering", "CmgCluster:gimbals=2"],
        "ye2016": ["WeightedSteering:gimbals=4:wheels=3", "CmgCluster"],  # commanded by rates in the paper
    }


def test_a_controller_is_told_the_torque_that_its_cluster_has(plants):
    told = {name: plant.vehicle["torque_limit"] for name, plant in plants.items()}
    values = {name: getattr(limit, "value", limit) for name, limit in told.items()}
    assert values == {"zhang2018": [1.0] * 3, "xiao2011": [0.2] * 3, "geng2012": [0.25] * 3, "ye2016": [1.0] * 3}


def test_a_controller_is_listed_once_for_each_of_its_parameter_sets(controllers):
    assert {"zhang2018-ppatc", "zhang2018-ppatc-half", "zhang2018-atc", "xiao2011-pid"} <= set(controllers)
    assert "xiao2011-pid-large" not in controllers  # the same gains from another start
    assert "zhang2018-ppatc-rad" not in controllers  # its paper's experiment takes a finer step than the table's
    assert "xiao2011-l2gain-tracking" not in controllers  # it takes a reference of its own kind
    assert not any(name.startswith(("ye2016", "li2014")) for name in controllers)  # command no torque on a body


def test_every_pair_is_wired_and_measurement_and_reference_have_one_time_stamp(plants, controllers):
    """Nothing is left to complain about, and what a controller compares comes after_step from plant and guidance."""
    for plant in plants.values():
        for controller in controllers.values():
            found, descriptions = system(plant, controller)
            wiring = wire(found, descriptions)
            order = stepping_order(wiring)
            assert order.index("plant") < order.index("controller") > order.index("guidance")
            timings = {
                link.timing for link in wiring.links if link.target.component == "controller" and not link.step_mean
            }
            assert timings == {"after_step"}, found.name


def test_the_vehicle_is_carried_into_the_controller_and_its_gains_stay(plants, controllers):
    found, descriptions = system(plants["xiao2011"], controllers["zhang2018-atc"])
    settings = {str(port): value for port, value in wire(found, descriptions).settings.items()}
    assert settings["controller.J[1,1]"] == settings["plant.J[1,1]"] == 1200.0
    assert [settings[f"controller.K[{i}]"] for i in (1, 2, 3)] == [0.5, 0.1, 0.5]


@pytest.mark.parametrize(("plant", "modes"), [("zhang2018", 8), ("xiao2011", 3), ("geng2012", 4), ("ye2016", 0)])
def test_a_controller_that_knows_modes_is_built_for_those_of_the_vehicle(plants, controllers, plant, modes):
    _, descriptions = system(plants[plant], controllers["geng2012-compensated"])
    knows = [name for name in ("controller", "observer") if name in descriptions]
    for name in knows:
        groups = descriptions[name].groups
        assert (len(groups["Omega"].elements) if modes else "Omega" not in groups) == (modes or True)
    assert ("observer" in knows) == bool(modes)  # nothing to observe in a rigid body


def test_a_gain_that_follows_from_the_vehicle_is_designed_for_it(plants, controllers):
    """geng2012's linear-quadratic gain: the paper's numbers on its own vehicle, the rule's on another."""
    own = laws.fit(controllers["geng2012-linear"], plants["geng2012"], LOCATE)
    assert own.parameters["controller.G_e"] == geng2012.GAIN["e"]
    other = laws.fit(controllers["geng2012-linear"], plants["xiao2011"], LOCATE)
    assert np.shape(other.parameters["controller.G_eta"]) == (3, 3)
    assert not np.any(other.parameters["controller.D_eta"])
    assert other.parameters["controller.D_omega"] == geng2012.SURFACE["omega"]


def test_gains_of_an_observer_stay_with_the_modes_that_they_were_placed_for(plants, controllers):
    placed = controllers["geng2012-observer-placed"]
    own, other = (laws.fit(placed, plants[name], LOCATE).parameters for name in ("geng2012", "zhang2018"))
    assert np.shape(own["observer.L_eta"].value) == (4, 3) and np.any(own["observer.L_eta"].value)
    assert np.shape(other["observer.L_eta"]) == np.shape(other["observer.L_psi"]) == (8, 3)
    assert not np.any(other["observer.L_eta"]) and not np.any(other["observer.L_psi"])


def test_the_rule_gives_the_gain_of_the_paper_s_vehicle():
    """GAIN is from another Riccati solver: equal but for the rounding of both."""
    found = gains.design(
        {"J": geng2012.J, "delta": np.transpose(geng2012.F), "Omega": geng2012.OMEGA, "zeta": geng2012.ZETA}
    )
    for name, expected in geng2012.GAIN.items():
        assert_allclose(found[f"controller.G_{name}"], expected, rtol=1e-9, atol=1e-10)


def test_the_gain_of_a_rigid_vehicle_is_that_of_a_double_integrator():
    """Closed form, axis by axis: min of q_e e^2 + q_w w^2 + u^2 for J w' = u has k_e = sqrt(q_e),
    k_w = sqrt(q_w + 2 J k_e)."""
    found = gains.design({"J": np.diag([10.0, 100.0, 1000.0])})
    k_e = np.sqrt(11.2)
    assert_allclose(found["controller.G_e"], -k_e * np.eye(3), atol=1e-9)
    k_w = np.sqrt(390.0 + 2 * np.array([10.0, 100.0, 1000.0]) * k_e)
    assert_allclose(np.diag(found["controller.G_omega"]), -k_w, rtol=1e-9)


def test_figures_of_a_run_with_known_error_and_torque():
    cell = cells.measure(cells.Cell("plant", "law", {}), run_of(0.005, 0.02), MISSION)
    assert cell.figures["steady error (deg)"] == pytest.approx(0.005, rel=1e-6)
    assert cell.figures["settling time (s)"] == 0.0
    assert cell.figures["peak torque (N.m)"] == pytest.approx(0.02)
    assert cell.figures["torque impulse (N.m.s)"] == pytest.approx(0.02 * 200.0)


def test_a_run_that_does_not_settle_has_no_figures():
    cell = cells.measure(cells.Cell("plant", "law", {}), run_of(1.0), MISSION)
    assert not cell.figures
    assert cell.remark == "does not settle: 1 deg in the last 50 s"
    assert comparison.make_row(cell)[-1] == cell.remark


def test_a_controller_that_refuses_its_start_says_why(plants, controllers):
    mission = Mission(start_error=(0.0, 0.0, 0.0), stop=1.0)
    law = laws.fit(controllers["zhang2018-ppatc"], plants["zhang2018"], LOCATE)
    cell = cells.fly(plants["zhang2018"], law, mission, LOCATE)
    assert cell.remark.startswith("refuses: the initial")
    assert "overshoot" in cell.remark


@pytest.mark.parametrize(
    ("flag", "words"),
    [
        ("gimbal_lock", "at a pitch of 90 deg its Euler angles are singular (gimbal_lock)"),
        ("barrier_time", "the error left its prescribed bounds (barrier_time)"),
    ],
)
def test_a_controller_that_left_its_domain_says_so_instead_of_figures(flag, words):
    run = run_of(0.005)
    reported = np.where(run.time >= 50.0, 1.0, 0.0)
    run = Result(run.table.append_column(f"controller.{flag}", pa.array(reported)), {"status": "finished"})
    cell = cells.measure(cells.Cell("plant", "law", {}), run, MISSION)
    assert not cell.figures
    assert cell.remark == f"out of its domain from 50 s: {words}"


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    folder = tmp_path_factory.mktemp("compare")
    return comparison.compare([], [], folder, LOCATE), folder


@pytest.mark.slow
def test_every_controller_flies_on_every_plant(whole, plants, controllers):
    table, _ = whole
    assert table.complete
    assert {(c.plant, c.controller) for c in table.cells} == {(p, c) for p in plants for c in controllers}
    for cell in table.cells:
        assert bool(cell.figures) != bool(cell.remark)
        assert not cell.remark.startswith(("does not fit", "refuses", "ends at")), cell


@pytest.mark.slow
def test_what_fails_in_its_paper_fails_here(whole):
    """The printed gain has no attitude feedback, printed weights never settle, on any and on their own vehicle."""
    remarks = {(c.plant, c.controller): c.remark for c in whole[0].cells}
    assert all("does not settle" in remarks[p, "geng2012-printed-gain"] for p in papers.PAPERS if p != "li2014")
    assert "does not settle" in remarks["xiao2011", "xiao2011-l2gain-printed"]


@pytest.mark.slow
def test_on_its_own_vehicle_a_controller_does_what_its_paper_shows(whole):
    figures = {(c.plant, c.controller): c.figures for c in whole[0].cells}
    # zhang2018: PPATC keeps a bias within 0.005 deg an axis, ATC none
    assert figures["zhang2018", "zhang2018-ppatc"]["steady error (deg)"] < 0.005 * np.sqrt(3)
    assert figures["zhang2018", "zhang2018-atc"]["steady error (deg)"] < 1e-4
    for controller in ("xiao2011-l2gain", "xiao2011-pid"):
        assert figures["xiao2011", controller]["peak torque (N.m)"] <= 0.2 * (1 + 1e-12)
        assert figures["xiao2011", controller]["settling time (s)"] < 100.0
    with_net, without = (figures["geng2012", f"geng2012-{n}compensated"] for n in ("", "un"))
    assert with_net["peak eta (kg^(1/2).m)"] < without["peak eta (kg^(1/2).m)"]


@pytest.mark.slow
def test_table_and_parameter_sets_are_written(whole):
    table, folder = whole
    text = (folder / "compare.md").read_text()
    assert sum(line.startswith("| ") for line in text.splitlines()) == 2 + len(table.cells)
    assert "10 deg about (0.5774, 0.5774, 0.5774)" in text and "xiao2011: ReactionWheels: the paper's cluster" in text
    data = json.loads((folder / "compare.json").read_text())
    assert data["parameters"]["zhang2018-atc"]["controller.K"] == [0.5, 0.1, 0.5]
    assert data["parameters"]["zhang2018-atc on xiao2011"]["controller.J"].startswith("[[1200.0,")
    assert len(data["cells"]) == len(table.cells)


def test_ctrl_c_while_a_flight_is_set_up_keeps_the_others(tmp_path, monkeypatch):
    def announce(name):
        if name.startswith("xiao2011"):
            monkeypatch.setattr("cosim.studies.comparison.table.fit", press)

    def press(*_arguments):
        raise KeyboardInterrupt

    two, mission = ["zhang2018-atc", "xiao2011-pid"], Mission(stop=2.0)
    table = comparison.compare(["ye2016"], two, tmp_path, LOCATE, None, announce, mission=mission)
    assert (table.complete, table.planned, len(table.cells)) == (False, 2, 1)
    assert "zhang2018-atc" in (tmp_path / "compare.md").read_text()


def test_a_table_is_not_overwritten_and_a_file_is_no_folder(tmp_path):
    (tmp_path / "compare.md").write_text("older")
    with pytest.raises(ResultExists):
        comparison.compare([], [], tmp_path, LOCATE)
    assert (tmp_path / "compare.md").read_text() == "older"
    with pytest.raises(ResultUnwritable, match=r"compare\.md cannot be written: it is a file"):
        comparison.compare([], [], tmp_path / "compare.md", LOCATE)


def test_ctrl_c_ends_the_table_and_keeps_the_flights_that_were_finished(tmp_path):
    def press(t, stop):  # in the second flight
        if len(announced) == 2 and t < stop:
            signal.raise_signal(signal.SIGINT)

    announced: list[str] = []
    assert threading.current_thread() is threading.main_thread()
    two, mission = ["zhang2018-atc", "xiao2011-pid"], Mission(stop=60.0)
    table = comparison.compare(["ye2016"], two, tmp_path, LOCATE, press, announced.append, mission=mission)
    assert not table.complete
    assert [cell.controller for cell in table.cells] == ["zhang2018-atc"]
    assert "zhang2018-atc" in (tmp_path / "compare.md").read_text()


def test_an_unknown_controller_is_answered_with_the_nearest(tmp_path):
    with pytest.raises(UnknownName, match="Did you mean"):
        comparison.compare([], ["zhang2018-act"], tmp_path, LOCATE)


@pytest.mark.slow
def test_the_command_prints_parameter_sets_and_table(adcs):
    done = adcs("compare", "--plants", "zhang2018", "--controllers", "xiao2011-pid", "--out", "table")
    assert done.status == 0
    assert "xiao2011-pid:\n" in done.out and "controller.K_p = " in done.out
    assert "slew: 10 deg about" in done.out and "zhang2018 with 3 reaction wheels of 1 N m" in done.out
    assert "settling" in done.out and "wrote table/compare.md" in done.out


def test_an_empty_name_is_no_plant(adcs):
    done = adcs("compare", "--plants", ",")
    assert (done.status, 'unknown plant ""' in done.err) == (2, True)


def test_a_mistyped_plant_is_answered_at_the_command_line(adcs):
    done = adcs("compare", "--plants", "zang2018")
    assert done.status == 2
    assert 'Did you mean "zhang2018"' in done.err
