"""adcs compare with one's own plants, controllers, slew and disturbance."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from cosim import Connection, Experiment, System, Value
from cosim.cli.comparing import is_system, read_mission
from cosim.cli.library import Library
from cosim.errors import FmuError, ParameterError, UnknownName
from cosim.studies import comparison
from cosim.studies.comparison import Mission, Unsuited, laws, own, vehicles
from cosim.studies.comparison import cell as cells
from fmus.description.read import read_description

LOCATE = Library()
LAW = '''
"""PD attitude control: tau = -kp e - kd w_e."""
from components.framework import AttitudeController, Component, Parameter
from components.mathematics import quaternion


class PD(Component):
    ports = AttitudeController
    kp = Parameter(unit="N.m/rad", start=40.0, doc="stiffness")
    kd = Parameter(unit="N.m.s/rad", start=250.0, doc="damping")

    def outputs(self, t, x, u, p):
        q_BR = quaternion.error(u.q_BN, u.q_RN)
        error = quaternion.rotation_vector(q_BR)
        rate = u.omega_BN_B - quaternion.rotate(quaternion.conjugate(q_BR), u.omega_RN_R)
        return {"tau_command_B": -p.kp * error - p.kd * rate, "attitude_error": error}
'''
FLIGHT = '''
"""A bus of two hundred kilogram metre squared with four wheels in a pyramid."""
from cosim import Connection, Experiment, System, Value


def bus():
    seen = ["body.q_BN", "body.omega_BN_B", "profile.q_RN", "profile.omega_RN_R", "profile.omega_dot_RN_R"]
    system = System(
        name="bus",
        components={
            "profile": "Slew",
            "law": "law.py:PD",
            "wheels": "ReactionWheels:wheels=4",
            "body": "FlexibleSpacecraft:modes=0",
        },
        connections=[
            *(Connection(port, f"law.{port.split('.')[1]}", "after_step") for port in seen),
            Connection("law.tau_command_B", "wheels.tau_command_B"),
            Connection("wheels.h_B", "body.h_B", "ramp"),
        ],
        parameters={
            "body.J": [[200, 0, 0], [0, 210, 0], [0, 0, 220]],
            "wheels.torque_limit": [0.5] * 4,
            "law.kp": 30.0,
        },
        held={"body.tau_B": [0, 0, 0], "body.tau_dist_B": [0, 0, 0]},
    )
    return system, Experiment(stop_time=60.0, communication_step_size=0.01)
'''
QUICK = Mission(
    slew={"angle": Value(2.0, "deg"), "axis": [0, 0, 3], "max_rate": Value(0.5, "deg/s"),
          "max_acceleration": Value(0.05, "deg/s2"), "start_time": 5.0},
    stop=60.0, step=0.01, every=1, steady=10.0,
)  # fmt: skip


@pytest.fixture
def files(adcs, folder):
    """A folder with a law, a system and an FMU, the working folder."""
    (folder / "law.py").write_text(LAW)
    (folder / "flight.py").write_text(FLIGHT)
    shutil.copy(LOCATE("FlexibleSpacecraft:modes=0"), folder / "bus.fmu")
    return folder


def test_own_plant_and_law_give_the_same_table(files, adcs):
    done = adcs(
        "compare", "--plants", "bus.fmu,flight.py", "--controllers", "law.py:PD,flight.py:bus", "--slew",
        "angle=2 deg", "--slew", "axis=[0,0,1]", "--slew", "max_rate=0.5 deg/s",
        "--slew", "max_acceleration=0.05 deg/s2", "--slew", "start_time=5",
        "--disturbance", "bias=[0,0,1e-3] N.m", "--disturbance", "sine=[0,0,0]",
        "--disturbance", "cosine=[0,0,0]", "--stop", "90", "--settled", "0.05 deg", "--out", "t",
    )  # fmt: skip
    assert done.status == 0, done.err
    data = json.loads(Path("t/compare.json").read_text())
    assert [(c["plant"], c["controller"]) for c in data["cells"]] == [
        ("bus.fmu", "law.py:PD"), ("bus.fmu", "bus"), ("bus", "law.py:PD"), ("bus", "bus")
    ]  # fmt: skip
    assert all(c["figures"] and c["exchange"] == "slopes" for c in data["cells"]), data["cells"]
    assert data["clusters"] == {
        "bus.fmu": "3 reaction wheels of 1 N m on the body axes",
        "bus": "ReactionWheels:wheels=4: the system's cluster",
    }
    assert "slew: 2 deg about (0, 0, 1), at most 0.5 deg/s and 0.05 deg/s2, smooth, begun after 5 s" in done.out
    assert "no component of the error above 0.05 deg any more, counted from the end of the slew" in done.out
    # a bias is held by kp alone: the steady error is bias / kp, the start's has decayed by exp(-kp / kd 58 s) = 1e-3
    steady = [c["figures"]["steady error (deg)"] for c in data["cells"]]
    assert steady[:2] == pytest.approx(np.degrees([1e-3 / 40, 1e-3 / 30]), rel=0.05)


def test_a_cell_is_the_flight_of_one_ode(files):
    """The rigid body with a PD law and ideal wheels, written out: J w' = u - w x J w, total momentum beside.

    The exchange is of order two in 10 ms, the loop's fastest pole kd / J = 1.25 1/s: some (0.0125)^2 of 2 deg.
    """
    plant = own.plants(["bus.fmu"], LOCATE)[0]
    law = laws.fit(own.controllers([f"{files}/law.py:PD"], LOCATE)[0], plant, LOCATE)
    system = cells.make_system(plant, law, QUICK, LOCATE)
    from cosim import simulate

    run = simulate(system, Experiment(stop_time=60.0, communication_step_size=0.01, master=cells.EXCHANGES["slopes"]))
    J = np.array(plant.vehicle["J"].value)
    T, a = max(2 * 2 / 0.5, np.sqrt(2 * np.pi * 2 / 0.05)), np.radians(2.0)
    d0, n = np.array([1e-3, 0, 1e-3]), 0.0011

    def reference(t):
        s = np.clip((t - 5.0) / T, 0, 1)
        angle, rate = a * (s - np.sin(2 * np.pi * s) / (2 * np.pi)), a / T * (1 - np.cos(2 * np.pi * s))
        return Rotation.from_rotvec([0, 0, angle]), np.array([0, 0, rate])

    def rhs(t, y):
        q, w, h = Rotation.from_quat(y[:4]), y[4:7], y[7:]
        r, rate = reference(t)
        e = r.inv() * q
        u = -40.0 * e.as_rotvec() - 250.0 * (w - e.inv().apply(rate))
        d = d0 + np.array([0, 1e-3, 1e-3]) * np.sin(n * t) + np.array([1e-3, 1e-3, 0]) * np.cos(n * t)
        q_dot = 0.5 * np.array([*(y[3] * w + np.cross(y[:3], w)), -y[:3] @ w])
        return np.concatenate([q_dot, np.linalg.solve(J, u + d - np.cross(w, J @ w + h)), -u])

    start = Rotation.from_rotvec((0.2, 0.15, -0.2), degrees=True).as_quat()
    y0 = np.concatenate([start, np.zeros(6)])
    truth = solve_ivp(rhs, (0, 60.0), y0, "DOP853", rtol=1e-11, atol=1e-13, t_eval=run.time, max_step=0.5)
    off = Rotation.from_quat(truth.y[:4].T).inv() * Rotation.from_quat(run["plant.q_BN"], scalar_first=True)
    assert np.degrees(off.magnitude().max()) < 2.0 * 0.0125**2


def test_settling_of_a_cell_is_counted_from_the_end_of_the_slew(files):
    plant = own.plants(["bus.fmu"], LOCATE)[0]
    law = laws.fit(own.controllers([f"{files}/law.py:PD"], LOCATE)[0], plant, LOCATE)
    tight = QUICK.with_changes(threshold=0.0022)  # the steady error is near .002 deg: settled some time after
    early, late = (cells.fly(plant, law, mission, LOCATE) for mission in (QUICK.with_changes(threshold=5.0), tight))
    assert early.figures["settling time (s)"] == 0.0
    assert late.remark or late.figures["settling time (s)"] > 0
    short = cells.fly(plant, law, QUICK.with_changes(stop=10.0), LOCATE)
    end = 5.0 + np.sqrt(2 * np.pi * 2 / 0.05)
    assert short.remark == f"the slew ends at {end:.4g} s, after the flight's 10 s"


def test_a_stiff_loop_that_diverges_with_slopes_is_flown_held_and_that_is_said(files, adcs):
    """kd / J dt = 1.5: a held torque needs less than 2, one that follows its slope less than 1."""
    text = (files / "law.py").read_text().replace("start=250.0", "start=3.0e5").replace("start=40.0", "start=1.0e4")
    (files / "stiff.py").write_text(text)
    plant = own.plants(["bus.fmu"], LOCATE)[0]
    law = laws.fit(own.controllers([f"{files}/stiff.py:PD"], LOCATE)[0], plant, LOCATE)
    wide = vehicles.Plant(**{**vars(plant), "vehicle": {**plant.vehicle, "torque_limit": [1e9] * 3}})
    step = 1.5 * 200.0 / 3e5
    cell = cells.fly(wide, law, QUICK.with_changes(step=step, stop=35.0, steady=5.0), LOCATE)
    assert cell.exchange == "held"


def test_the_disturbance_may_be_another_component():
    mission = read_mission([], ["GravityGradient", "rate=0.001 rad/s"])
    assert mission.environment == "GravityGradient" and list(mission.disturbance) == ["rate"]
    assert mission.words[1].startswith("disturbance: GravityGradient, rate 0.001 rad/s")


def test_an_own_disturbance_flies(files):
    (files / "push.py").write_text(
        "from components.framework import Component, Environment\n\n\nclass Push(Component):\n"
        '    """A push about x."""\n\n    ports = Environment\n\n    def outputs(self, t, x, u, p):\n'
        '        return {"tau_dist_B": [0.02, 0, 0]}\n'
    )
    mission = QUICK.with_changes(environment=f"{files}/push.py:Push", threshold=1.0)
    plant = own.plants(["bus.fmu"], LOCATE)[0]
    law = laws.fit(own.controllers([f"{files}/law.py:PD"], LOCATE)[0], plant, LOCATE)
    cell = cells.fly(plant, law, mission, LOCATE)
    assert cell.figures["steady error (deg)"] == pytest.approx(np.degrees(0.02 / 40), rel=0.02)


def test_a_system_s_names_do_not_matter(files):
    from cosim.cli import scenario

    given = scenario.load("flight.py")
    (plant,), (law,) = own.plants([given], LOCATE), own.controllers([given], LOCATE)
    assert list(plant.components) == ["actuators"] and plant.components["actuators"] == "ReactionWheels:wheels=4"
    assert plant.parameters["actuators.torque_limit"] == [0.5] * 4
    assert plant.vehicle["J"] == [[200, 0, 0], [0, 210, 0], [0, 0, 220]]
    assert law.parameters == {"controller.kp": 30.0}


def test_what_is_between_plant_and_controller_is_left_out(files):
    from cosim.cli import scenario

    system, experiment = scenario.load("flight.py")
    with_sensor = System(
        **{
            **vars(system),
            "components": {**system.components, "camera": "StarTrackerGyro"},
            "connections": [
                *(c for c in system.connections if c.target not in ("law.q_BN", "law.omega_BN_B")),
                *(Connection(f"body.{n}", f"camera.{n}_true", "after_step") for n in ("q_BN", "omega_BN_B")),
                *(Connection(f"camera.{n}", f"law.{n}", "after_step") for n in ("q_BN", "omega_BN_B")),
            ],
        }
    )
    (plant,) = own.plants([(with_sensor, experiment)], LOCATE)
    assert list(plant.components) == ["actuators"]


def test_a_class_is_a_controller_too():
    from components.controllers.quaternion_feedback import QuaternionFeedback

    (law,) = own.controllers([QuaternionFeedback], LOCATE)
    assert law.name == "QuaternionFeedback"


def test_equal_names_are_told_apart():
    plant = vehicles.Plant("bus", "x.fmu", {}, {}, (), {}, "")
    assert [p.name for p in own.told_apart([plant, plant, plant])] == ["bus", "bus (2)", "bus (3)"]


def test_slew_and_disturbance_have_the_parameters_of_their_components():
    from cosim.studies.comparison import mission

    for reference, known in (("Slew", mission.SLEW), ("HarmonicTorque", mission.DISTURBANCE)):
        fmu = read_description(LOCATE(reference))
        own_ = {n for n, g in fmu.groups.items() if fmu.variables[g.elements[0]].is_parameter and "." not in n}
        assert own_ == set(known)


@pytest.mark.parametrize(
    ("name", "system"),
    [("flight.py", True), ("flight.py:bus", True), ("law.py:PD", False), ("bus.fmu", False), ("zhang2018", False)],
)
def test_a_file_names_a_system_or_a_class(name, system):
    assert is_system(name) == system


class TestBadInput:
    @pytest.fixture
    def nothing_is_built(self, monkeypatch):
        def build(*_arguments):
            raise AssertionError("something is built")

        monkeypatch.setattr(Library, "__call__", build)

    @pytest.mark.parametrize(
        ("arguments", "words"),
        [
            (
                ["--plants", "zang2018"],
                'unknown plant "zang2018" in the papers and the catalog. Did you mean "zhang2018"',
            ),
            (["--plants", "FlexibleSpacecraf"], 'Did you mean "FlexibleSpacecraft"'),
            (["--controllers", "zhang2018-act"], 'unknown controller "zhang2018-act"'),
            (["--controllers", "zhang2018-act"], 'Did you mean "zhang2018-atc"'),
            (["--controllers", "nowhere.fmu"], "nowhere.fmu: there is no such file"),
            (["--plants", "nowhere.py:Body"], "nowhere.py: there is no such file"),
            (["--plants", "nowhere.py"], "there is no file nowhere.py"),
            (["--slew", "angel=3 deg"], 'unknown parameter "angel" in the slew. Did you mean "angle"'),
            (["--slew", "angle"], "parameter angle: it is not NAME=VALUE, as in --slew 'angle=30 deg'"),
            (["--slew", "axis=[0,0,0]"], "axis of the slew: it is [0.0, 0.0, 0.0], needed are three numbers"),
            (["--disturbance", "bais=[1,0,0]"], 'unknown parameter "bais" in the disturbance. Did you mean "bias"'),
            (["--settled", "3"], "'3' has no unit"),
        ],
    )
    def test_what_is_wrong_is_told_before_anything_is_built(self, adcs, folder, nothing_is_built, arguments, words):
        done = adcs("compare", *arguments)
        assert (done.status, words in done.err) == (2, True), done.err
        assert not (folder / "results").exists()

    def test_a_component_of_another_kind_says_what_it_lacks(self):
        with pytest.raises(Unsuited) as caught:
            own.plants(["HarmonicTorque"], LOCATE)
        assert str(caught.value) == (
            "HarmonicTorque is no plant of this table: HarmonicTorque lacks the input tau_B, the output omega_BN_B, "
            "the output q_BN. It needs the inputs tau_B and the outputs omega_BN_B, q_BN."
        )
        with pytest.raises(Unsuited, match="lacks the output tau_command_B"):
            own.controllers(["ye2016-adaptive"], LOCATE)

    def test_a_system_without_a_plant(self):
        system = System(name="alone", components={"environment": "HarmonicTorque"})
        with pytest.raises(Unsuited, match="no instance of it is an attitude plant"):
            own.plants([(system, Experiment(stop_time=1.0, communication_step_size=0.1))], LOCATE)
        with pytest.raises(Unsuited, match="no instance of it is an attitude controller"):
            own.controllers([(system, Experiment(stop_time=1.0, communication_step_size=0.1))], LOCATE)

    def test_names_from_python(self, tmp_path):
        with pytest.raises(UnknownName, match="Did you mean"):
            comparison.compare(["zhang2081"], [], tmp_path, LOCATE)
        with pytest.raises(FmuError):
            comparison.compare([], ["there/is/none.fmu"], tmp_path, LOCATE)
        with pytest.raises(ParameterError):
            Mission(slew={"axis": [1.0, 0.0]})
