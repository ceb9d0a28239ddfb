"""The loop of geng2012: which units, how they are connected, and the numbers that all of its experiments have."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from components.numbers.geng2012 import (
    ALPHA,
    ANGLE,
    DEAD_ZONE,
    DISTURBANCE,
    EPSILON,
    FAR,
    GAIN,
    GAMMA,
    GIMBAL_ANGLES,
    HAND_OVER_TIME,
    K_0,
    K_FREQUENCY,
    LAMBDA_0,
    MISMATCH,
    NEAR,
    OMEGA,
    ORBIT_RATE,
    PLANE_TORQUE,
    RATE_LIMIT,
    RHO_0,
    ROTOR_MOMENTUM,
    SURFACE,
    WHEEL_INERTIA,
    WHEEL_TORQUE,
    WIDTH,
    ZETA,
    F,
    J,
    centres,
)
from cosim.masters.explicit import Explicit
from cosim.studies.papers.flight import Flight
from cosim.system import Connection, Experiment, System, Value

STOP_TIME = 100.0  # s


def flight(
    name: str,
    steering: Mapping[str, Any] | None = None,
    observer: Mapping[str, Any] | None = None,
    *,
    network: float = 0.0,
    rho_0: float = RHO_0,
    gamma: float = GAMMA,
    printed_gain: float = 0.0,
    mismatch: float = MISMATCH,
    start: float = 0.0,
    others: Mapping[str, Any] | None = None,
) -> Flight:
    """Return configuration N with a law, and with what differs from it in `steering`, `observer` and `others`.

    mismatch: true J over nominal J; start: of the run, s, the manoeuvre begins at 0.
    """
    law = {"network": network, "constant_gain": Value(rho_0, "N.m"), "gamma_W": gamma, "printed_gain": printed_gain}
    cluster = {"trim_wheels": 1.0, "hand_over": 1.0, **(steering or {})}
    system = System(
        name=name,
        components={
            "guidance": "AttitudeStep",
            "environment": "HarmonicTorque",
            "controller": "IntegralSlidingMode",
            "observer": "ModalObserver",
            "steering": "CmgSteering",
            "actuators": "CmgCluster:gimbals=2",
            "plant": "FlexibleSpacecraft:modes=4",
        },
        connections=_connections(),
        held={"plant.tau_B": [0.0] * 3, "observer.tau_B": [0.0] * 3},
        vehicle={
            "J": Value(J, "kg.m2"),
            "delta": Value(np.transpose(F), "kg^(1/2).m"),
            "Omega": Value(OMEGA, "rad/s"),
            "zeta": ZETA,
            "rotor_momentum": Value([ROTOR_MOMENTUM] * 2, "N.m.s"),
            "spin_axes_B": np.eye(3),
        },
        parameters={
            "*.solver.step": Value(1e-3, "s"),
            "plant.J": Value(mismatch * np.array(J), "kg.m2"),  # the controller does not know
            "plant.q_BN": [1.0, 0.0, 0.0, 0.0],
            "plant.omega_BN_B": Value([0.0, 0.0, 0.0], "rad/s"),
            "guidance.axis": [0.0, 1.0, 0.0],
            "guidance.angle": Value(ANGLE, "deg"),
            "guidance.step_time": start,
            **_disturbance(),
            **_cluster(),
            **_law(),
            **{f"controller.{n}": value for n, value in law.items()},
            **{f"steering.{n}": value for n, value in cluster.items()},
            **{f"observer.{n}": value for n, value in (observer or {}).items()},
            **(others or {}),
        },
    )
    # Largest error of the attitude over compensated's whole flight at 1 ms, to an iterated flight at 1/4 ms: 3.3e-6
    # deg; held 2.7e-3. Where wheels and gyros meet limits and switches no exchange is of its order.
    master = Explicit(inputs="smooth", extrapolation=1)
    experiment = Experiment(
        start_time=start, stop_time=STOP_TIME, communication_step_size=1e-3, every=10, master=master
    )
    return system, experiment


def _connections() -> list[Connection]:
    return [
        Connection("steering.gimbal_rate_command", "actuators.gimbal_rate_command", "at_point"),
        Connection("steering.wheel_acceleration_command", "actuators.wheel_acceleration_command", "at_point"),
        Connection("actuators.h_B", "plant.h_B", "ramp"),
        # A known function of time: its mean over the step is at hand without an iteration, and second order.
        Connection("environment.tau_dist_B", "plant.tau_dist_B", "midpoint"),
        # A ramp: what the observer shows at the end of its step is then that of the end, for the controller's mean.
        Connection("plant.omega_BN_B", "observer.omega_BN_B", "ramp"),
        Connection("actuators.h_B", "observer.h_B", "ramp"),
        Connection("plant.q_BN", "controller.q_BN", "after_step"),
        Connection("plant.omega_BN_B", "controller.omega_BN_B", "after_step"),
        Connection("guidance.q_RN", "controller.q_RN", "after_step"),
        Connection("guidance.omega_RN_R", "controller.omega_RN_R", "after_step"),
        Connection("guidance.omega_dot_RN_R", "controller.omega_dot_RN_R", "after_step"),
        Connection("observer.eta", "controller.eta", "after_step"),
        Connection("observer.eta_dot", "controller.eta_dot", "after_step"),
        Connection("controller.tau_command_B", "steering.tau_command_B", "after_step"),
        Connection("controller.attitude_error", "steering.attitude_error", "after_step"),
        Connection("plant.omega_BN_B", "steering.omega_BN_B", "after_step"),
        Connection("actuators.gimbal_angle", "steering.gimbal_angle", "after_step"),
    ]


def _disturbance() -> dict[str, Any]:
    A0 = DISTURBANCE
    return {
        "environment.bias": Value([A0, 0.0, A0], "N.m"),
        "environment.sine": Value([0.0, 1.5 * A0, 3 * A0], "N.m"),
        "environment.cosine": Value([3 * A0, 3 * A0, 0.0], "N.m"),
        "environment.frequency": Value(ORBIT_RATE, "rad/s"),
    }


def _cluster() -> dict[str, Any]:
    return {
        "actuators.gimbal_axes_B": [[0, 0], [0, 0], [1, 1]],
        "actuators.rotor_axes_B": [[1, 1], [0, 0], [0, 0]],
        "actuators.gimbal_angle": Value(GIMBAL_ANGLES, "rad"),
        "actuators.wheel_speed": Value([0.0, 0.0, 0.0], "rad/s"),
        "*.wheel_inertia": Value([WHEEL_INERTIA] * 3, "kg.m2"),
        "*.gimbal_rate_limit": Value([RATE_LIMIT] * 2, "rad/s"),
        "*.gimbal_dead_zone": Value(DEAD_ZONE, "deg/s"),
        "*.wheel_torque_limit": Value([WHEEL_TORQUE] * 3, "N.m"),
        "steering.plane_torque_limit": Value(PLANE_TORQUE, "N.m"),
        "steering.near": Value(NEAR, "deg"),
        "steering.far": Value(FAR, "deg"),
        "steering.hand_over_time": HAND_OVER_TIME,
        "steering.lambda_0": LAMBDA_0,
        "steering.alpha": ALPHA,
        "steering.k_0": K_0,
        "steering.k_frequency": K_FREQUENCY,
    }


def _law() -> dict[str, Any]:
    states = ("e", "eta", "omega", "eta_dot")
    return {
        **{f"controller.G_{n}": GAIN[n] for n in states},
        **{f"controller.D_{n}": SURFACE[n] for n in states},
        **{f"controller.{n}_centres": rows for n, rows in centres().items()},
        **{f"controller.{n}_width": WIDTH for n in ("angle", "omega", "torque")},
        "controller.epsilon": EPSILON,
    }
