"""The closed loop of zhang2018 as components and connections."""

from published import as_in

from components.framework import Component

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


def loop(controller: Component, **plant) -> dict[str, Component]:
    """The components with a controller, and with start values of the plant."""
    of = {name: as_in("zhang2018-ppatc", name) for name in ("plant", "guidance", "environment")}
    return {
        "plant": of["plant"](**plant),
        "controller": controller,
        "guidance": of["guidance"](),
        "environment": of["environment"](),
    }
