"""A wheel that gives half its torque from 50 s on, under a steady disturbance: the error about its axis doubles."""

import numpy as np

from cosim import Connection, Experiment, Fault, Iterated, System, Value, simulate

DISTURBANCE = 2e-3  # N.m, about each axis
system = System(
    name="wheel_at_half",
    components={
        "controller": "QuaternionFeedback",
        "wheels": "ReactionWheels:wheels=3",
        "plant": "FlexibleSpacecraft:modes=0",
    },
    connections=[
        Connection("plant.q_BN", "controller.q_BN"),
        Connection("plant.omega_BN_B", "controller.omega_BN_B"),
        Connection("controller.tau_command_B", "wheels.tau_command_B"),
        Connection("wheels.h_B", "plant.h_B"),
    ],
    vehicle={"J": Value([[300, 0, 0], [0, 200, 0], [0, 0, 250]], "kg.m2")},
    parameters={
        "wheels.spin_axes_B": np.eye(3),
        "controller.bandwidth": Value(0.2, "rad/s"),
        "controller.damping": 0.7,
        "controller.gyroscopic": 0.0,
    },
    held={"plant.tau_dist_B": [DISTURBANCE] * 3},
    hold_unconnected=True,
)
half = Fault("parameter", "wheels.health[2]", 0.5, start=50.0)
experiment = Experiment(stop_time=150.0, communication_step_size=0.1, master=Iterated(), faults=[half])
result = simulate(system, experiment, out="results/wheel_at_half", overwrite=True)
error = 2e3 * result["plant.q_BN"][:, 1:]
for t in (50.0, 150.0):
    print(f"error at {t:g} s, about x, y, z (mrad):", *np.round(error[result.time == t][0], 4))
