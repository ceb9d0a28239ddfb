"""The closed loop of geng2012 from its components, for tests."""

import numpy as np

from components.actuators.cmg_cluster import CmgCluster
from components.actuators.cmg_steering import CmgSteering
from components.controllers.integral_sliding_mode import IntegralSlidingMode
from components.environment.harmonic_torque import HarmonicTorque
from components.estimators.modal_observer import ModalObserver
from components.guidance.attitude_step import AttitudeStep
from components.plants.flexible_spacecraft import FlexibleSpacecraft

DEGREE = np.pi / 180
A0 = 1.5e-5  # N m
MOTION = ("q_BN", "omega_BN_B")
REFERENCE = ("q_RN", "omega_RN_R", "omega_dot_RN_R")
CONNECTIONS = [
    *((f"plant.{n}", f"controller.{n}") for n in MOTION),
    *((f"guidance.{n}", f"controller.{n}") for n in REFERENCE),
    ("plant.omega_BN_B", "observer.omega_BN_B"),
    ("actuators.tau_B", "observer.tau_B"),
    ("actuators.h_B", "observer.h_B"),
    ("observer.eta", "controller.eta"),
    ("observer.eta_dot", "controller.eta_dot"),
    ("controller.tau_command_B", "steering.tau_command_B"),
    ("controller.attitude_error", "steering.attitude_error"),
    ("plant.omega_BN_B", "steering.omega_BN_B"),
    ("actuators.gimbal_angle", "steering.gimbal_angle"),
    ("steering.gimbal_rate_command", "actuators.gimbal_rate_command"),
    ("steering.wheel_acceleration_command", "actuators.wheel_acceleration_command"),
    ("actuators.tau_B", "plant.tau_B"),
    ("actuators.h_B", "plant.h_B"),
    ("environment.tau_dist_B", "plant.tau_dist_B"),
]


def start(part, name):
    """The start value of a parameter."""
    return next(v.start for v in part.parameters if v.name == name)


def plant(mismatch=1.2, **values) -> FlexibleSpacecraft:
    """The paper's vehicle at rest, its inertia off by a factor."""
    law = IntegralSlidingMode()
    elastic = {n: start(law, n) for n in ("delta", "Omega", "zeta")}
    rest = dict(J=mismatch * start(law, "J"), q_BN=[1, 0, 0, 0], omega_BN_B=[0, 0, 0])
    return FlexibleSpacecraft(**{"modes": 4, **elastic, **rest, **values})


def loop(observer=None, **law):
    """Components of configuration N."""
    return {
        "guidance": AttitudeStep(),
        "environment": HarmonicTorque(
            bias=[A0, 0, A0], sine=[0, 1.5 * A0, 3 * A0], cosine=[3 * A0, 3 * A0, 0], frequency=-0.0011
        ),
        "controller": IntegralSlidingMode(**law),
        "observer": observer or ModalObserver(),
        "steering": CmgSteering(),
        "actuators": CmgCluster(
            gimbals=2,
            gimbal_axes_B=[[0, 0], [0, 0], [1, 1]],
            rotor_axes_B=[[1, 1], [0, 0], [0, 0]],
            rotor_momentum=15.0,
            gimbal_angle=[np.pi / 4, 5 * np.pi / 4],
        ),
        "plant": plant(),
    }
