"""A vehicle of one's own: two flexible modes, four wheels of which one fails, star tracker, gyro, filter, notch."""

import numpy as np

from cosim import At, Connection, Experiment, System, Value, simulate
from cosim.studies import plots

T = 0.1  # s, sample time of sensors, filter and computer
SPIN_AXES = np.array([[1, 1, -1, -1], [1, -1, -1, 1], [1, 1, 1, 1]]) / np.sqrt(3)  # a pyramid, a column a wheel
NOISE = {
    "angle_random_walk": Value(0.01, "deg/h^(1/2)"),
    "rate_random_walk": Value(0.05, "deg/h^(3/2)"),
    "cross_noise": Value(5, "arcsec"),
    "roll_noise": Value(40, "arcsec"),
}
AFTER_STEP = [  # the target steps after the source, and sees its value at the end of the step
    *(("plant.q_BN", f"{sensor}.q_BN_true") for sensor in ("gyro", "tracker")),
    ("plant.omega_BN_B", "gyro.omega_BN_B_true"),
    ("gyro.omega_BN_B", "filter.omega_BN_B_measured"),
    ("tracker.q_BN", "filter.q_BN_measured"),
    ("tracker.exposure_time", "filter.exposure_time"),
    ("tracker.valid", "filter.valid_measured"),
    *((f"filter.{name}", f"controller.{name}") for name in ("q_BN", "omega_BN_B")),
    *((f"guidance.{name}", f"controller.{name}") for name in ("q_RN", "omega_RN_R", "omega_dot_RN_R")),
    ("controller.tau_command_B", "notch.u"),
    ("notch.y", "delay.u"),
]
system = System(
    name="own_vehicle",
    components={
        "guidance": "Slew",
        "environment": "GravityGradient",
        "gyro": "Gyro",
        "tracker": "StarTracker",
        "filter": "MEKF",
        "controller": "QuaternionFeedback",
        "notch": "Notch:width=3,unit=N.m",
        "delay": "Delay:width=3,unit=N.m",
        "wheels": "ReactionWheels:wheels=4",
        "plant": "FlexibleSpacecraft:modes=2",
    },
    connections=[
        *(Connection(source, target, "after_step") for source, target in AFTER_STEP),
        Connection("delay.y", "wheels.tau_command_B"),
        Connection("wheels.h_B", "plant.h_B"),
        Connection("plant.q_BN", "environment.q_BN"),
        Connection("environment.tau_dist_B", "plant.tau_dist_B"),
    ],
    vehicle={
        "J": Value([[420, 3, -2], [3, 310, 4], [-2, 4, 360]], "kg.m2"),
        "delta": [[7, 0, 1], [0, 6, 1]],
        "Omega": Value([3.7, 3.6], "Hz"),
        "zeta": 0.002,
    },
    parameters={
        "guidance.axis": [0.6, 0.0, 0.8],
        "guidance.angle": Value(60, "deg"),
        "guidance.max_acceleration": Value(0.03, "deg/s2"),
        "controller.bandwidth": Value(0.1, "Hz"),
        "notch.frequency": Value(4, "Hz"),
        **{f"{name}.sample_time": T for name in ("gyro", "tracker", "filter", "delay")},
        **{f"filter.{name}": value for name, value in NOISE.items()},
        **{f"gyro.{name}": value for name, value in NOISE.items() if "walk" in name},
        **{f"tracker.{name}": value for name, value in NOISE.items() if "noise" in name},
        "gyro.integrating": 1,
        "gyro.bias": Value([5, -3, 2], "deg/h"),
        "tracker.samples_per_measurement": 5,  # one each 0.5 s, 0.2 s late
        "tracker.latency": 2 * T,
        "wheels.spin_axes_B": SPIN_AXES,
        "wheels.torque_limit": 0.4,
        "wheels.momentum_limit": 12.0,
    },
    hold_unconnected=True,
)
lost = [At(50.0, {"wheels.health[2]": 0.0}), At(52.0, {"wheels.allocation_weight[2]": 0.0})]  # noticed 2 s later
experiment = Experiment(stop_time=200.0, communication_step_size=0.01, every=10, events=lost)
result = simulate(system, experiment, out="results/own_vehicle", overwrite=True)
print("\n".join(f"{name}: {value}" for name, value in result.metrics.items()))
plots.save(plots.draw({"own vehicle": result}), "results/own_vehicle")
