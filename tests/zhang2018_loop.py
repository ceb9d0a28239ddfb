"""The closed loop of zhang2018 as components and connections."""

from components.controllers.euler_tracking import EulerTracking
from components.environment.harmonic_torque import HarmonicTorque
from components.framework import Component
from components.guidance.euler_sinusoid import EulerSinusoid
from components.plants.flexible_spacecraft import FlexibleSpacecraft

CONNECTIONS = [
    ("plant.q_BN", "controller.q_BN"),
    ("plant.omega_BN_B", "controller.omega_BN_B"),
    ("guidance.q_RN", "controller.q_RN"),
    ("guidance.omega_RN_R", "controller.omega_RN_R"),
    ("guidance.omega_dot_RN_R", "controller.omega_dot_RN_R"),
    ("controller.tau_command_B", "plant.tau_B"),
    ("environment.tau_dist_B", "plant.tau_dist_B"),
]
HALF = dict(K=(0.25, 0.05, 0.25), tau_w=0.25, tau_mu=0.25)


def loop(controller: EulerTracking, **plant) -> dict[str, Component]:
    """The components with a controller, and with start values of the plant."""
    return {
        "plant": FlexibleSpacecraft(**plant),
        "controller": controller,
        "guidance": EulerSinusoid(),
        "environment": HarmonicTorque(),
    }
