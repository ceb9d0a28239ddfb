"""How the systems of li2014 are wired, with and without sensors, thrusters and suspension."""

from cosim.system import Connection


def connect(lvlh: bool, limits: bool) -> list[Connection]:
    """Return the connections: `lvlh`, the reference is the orbit frame; `limits`, with sensors and actuators."""
    return [*_measured(limits), *_common(lvlh), *_commands(limits)]


def connect_design_model() -> list[Connection]:
    """Return the connections of the design model, which has neither orbit nor environment."""
    reference = [Connection(f"guidance.{n}", f"controller.{n}", "after_step") for n in ("q_RN", "omega_RN_R")]
    return [*_measured(False), *reference, *_commands(False)]


def _common(lvlh: bool) -> list[Connection]:
    """Return orbit and reference: at the same instant as the plant."""
    links = [
        Connection("plant.r_N", "environment.r_N", "after_step"),
        Connection("plant.v_N", "environment.v_N", "after_step"),
        Connection("plant.q_SN", "environment.q_BN", "after_step"),
        Connection("environment.f_dist_B", "plant.f_dist_S", "at_point"),
        Connection("environment.tau_dist_B", "plant.tau_dist_S", "at_point"),
        Connection("guidance.q_RN", "controller.q_RN", "after_step"),
        Connection("guidance.omega_RN_R", "controller.omega_RN_R", "after_step"),
    ]
    if lvlh:
        links.append(Connection("plant.r_N", "guidance.r_N", "after_step"))
        links.append(Connection("plant.v_N", "guidance.v_N", "after_step"))
    return links


def _measured(sensors: bool) -> list[Connection]:
    names = ("r_rel", "v_rel", "q_TS", "omega_TS_T", "q_SN", "omega_SN_S")
    if not sensors:
        return [Connection(f"plant.{n}", f"controller.{n}", "after_step") for n in names]
    pairs = [
        ("plant.r_rel", "cage_sensor.r_rel_true"),
        ("plant.q_TS", "cage_sensor.q_TS_true"),
        ("plant.q_SN", "sensor.q_BN_true"),
        ("plant.omega_SN_S", "sensor.omega_BN_B_true"),
        *((f"cage_sensor.{n}", f"controller.{n}") for n in names[:4]),
        ("sensor.q_BN", "controller.q_SN"),
        ("sensor.omega_BN_B", "controller.omega_SN_S"),
    ]
    return [Connection(a, b, "after_step") for a, b in pairs]


def _commands(limits: bool) -> list[Connection]:
    names = ("f_command_S", "tau_command_S", "tau_command_T")
    if not limits:
        return [Connection(f"controller.{n}", f"plant.{n}", "at_point") for n in names]
    return [
        Connection("controller.f_command_S", "actuators.f_command_S", "after_step"),
        Connection("controller.tau_command_S", "actuators.tau_command_S", "after_step"),
        Connection("controller.tau_command_T", "suspension.tau_command_T", "after_step"),
        Connection("actuators.f_S", "plant.f_command_S", "at_point"),
        Connection("actuators.tau_S", "plant.tau_command_S", "at_point"),
        Connection("suspension.tau_T", "plant.tau_command_T", "at_point"),
    ]
