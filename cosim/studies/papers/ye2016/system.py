"""The experiments of ye2016.

D. Ye, Z. Sun, Y. Liu, An adaptive control algorithm for hybrid actuator with installation deviation, J. Harbin Inst.
Tech. 48(11), 2016, 10.11918/j.issn.0367-6234.2016.11.002, section 4. Four gyros in a pyramid, three wheels on the body
axes, all of them installed a little off; the plant has the true axes, the controller the nominal ones.

The paper prints the reference, the initial attitude, Q, alpha, beta, delta and the eigenvalues of A_1. Chosen: the
vehicle, its cluster and the deviations; a diagonal K, a pair of eigenvalues an axis, -0.2 +- 0.2i, -0.3 +- 0.3i and
-0.2 sqrt 2, -0.3 sqrt 2; 800 s. The eigenvalues are printed without their points ("-02 +- 02i"), so that they may be a
tenth of that as well: the slow poles, with which alone its errors come out. alpha_F = 1e5 is its 1e7 for a vehicle and
cluster of ten times the inertia and momentum.
"""

from dataclasses import replace
from typing import Any

import numpy as np

from components.numbers import ye2016 as numbers
from components.numbers.ye2016 import (
    ALPHA_F,
    ALPHA_G,
    BETA_G,
    DELTA_G,
    RATE_AMPLITUDE,
    RATE_PERIOD,
    J,
    pyramid,
)
from cosim.arrays import FloatArray
from cosim.masters.explicit import Explicit
from cosim.masters.iterated import Iterated
from cosim.studies.papers.flight import Flight
from cosim.studies.papers.ye2016 import gains
from cosim.system import Connection, Experiment, System, Value

NONADAPTIVE, ADAPTIVE, PRINTED = "ye2016-nonadaptive", "ye2016-adaptive", "ye2016-adaptive-printed"
NONADAPTIVE_SLOW, ADAPTIVE_SLOW = "ye2016-nonadaptive-slow", "ye2016-adaptive-slow"
SLOW_PRINTED = "ye2016-adaptive-slow-printed"
PLACED, SLOW_PLACED = "ye2016-nonadaptive-placed", "ye2016-nonadaptive-slow-placed"
PERFECT = "ye2016-perfect"
INERTIA, INERTIA_PRINTED = "ye2016-adaptive-inertia", "ye2016-adaptive-inertia-printed"
SERVO, FULL_MODEL = "ye2016-servo", "ye2016-full-model"

ROTOR_MOMENTUM = [numbers.ROTOR_MOMENTUM] * 4  # N m s
WHEEL_INERTIA = [numbers.WHEEL_INERTIA] * 3  # kg m2
WHEEL_SPEED = [100.0, -80.0, 60.0]  # rad/s, at the start
GIMBAL_AXES, ROTOR_AXES = pyramid()
WHEEL_AXES = np.eye(3)

# Deviations, true minus nominal: numpy's default_rng(2016), uniform(-0.05, 0.05), in this order
ROTOR_DEVIATION = np.array(
    [
        [0.046718885009443864, -0.01603241195755587, -0.024433441445945905, -0.009656492149594152],
        [0.019903525447114073, 0.044817483189990445, 0.04155907760776116, 0.0006456761519522125],
        [-0.014395064903486243, -0.019896981921519397, -0.003766601175647491, -0.044992778106010725],
    ]
)
TRANSVERSE_DEVIATION = np.array(
    [
        [0.01417785280155702, -0.022742289825494158, 0.04130065378459341, -0.005939400193840892],
        [-0.04678012229843453, -0.015646108442479392, -0.00428973153969274, -0.046645293780113666],
        [-0.0471252479450504, -0.03449872292606437, -0.014754755402117757, -0.03190119857295074],
    ]
)
WHEEL_DEVIATION = np.array(
    [
        [-0.029511520049558804, 0.020291411343232313, -0.0104587397173758],
        [-0.035294208751712366, -0.007626222982205735, -0.04454452879970312],
        [-0.004223624709510397, 0.029094872836696456, 0.004207560532752161],
    ]
)

# Section 4
ALPHA_F_PRINTED = 1e7  # kg2 m4/s
ALPHA_F_SLOW = 1e2  # kg2 m4/s, chosen for the slow poles: P of these is larger, and with it the gain of (25)

MISMATCH = 1.1  # the law's J over the true one
SERVO_LAG = 0.01  # s, of the gimbals of the full model
STOP_TIME = 800.0  # s
STEP = 0.01  # s
SLOW = 0.1  # the slow poles as a part of the printed ones
SLOW_STEP = 1e-3  # s: the estimates at the end of adaptive-slow, which runs along its projection, need it


def nonadaptive() -> Flight:
    """No adaptation, poles as printed, figures 2-3."""
    return _flight(NONADAPTIVE, alpha_F=0.0, alpha_G=0.0)


def adaptive() -> Flight:
    """Adaptation at the vehicle's own scale (alpha_F 1e5), poles as printed, figures 4-11."""
    return _flight(ADAPTIVE, alpha_F=ALPHA_F)


def adaptive_printed() -> Flight:
    """Adaptation with the printed alpha_F = 1e7, poles as printed, figures 4-11."""
    return _flight(PRINTED, alpha_F=ALPHA_F_PRINTED)


def nonadaptive_slow() -> Flight:
    """No adaptation, poles a tenth of the printed ones, figures 2-3."""
    return _flight(NONADAPTIVE_SLOW, alpha_F=0.0, alpha_G=0.0, K=gains.diagonal(SLOW), step=SLOW_STEP)


def adaptive_slow() -> Flight:
    """Adaptation (alpha_F 1e2), poles a tenth of the printed ones, figures 4-11."""
    return _flight(ADAPTIVE_SLOW, alpha_F=ALPHA_F_SLOW, K=gains.diagonal(SLOW), step=SLOW_STEP)


def adaptive_slow_printed() -> Flight:
    """Adaptation with the printed alpha_F = 1e7, poles a tenth of the printed ones, figures 4-11."""
    return _flight(SLOW_PRINTED, alpha_F=ALPHA_F_PRINTED, K=gains.diagonal(SLOW), step=SLOW_STEP)


def nonadaptive_placed() -> Flight:
    """No adaptation, poles as printed, K with coupled axes (scipy's place_poles)."""
    return _flight(PLACED, alpha_F=0.0, alpha_G=0.0, K=gains.placed())


def nonadaptive_slow_placed() -> Flight:
    """No adaptation, poles a tenth of the printed ones, K with coupled axes (scipy's place_poles)."""
    return _flight(SLOW_PLACED, alpha_F=0.0, alpha_G=0.0, K=gains.placed(SLOW))


def perfect() -> Flight:
    """No adaptation, but the true axes and the true momentum are known from the start."""
    return _flight(PERFECT, alpha_F=0.0, alpha_G=0.0, known=True)


def adaptive_inertia() -> Flight:
    """As ye2016-adaptive with 1.1 times the true inertia in the law, which the abstract says it estimates."""
    return _flight(INERTIA, alpha_F=ALPHA_F, mismatch=MISMATCH)


def adaptive_inertia_printed() -> Flight:
    """As ye2016-adaptive-printed with 1.1 times the true inertia in the law."""
    return _flight(INERTIA_PRINTED, alpha_F=ALPHA_F_PRINTED, mismatch=MISMATCH)


def servo() -> Flight:
    """As ye2016-adaptive with the gimbal servos of ye2016-full-model: what of its difference is theirs."""
    system, experiment = _flight(SERVO, alpha_F=ALPHA_F)
    lag = {"actuators.gimbal_lag": Value(SERVO_LAG, "s"), "actuators.solver.step": Value(SERVO_LAG / 10, "s")}
    return replace(system, parameters=system.parameters | lag), experiment


def full_model() -> Flight:
    """As ye2016-adaptive on the gyros' full model of section 1: gimbal inertia, J', a servo of 10 ms."""
    system, experiment = _flight(FULL_MODEL, alpha_F=ALPHA_F)
    links = [link for link in system.connections if link.target != "plant.h_B"]
    whole = {"plant.J": Value(J, "kg.m2"), "plant.gimbal_lag": Value(SERVO_LAG, "s")}
    inertias = zip(("I_cg", "I_cs", "I_ct", "I_cws"), (*numbers.GYRO_INERTIA, numbers.ROTOR_INERTIA), strict=True)
    whole |= {f"plant.{name}": Value([value] * 4, "kg.m2") for name, value in inertias}
    whole |= {"plant.gimbal_rate": Value([0.0] * 4, "rad/s"), "plant.solver.step": Value(SERVO_LAG / 10, "s")}
    held = {"h_B": [0.0] * 3, "rotor_acceleration_command": [0.0] * 4}
    return replace(
        system,
        components={n: c for n, c in system.components.items() if n != "actuators"} | {"plant": "VscmgSpacecraft"},
        connections=[Connection(_of_plant(k.source), _of_plant(k.target), k.timing) for k in links],
        held=system.held | {f"plant.{name}": value for name, value in held.items()},
        parameters={_of_plant(name): value for name, value in system.parameters.items()} | whole,
    ), experiment


def _of_plant(port: str) -> str:
    """Return a port of the cluster as one of the plant that contains it."""
    return port.replace("actuators.", "plant.")


def unknown_momentum() -> FloatArray:
    """Return what the total momentum is at the start beyond that of the nominal axes, N m s; the body is at rest."""
    return ROTOR_DEVIATION @ ROTOR_MOMENTUM + WHEEL_DEVIATION @ np.multiply(WHEEL_INERTIA, WHEEL_SPEED)


def unknown_axes() -> tuple[FloatArray, FloatArray]:
    """Return the true Theta_cG, a row [t_i0^D, s_i0^D] a gyro, and Theta_wG, a row s_wj^D a wheel."""
    return np.hstack([TRANSVERSE_DEVIATION.T, ROTOR_DEVIATION.T]), WHEEL_DEVIATION.T


def _flight(
    name: str,
    *,
    alpha_F: float,
    alpha_G: float = ALPHA_G,
    K: FloatArray | None = None,
    known: bool = False,
    mismatch: float = 1.0,
    step: float = STEP,
) -> Flight:
    of_gyros, of_wheels = unknown_axes()
    system = System(
        name=name,
        components={
            "guidance": "BodyRateSinusoid",
            "controller": "HybridAdaptive",
            "actuators": "CmgCluster",
            "plant": "FlexibleSpacecraft:modes=0",
        },
        connections=[
            Connection("plant.q_BN", "controller.q_BN", "after_step"),
            Connection("plant.omega_BN_B", "controller.omega_BN_B", "after_step"),
            Connection("guidance.q_RN", "controller.q_RN", "after_step"),
            Connection("guidance.omega_RN_R", "controller.omega_RN_R", "after_step"),
            Connection("guidance.omega_dot_RN_R", "controller.omega_dot_RN_R", "after_step"),
            Connection("actuators.gimbal_angle", "controller.gimbal_angle", "after_step"),
            Connection("actuators.wheel_speed", "controller.wheel_speed", "after_step"),
            Connection("controller.gimbal_rate_command", "actuators.gimbal_rate_command", "at_point"),
            Connection("controller.wheel_acceleration_command", "actuators.wheel_acceleration_command", "at_point"),
            Connection("actuators.h_B", "plant.h_B", "ramp"),
        ],
        held={"plant.tau_B": [0.0, 0.0, 0.0], "plant.tau_dist_B": [0.0, 0.0, 0.0]},
        vehicle={
            "J": Value(J, "kg.m2"),
            "gimbal_axes_B": GIMBAL_AXES,
            "rotor_axes_B": ROTOR_AXES,
            "rotor_momentum": Value(ROTOR_MOMENTUM, "N.m.s"),
            "spin_axes_B": WHEEL_AXES,
            "wheel_inertia": Value(WHEEL_INERTIA, "kg.m2"),
        },
        parameters={
            "plant.q_BN": [1.0, 0.0, 0.0, 0.0],
            "plant.omega_BN_B": Value([0.0, 0.0, 0.0], "rad/s"),
            "actuators.rotor_deviation": ROTOR_DEVIATION,
            "actuators.transverse_deviation": TRANSVERSE_DEVIATION,
            "actuators.spin_deviation": WHEEL_DEVIATION,
            "actuators.gimbal_angle": Value([0.0] * 4, "rad"),
            "actuators.wheel_speed": Value(WHEEL_SPEED, "rad/s"),
            "guidance.q_RN": [1.0, 0.0, 0.0, 0.0],
            "guidance.amplitude": Value([RATE_AMPLITUDE] * 3, "rad/s"),
            "guidance.frequency": Value(2 * np.pi / RATE_PERIOD, "rad/s"),
            "guidance.phase": Value([0.0, 0.0, 0.0], "rad"),
            "guidance.bias": Value([0.0, 0.0, 0.0], "rad/s"),
            **_law(alpha_F, alpha_G, gains.diagonal() if K is None else K),
            "controller.Theta_F": Value(unknown_momentum() if known else np.zeros(3), "N.m.s"),
            "controller.Theta_c": of_gyros if known else np.zeros((4, 6)),
            "controller.Theta_w": of_wheels if known else np.zeros((3, 3)),
            **({} if mismatch == 1.0 else {"controller.J": Value(mismatch * np.array(J), "kg.m2")}),
            # Between two communication points every rate is constant or slow: one internal step is exact enough.
            "*.solver.step": Value(step, "s"),
        },
    )
    # Largest error of the attitude over the adaptive law's whole flight at 10 ms, to an iterated flight at 2.5 ms:
    # 5.8e-9 deg; held 3.3e-5.
    # With slow poles at 1 ms the law passes where slopes do not carry on: explicit with slopes it diverges at 537 s as
    # printed. Iterated it errs by 1.6e-4 deg there, to a flight at 2.5 ms; held, at a quarter of the cost, by 1.1e-3.
    master = Explicit(inputs="smooth", extrapolation=1) if step > SLOW_STEP else Iterated()
    experiment = Experiment(stop_time=STOP_TIME, communication_step_size=step, every=round(0.1 / step), master=master)
    return system, experiment


def _law(alpha_F: float, alpha_G: float, K: FloatArray) -> dict[str, Any]:
    return {
        "controller.k_1": Value(K[:, :3], "1/s2"),
        "controller.k_2": Value(K[:, 3:], "1/s"),
        "controller.q_1": Value(np.eye(3), "1/s2"),
        "controller.q_12": Value(np.zeros((3, 3)), "1/s"),
        "controller.q_2": np.eye(3),
        "controller.alpha_F": Value(alpha_F, "kg2.m4/s"),
        "controller.alpha_G": Value(alpha_G, "s"),
        "controller.b": BETA_G,
        "controller.d": DELTA_G,
        "controller.gimbal_weight": [1.0] * 4,
        "controller.wheel_weight": Value([1.0] * 3, "1/s2"),
        "controller.shadow": 0.0,
    }
