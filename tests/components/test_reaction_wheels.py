"""Reaction wheels: sharing of the torque, limits, lag, friction, failures, momentum, refusals; against Basilisk's."""

import numpy as np
import pytest
from helpers import Point, monolithic
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from components.actuators.reaction_wheels import ReactionWheels
from components.environment.harmonic_torque import HarmonicTorque
from components.mathematics.limits import floored, stopped
from components.plants.flexible_spacecraft import FlexibleSpacecraft

BODY = {"J": np.diag([30.0, 20.0, 25.0]), "modes": 0}


RUBBING = {"coulomb_friction": 2e-3, "static_friction": 5e-3, "stribeck_speed": 0.5, "friction": 1e-4}


def advanced(point: Point, seconds: float) -> np.ndarray:
    """Wheel momenta every millisecond, a column a time."""
    return point.advance(1e-3, round(seconds / 1e-3))[: point.component.structure["wheels"]]


def test_direct_feedthrough():
    table = ReactionWheels().direct_feedthrough
    assert table == {
        "tau_B": (),
        "h_B": (),
        "wheel_speed": (),
        "saturated": ("tau_command_B",),
        "motor_torque": ("tau_command_B",),
    }


@pytest.mark.parametrize("wheels", [3, 4, 6])
def test_the_hub_gets_the_torque_that_is_wanted(wheels):
    """Any number of wheels: h_B' = -tau_command while nothing saturates, with the least torque of the wheels."""
    wanted = np.array([0.03, -0.05, 0.02])
    point = Point(ReactionWheels(wheels=wheels), tau_command_B=wanted)
    A = next(v.start for v in point.component.parameters if v.name == "spin_axes_B")
    motor = point.rates()["wheel_momentum"]
    assert_allclose(A @ motor, -wanted, atol=1e-15)
    assert_allclose(motor, -np.linalg.lstsq(A, wanted, rcond=None)[0], atol=1e-15)
    assert_allclose(np.linalg.norm(A, axis=0), 1, rtol=1e-14)


def test_torque_limit_of_each_wheel():
    point = Point(ReactionWheels(), tau_command_B=[5.0, -0.1, -7.0], torque_limit=[0.2, 0.2, 0.3])
    assert_allclose(point.rates()["wheel_momentum"], [-0.2, 0.1, 0.3])
    assert point.outputs()["saturated"] == 2


def test_momentum_limit_is_kept_and_left_again():
    start = dict(wheel_momentum=[0.99, -0.5, 0.0], momentum_limit=1.0)
    outward = Point(ReactionWheels(), tau_command_B=[-0.2, 0.1, 0.0], **start)
    h = advanced(outward, 1.0)
    assert h[0].max() == 1.0 and h[0, -1] == 1.0
    assert_allclose(h[1, -1], -0.6)
    inward = Point(ReactionWheels(), tau_command_B=[0.2, 0, 0], wheel_momentum=[1.0, 0, 0], momentum_limit=1.0)
    assert inward.outputs()["saturated"] == 1  # by momentum and by torque, one wheel
    assert_allclose(advanced(inward, 1.0)[0, -1], 0.8)


def test_friction_slows_a_wheel_as_an_exponential():
    point = Point(ReactionWheels(), wheel_momentum=[2.0, -1.0, 0.5], friction=0.01, rotor_inertia=0.05)
    assert_allclose(advanced(point, 3.0)[:, -1], np.exp(-0.01 / 0.05 * 3.0) * np.array([2.0, -1.0, 0.5]), rtol=1e-12)
    assert_allclose(point.outputs()["wheel_speed"], [40, -20, 10])


def test_motors_that_lag_follow_as_an_exponential():
    """A step of the command: torque m (1 - e^-t/T), momentum m (t - T (1 - e^-t/T)). RK4: (h/T)^4/120 of T."""
    lag, wanted = 0.2, np.array([0.1, -0.2, 5.0])
    point = Point(ReactionWheels(), tau_command_B=-wanted, motor_lag=lag, torque_limit=0.3)
    limited, t = np.minimum(wanted, 0.3), 1.0
    x = point.advance(1e-3, 1000)[:, -1]
    assert_allclose(x[3:], limited * (1 - np.exp(-t / lag)), rtol=1e-11)
    assert_allclose(x[:3], limited * (t - lag * (1 - np.exp(-t / lag))), rtol=1e-11)
    point.x = x
    assert_allclose(point.outputs()["motor_torque"], x[3:])


def rubbed(h, J_s=0.05):
    """Friction torque of a wheel as its bearing's data sheet has it: peak near the Stribeck speed, then Coulomb."""
    W, f = h / J_s, RUBBING
    hump = (f["static_friction"] - f["coulomb_friction"]) * W / f["stribeck_speed"]
    hump = hump * np.exp(0.5 - 0.5 * (W / f["stribeck_speed"]) ** 2)
    return hump + f["coulomb_friction"] * np.tanh(W / (f["stribeck_speed"] / 10)) + f["friction"] * W


def test_friction_against_scipy():
    """A wheel that breaks away, one that coasts through zero against its motor, one that only creeps."""
    motor, start = np.array([8e-3, -6e-3, 4e-3]), np.array([0.0, 0.02, 0.0])
    point = Point(ReactionWheels(), tau_command_B=-motor, wheel_momentum=start, **RUBBING)
    t = np.linspace(0, 60, 61)
    expected = solve_ivp(lambda _, h: motor - rubbed(h), (0, 60), start, "DOP853", t, rtol=1e-12, atol=1e-15).y
    found = np.column_stack([start, advanced(point, 60.0)[:, 999::1000]])
    # RK4 at a decay rate of at most 10 f_c / (J_s b) + e^1/2 (f_s - f_c) / (J_s b) = 1/s: (1 ms)^4 / 120 of it
    assert_allclose(found, expected, rtol=1e-11, atol=1e-14)
    speed = found[:, -1] / 0.05
    assert speed[0] > 1.5 and speed[1] < -0.5  # broke away; through zero and away
    assert 0 < speed[2] < 0.5 and abs(motor[2] - rubbed(found[2, -1])) < 1e-6  # creeps where friction balances it


def test_coulomb_friction_stops_a_wheel_in_its_time():
    """Far above the Stribeck speed h' = -f_c: a straight line; below a tenth of it an exponential to rest."""
    point = Point(ReactionWheels(), wheel_momentum=[0.1, -0.1, 0.05], coulomb_friction=0.01, stribeck_speed=0.1)
    h = advanced(point, 20.0)
    assert_allclose(h[:, 3999], [0.06, -0.06, 0.01], rtol=1e-10)  # after 4 s: 12 e-folds of tanh above 0.1 rad/s
    assert np.abs(h[:, -1]).max() < 1e-30
    assert (np.diff(np.abs(h), axis=1) <= 0).all()


def test_static_friction_below_coulombs_counts_as_that():
    one, other = (
        advanced(Point(ReactionWheels(), wheel_momentum=[0.1, 0, 0], coulomb_friction=0.01, static_friction=f), 1.0)
        for f in (0.0, 0.01)
    )
    assert (one == other).all()


def test_a_failed_wheel_gives_no_torque_and_rubs():
    point = Point(ReactionWheels(), tau_command_B=[-0.1, -0.1, -0.1], health=[1, 0, 0.4], wheel_momentum=1.0, **RUBBING)
    assert_allclose(point.outputs()["motor_torque"], [0.1, 0, 0.04], rtol=1e-15)
    assert_allclose(point.rates()["wheel_momentum"], [0.1, 0, 0.04] - rubbed(1.0), rtol=1e-14)


def test_allocation_misses_a_failed_wheel_until_its_weight_is_zero():
    """Four wheels: unaware, 3/4 of the torque along the failed wheel's axis is missing; aware, none."""
    wanted, health = np.array([0.03, -0.05, 0.02]), np.array([1.0, 0, 1, 1])
    part = ReactionWheels(wheels=4)
    A = next(v.start for v in part.parameters if v.name == "spin_axes_B")
    unaware = -A @ Point(part, tau_command_B=wanted, health=health).outputs()["motor_torque"]
    assert_allclose(unaware, wanted - 0.75 * A[:, 1] * (A[:, 1] @ wanted), atol=1e-16)
    aware = Point(part, tau_command_B=wanted, health=health, allocation_weight=health)
    assert_allclose(-A @ aware.outputs()["motor_torque"], wanted, atol=1e-15)
    assert aware.outputs()["motor_torque"][1] == 0


def test_weights_share_the_torque():
    """The least sum of m_i^2 / weight_i, by its Lagrange multipliers; three equal wheels need no weights."""
    wanted, weight = np.array([0.03, -0.05, 0.02]), np.array([1.0, 0.5, 2.0, 1.0])
    part = ReactionWheels(wheels=4)
    A = next(v.start for v in part.parameters if v.name == "spin_axes_B")
    system = np.block([[np.diag(1 / weight), A.T], [A, np.zeros((3, 3))]])
    expected = np.linalg.solve(system, np.concatenate([np.zeros(4), -wanted]))[:4]
    point = Point(part, tau_command_B=wanted, allocation_weight=weight)
    assert_allclose(point.outputs()["motor_torque"], expected, rtol=1e-13)


def test_two_wheels_that_are_left_give_the_torque_in_their_plane():
    """To 1e-6, the singularity-robust share; not 0, and not infinite."""
    point = Point(ReactionWheels(), tau_command_B=[0.1, 0.2, 0.3], allocation_weight=[1, 0, 1])
    assert_allclose(point.outputs()["motor_torque"], [-0.1, 0, -0.3], rtol=2e-6)
    assert point.violated() == []


def test_momentum_of_body_and_wheels_is_kept():
    """One ODE: wheels that saturate, lag, rub and fail keep the total inertial momentum."""
    components = {
        "command": HarmonicTorque(bias=[0.0, 0.0, 0.0], sine=[0.3, -0.2, 0.25], cosine=[0.1, 0.2, -0.3], frequency=0.3),
        "wheels": ReactionWheels(
            wheels=4,
            torque_limit=0.15,
            wheel_momentum=[0.5, -1.0, 0.2, 0.1],
            motor_lag=0.2,
            health=[1, 0, 0.5, 1],
            **RUBBING,
        ),
        "body": FlexibleSpacecraft(**BODY, omega_BN_B=[0.05, -0.03, 0.02]),
    }
    connections = [("command.tau_dist_B", "wheels.tau_command_B"), ("wheels.h_B", "body.h_B")]
    _, x, y = monolithic(components, connections, 30.0, np.linspace(0, 30, 61), rtol=1e-11)
    turned = Rotation.from_quat(x["body.q_BN"], scalar_first=True)
    H = turned.apply(y["body.omega_BN_B"] @ BODY["J"] + y["wheels.h_B"])
    assert np.abs(H - H[0]).max() < 1e-8 and np.abs(H - y["body.H_N"]).max() < 1e-8
    assert np.abs(x["wheels.wheel_momentum"] - x["wheels.wheel_momentum"][0]).max() > 0.3
    assert y["wheels.saturated"].max() > 0


def test_rates_at_a_limit_lead_inwards_only():
    assert [float(stopped(v, r, 2)) for v, r in ((1, 5), (2, 5), (2, -5), (-2, -5), (-2, 5))] == [5, 0, -5, 0, 5]
    assert [float(floored(v, r, 2)) for v, r in ((3, -1), (2, -1), (1, -1), (1, 1))] == [-1, 0, 0, 1]


REFUSALS = {
    "length": (
        {"spin_axes_B": [[1, 0, 0], [0, 1.1, 0], [0, 0, 1]]},
        ["axis 2 of spin_axes_B has length 1.1", "a unit vector"],
    ),
    "plane": (
        {"spin_axes_B": [[1, 0, 0.6], [0, 1, 0.8], [0, 0, 0]]},
        ["spin_axes_B do not span three dimensions", "smallest eigenvalue"],
    ),
    "torque": ({"torque_limit": [0.2, -0.2, 0.2]}, ["torque_limit[2] = -0.2 N.m: it must be positive"]),
    "momentum": ({"momentum_limit": 0.0}, ["momentum_limit[1] = 0 N.m.s: it must be positive"]),
    "rotor": ({"rotor_inertia": [0.1, 0.1, 0.0]}, ["rotor_inertia[3] = 0 kg.m2: it must be positive"]),
    "coulomb": ({"coulomb_friction": -1e-3}, ["coulomb_friction[1] = -0.001 N.m: it must not be negative"]),
    "static": ({"static_friction": -1e-3}, ["static_friction[1] = -0.001 N.m: it must not be negative"]),
    "stribeck": ({"stribeck_speed": 0}, ["stribeck_speed[1] = 0 rad/s: it must be positive"]),
    "steep": (
        {"solver.step": 1e-3, "coulomb_friction": [0, 0.1, 0], "stribeck_speed": 5e-3},
        [
            "friction of wheel 2 is too steep at rest for solver.step = 0.001 s: it needs 0.000695 s or less",
            "0.005 rad/s.",
        ],
    ),
    "lag": (
        {"solver.step": 1e-3, "motor_lag": 1e-4},
        ["motor_lag = 0.0001 s: it must be 0 or at least half the internal step, solver.step = 0.001 s."],
    ),
    "sick": ({"health": [1, 1, -0.1]}, ["health[3] = -0.1: it must not be negative"]),
    "strong": ({"health": [1, 1.1, 1]}, ["health[2] = 1.1: it must not be above 1, the whole torque."]),
    "weight": ({"allocation_weight": [1, -1, 1]}, ["allocation_weight[2] = -1: it must not be negative"]),
    "friction": ({"friction": -1e-3}, ["friction[1] = -0.001 N.m.s/rad: it must not be negative"]),
    "beyond": (
        {"wheel_momentum": [0, -4.0, 0], "momentum_limit": 3.0},
        ["wheel_momentum[2] = -4 N.m.s at the start is beyond momentum_limit[2] = 3 N.m.s"],
    ),
}


@pytest.mark.parametrize("case", REFUSALS)
def test_refusals(case):
    values, words = REFUSALS[case]
    messages = Point(ReactionWheels(), **values).violated()
    assert any(all(word in message for word in words) for message in messages), messages


def test_fewer_than_three_wheels_do_not_span():
    assert any("do not span" in message for message in Point(ReactionWheels(wheels=2)).violated())


def basilisk(J, step, stop, torques, wheels, **state):
    """Times, body rates, wheel speeds and attitudes of a rigid body with balanced wheels, flown in Basilisk by RK4."""
    pytest.importorskip("Basilisk")
    from Basilisk.architecture import messaging
    from Basilisk.simulation import reactionWheelStateEffector, spacecraft
    from Basilisk.utilities import SimulationBaseClass, macros, simIncludeRW

    sim = SimulationBaseClass.SimBaseClass()
    sim.CreateNewProcess("process").addTask(sim.CreateNewTask("task", macros.sec2nano(step)))
    body, effector = spacecraft.Spacecraft(), reactionWheelStateEffector.ReactionWheelStateEffector()
    body.hub.mHub, body.hub.IHubPntBc_B = 100.0, np.asarray(J).tolist()
    body.hub.omega_BN_BInit = [[w] for w in state.get("omega", np.zeros(3))]
    effector.setMaxWheelAcceleration(1e30)
    factory = simIncludeRW.rwFactory()
    for axis, values in wheels:
        rw = factory.create("custom", axis, Js=values["Js"], useMaxTorque=False)
        for name, value in ({"u_max": -1.0, "Omega_max": -1.0} | values).items():
            setattr(rw, name, value)
    factory.addToSpacecraft("wheels", effector, body)
    command = messaging.ArrayMotorTorqueMsgPayload()
    command.motorTorque = list(torques)
    message = messaging.ArrayMotorTorqueMsg().write(command)
    effector.rwMotorCmdInMsg.subscribeTo(message)
    for model in (effector, body):
        sim.AddModelToTask("task", model)
    recorders = [body.scStateOutMsg.recorder(), effector.rwSpeedOutMsg.recorder()]
    for recorder in recorders:
        sim.AddModelToTask("task", recorder)
    sim.InitializeSimulation()
    sim.ConfigureStopTime(macros.sec2nano(stop))
    sim.ExecuteSimulation()
    states, speeds = recorders
    return states.omega_BN_B, speeds.wheelSpeeds[:, : len(wheels)], Rotation.from_mrp(states.sigma_BN)


@pytest.mark.peers
def test_basilisk_friction_of_a_wheel_that_starts():
    """On a hub that does not move (1e15 kg m2), both by RK4 at 10 ms. Its limit cycle guard is for below 1e-9 rad/s."""
    pytest.importorskip("Basilisk")
    f, J_s, motor = RUBBING, 0.05, 8e-3
    friction = dict(
        Js=J_s,
        fCoulomb=f["coulomb_friction"],
        fStatic=f["static_friction"],
        betaStatic=f["stribeck_speed"],
        cViscous=f["friction"],
        omegaLimitCycle=1e-9,
    )
    _, speed, _ = basilisk(1e15 * np.eye(3), 0.01, 10.0, [motor], [([1, 0, 0], friction)])
    point = Point(ReactionWheels(), tau_command_B=[-motor, 0, 0], **RUBBING)
    found = point.advance(0.01, 1000)[0] / J_s
    late = len(speed) - 1001  # rows before the command acts
    assert_allclose(found, speed[1 + late :, 0], rtol=1e-9)
    assert found[-1] > 0.5


@pytest.mark.peers
def test_basilisk_momentum_of_body_and_wheels():
    """Wheels so light that to turn them with the body (J_s / J = 1e-12) takes nothing: then the equations are equal."""
    pytest.importorskip("Basilisk")
    J, omega, motor = np.diag([30.0, 20.0, 25.0]), [0.05, -0.03, 0.02], np.array([0.05, -0.04, 0.06])
    J_s, stop, step = 1e-11, 20.0, 0.01
    values = [(list(axis), dict(Js=J_s, betaStatic=-1.0)) for axis in np.eye(3)]
    rate, speed, attitude = basilisk(J, step, stop, motor, values, omega=omega)
    components = {
        "command": HarmonicTorque(bias=-motor, sine=[0.0] * 3, cosine=[0.0] * 3, frequency=0.3),
        "wheels": ReactionWheels(rotor_inertia=J_s),
        "body": FlexibleSpacecraft(modes=0, J=J, omega_BN_B=omega),
    }
    connections = [("command.tau_dist_B", "wheels.tau_command_B"), ("wheels.h_B", "body.h_B")]
    late = len(speed) - round(stop / step) - 1
    t = step * np.arange(0, round(stop / step) + 1, 100)
    _, x, y = monolithic(components, connections, stop, t, rtol=1e-12)
    rate, speed, attitude = rate[late::100], speed[late::100], attitude[late::100]
    assert_allclose(y["wheels.wheel_speed"], speed, rtol=1e-9)
    assert_allclose(y["body.omega_BN_B"], rate, atol=1e-9 * np.abs(rate).max())
    turned = Rotation.from_quat(x["body.q_BN"], scalar_first=True)
    assert (attitude.inv() * turned).magnitude().max() < 1e-9
    assert np.abs(rate[-1] - rate[0]).max() > 0.02
