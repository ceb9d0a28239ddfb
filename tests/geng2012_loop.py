"""The closed loop of geng2012 from its components, for tests."""

import numpy as np
from published import as_in, published

from components.framework import Component
from components.numbers.geng2012 import J

COMPENSATED = "geng2012-compensated"
DEGREE = np.pi / 180
MOTION = ("q_BN", "omega_BN_B")
REFERENCE = ("q_RN", "omega_RN_R", "omega_dot_RN_R")
CONNECTIONS = [
    *((f"plant.{n}", f"controller.{n}") for n in MOTION),
    *((f"guidance.{n}", f"controller.{n}") for n in REFERENCE),
    ("plant.omega_BN_B", "observer.omega_BN_B"),
    ("actuators.h_B", "observer.h_B"),
    ("observer.eta", "controller.eta"),
    ("observer.eta_dot", "controller.eta_dot"),
    ("controller.tau_command_B", "steering.tau_command_B"),
    ("controller.attitude_error", "steering.attitude_error"),
    ("plant.omega_BN_B", "steering.omega_BN_B"),
    ("actuators.gimbal_angle", "steering.gimbal_angle"),
    ("steering.gimbal_rate_command", "actuators.gimbal_rate_command"),
    ("steering.wheel_acceleration_command", "actuators.wheel_acceleration_command"),
    ("actuators.h_B", "plant.h_B"),
    ("environment.tau_dist_B", "plant.tau_dist_B"),
]


def start(part, name):
    """The start value of a parameter."""
    return next(v.start for v in part.parameters if v.name == name)


def plant(mismatch=1.2, **values) -> Component:
    """The paper's vehicle at rest, its inertia off by a factor."""
    return as_in(COMPENSATED, "plant")(**({"J": mismatch * np.array(J)} | values))


def loop(observer=None, **law) -> dict[str, Component]:
    """Components of configuration N."""
    found = published(COMPENSATED, controller=law)
    return found if observer is None else found | {"observer": observer}
