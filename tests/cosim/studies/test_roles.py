"""Plants, controllers, clusters and guidance are known by what they are: any name will do, and any number of them."""

import copy

import pytest

from cosim import Connection, Experiment, System, simulate
from cosim.results.result import Result
from cosim.studies import metrics, plots, roles
from cosim.studies.roles import Loop

STANDARD = {"plant": "plant", "guidance": "guidance", "controller": "controller", "actuators": "actuators"}
OTHER = {"plant": "bus", "guidance": "profile", "controller": "law", "actuators": "wheels"}


def parts(names, sensor=""):
    """Components and connections of one attitude loop; `sensor`: an instance between plant and controller."""
    plant, guidance, law, wheels = (names[n] for n in ("plant", "guidance", "controller", "actuators"))
    components = {
        plant: "FlexibleSpacecraft:modes=0",
        guidance: "Slew",
        law: "PID",
        wheels: "ReactionWheels",
    }
    seen = [(f"{plant}.{n}", f"{law}.{n}") for n in ("q_BN", "omega_BN_B")]
    if sensor:
        components[sensor] = "StarTrackerGyro"
        seen = [(f"{plant}.{n}", f"{sensor}.{n}_true") for n in ("q_BN", "omega_BN_B")]
        seen += [(f"{sensor}.{n}", f"{law}.{n}") for n in ("q_BN", "omega_BN_B")]
    links = [Connection(a, b, "after_step") for a, b in seen]
    links += [
        Connection(f"{guidance}.{n}", f"{law}.{n}", "after_step") for n in ("q_RN", "omega_RN_R", "omega_dot_RN_R")
    ]
    links += [
        Connection(f"{law}.tau_command_B", f"{wheels}.tau_command_B"),
        Connection(f"{wheels}.h_B", f"{plant}.h_B"),
    ]
    held = {f"{plant}.{n}": [0.0, 0.0, 0.0] for n in ("tau_B", "tau_dist_B")}
    parameters = {f"{guidance}.angle": 0.1, f"{plant}.q_BN": [0.9999, 0.0141417821, 0.0, 0.0]}
    return components, links, held, parameters


def fly(*loops, record=("*",), **options) -> Result:
    """Run systems of loops side by side."""
    components, links, held, parameters = {}, [], {}, {}
    for names in loops:
        found = parts(names, **options)
        components, links = components | found[0], links + found[1]
        held, parameters = held | found[2], parameters | found[3]
    system = System(name="loops", components=components, connections=links, held=held, parameters=parameters)
    return simulate(system, Experiment(stop_time=2.0, communication_step_size=0.1, record=record))


def bare(run: Result) -> Result:
    """The run as if none of its FMUs had said what it is."""
    info = copy.deepcopy(run.info)
    for component in info["components"].values():
        component["role"] = ""
    return Result(run.table, info)


def test_the_names_of_instances_do_not_matter():
    standard, other = fly(STANDARD), fly(OTHER)
    assert roles.loops(other) == [Loop("bus", "profile", ("law",), ("wheels",))]
    measured = metrics.measure(other)
    assert measured == metrics.measure(standard)
    for key in ("settling time (s)", "peak wheel speed (rad/s)", "momentum drift (N.m.s)", "peak torque (N.m)"):
        assert key in measured
    assert metrics.not_measured(other) == ""
    assert plots.draw({"run": other}).keys() == plots.draw({"run": standard}).keys()


def test_fmus_that_do_not_say_what_they_are_are_known_by_their_variables():
    assert roles.loops(bare(fly(OTHER))) == [Loop("bus", "profile", ("law",), ("wheels",))]


def test_a_result_without_a_description_is_read_by_its_columns():
    assert roles.loops(Result(fly(OTHER).table, {})) == [Loop("bus", "profile", ("law",), ("wheels",))]


def test_a_controller_that_sees_its_plant_through_a_sensor():
    run = fly(OTHER, sensor="eyes")
    assert roles.find(run)["eyes"] == "sensor"
    assert roles.loops(run) == roles.loops(bare(run)) == [Loop("bus", "profile", ("law",), ("wheels",))]


def test_two_plants_have_their_metrics_and_figures_by_name():
    chaser = {role: f"chaser_{role}" for role in STANDARD}
    run, alone = fly(OTHER, chaser), metrics.measure(fly(OTHER))
    assert roles.loops(run)[1] == Loop(
        *(chaser[n] for n in ("plant", "guidance")), ("chaser_controller",), ("chaser_actuators",)
    )
    assert metrics.measure(run) == {f"{plant}: {k}": v for plant in ("bus", "chaser_plant") for k, v in alone.items()}
    figures = plots.draw({"run": run})
    assert {"torque_bus", "torque_chaser_plant", "attitude_error_bus"} <= set(figures)


@pytest.mark.parametrize(
    ("record", "missing"),
    [
        (["bus.*", "profile.*"], ""),
        (
            ["bus.q_BN", "bus.tau_B"],
            "pointing, for profile.q_RN was not recorded; momentum, for bus has no H_N that was recorded",
        ),
        (["bus.H_N"], "pointing, for the attitude of bus was not recorded"),
    ],
)
def test_what_was_not_recorded_is_named(record, missing):
    assert metrics.not_measured(fly(OTHER, record=record)) == missing


def test_a_run_without_a_plant_says_so():
    system = System(name="sum", components={"a": "HarmonicTorque"})
    run = simulate(system, Experiment(stop_time=0.2, communication_step_size=0.1))
    assert metrics.measure(run) == {}
    assert metrics.not_measured(run).startswith("attitude, for no instance is an attitude plant")
