"""A slew of a vehicle with modes at 4 Hz, by a computer of 10 Hz whose torque is one sample late."""

from cosim import Connection, Experiment, System, Value

SEEN = (
    "plant.q_BN",
    "plant.omega_BN_B",
    "guidance.q_RN",
    "guidance.omega_RN_R",
    "guidance.omega_dot_RN_R",
)


def notched(depth: float = 0.1) -> tuple[System, Experiment]:
    """Return system and experiment; depth: gain of the notch at 4 Hz, 1: there is none."""
    system = System(
        name="notched",
        components={
            "guidance": "Slew",
            "controller": "QuaternionFeedback",
            "notch": "Notch:width=3,unit=N.m",
            "delay": "Delay:width=3,unit=N.m",
            "plant": "FlexibleSpacecraft:modes=2",
        },
        connections=[
            *(Connection(port, f"controller.{port.split('.')[1]}", "after_step") for port in SEEN),
            Connection("controller.tau_command_B", "notch.u", "ramp"),
            Connection("notch.y", "delay.u", "after_step"),
            Connection("delay.y", "plant.tau_B"),
        ],
        vehicle={"delta": [[7, 0, 0], [0, 6, 0]], "Omega": Value([3.66, 3.62], "Hz"), "zeta": 0.002},
        parameters={
            "guidance.axis": [0.6, 0.8, 0.0],
            "guidance.angle": Value(60, "deg"),
            "guidance.max_rate": Value(4, "deg/s"),
            "guidance.max_acceleration": Value(0.5, "deg/s2"),
            "guidance.smooth": 0,
            "controller.bandwidth": Value(0.3, "Hz"),
            "controller.damping": 0.7,
            "notch.frequency": Value(4, "Hz"),
            "notch.zeta_z": 0.5 * depth,
            "delay.sample_time": 0.1,
        },
        hold_unconnected=True,
    )
    return system, Experiment(stop_time=120.0, communication_step_size=0.005)
