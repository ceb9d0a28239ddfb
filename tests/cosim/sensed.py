"""A slew on what gyro and star tracker see: four wheels that rub and lag, a filter, quaternion feedback."""

from cosim import Connection, Experiment, System, Value

NOISE = {
    "angle_random_walk": Value(0.02, "deg/h^(1/2)"),
    "rate_random_walk": Value(0.5, "deg/h^(3/2)"),
    "cross_noise": Value(5, "arcsec"),
    "roll_noise": Value(30, "arcsec"),
}
SENSORS = {"gyro": "Gyro", "tracker": "StarTracker", "filter": "MEKF"}
MEASURED = [
    ("plant.omega_BN_B", "gyro.omega_BN_B_true"),
    ("plant.q_BN", "gyro.q_BN_true"),
    ("plant.q_BN", "tracker.q_BN_true"),
    ("gyro.omega_BN_B", "filter.omega_BN_B_measured"),
    ("tracker.q_BN", "filter.q_BN_measured"),
    ("tracker.exposure_time", "filter.exposure_time"),
    ("tracker.valid", "filter.valid_measured"),
]
PLANT = "FlexibleSpacecraft:modes=0"


def after_step(links):
    return [Connection(source, target, "after_step") for source, target in links]


def open_loop(**parameters) -> System:
    """A body that turns freely and is watched."""
    return System(
        name="watched",
        components={"plant": PLANT} | SENSORS,
        connections=after_step(MEASURED),
        parameters={"plant.omega_BN_B": [0.02, -0.03, 0.01], "gyro.integrating": 1} | parameters,
        held={f"plant.{n}": [0, 0, 0] for n in ("tau_B", "h_B", "tau_dist_B")},
    )


def closed_loop(stop: float) -> tuple[System, Experiment]:
    links = [(f"filter.{n}", f"controller.{n}") for n in ("q_BN", "omega_BN_B")]
    links += [(f"guidance.{n}", f"controller.{n}") for n in ("q_RN", "omega_RN_R", "omega_dot_RN_R")]
    system = System(
        name="sensed",
        components={"guidance": "Slew", "controller": "QuaternionFeedback", "wheels": "ReactionWheels:wheels=4"}
        | {"plant": PLANT}
        | SENSORS,
        connections=[
            *after_step(MEASURED + links),
            Connection("controller.tau_command_B", "wheels.tau_command_B"),
            Connection("wheels.h_B", "plant.h_B"),
        ],
        parameters={
            "guidance.angle": Value(60, "deg"),
            "guidance.axis": [0.6, 0.0, 0.8],
            "guidance.start_time": 60.0,
            "wheels.torque_limit": 0.2,
            "wheels.momentum_limit": 4.0,
            "wheels.coulomb_friction": 2e-3,
            "wheels.static_friction": 4e-3,
            "wheels.motor_lag": 0.05,
            "gyro.integrating": 1,
            "gyro.bias": Value([3.0, -2.0, 4.0], "deg/h"),
            "gyro.angle_random_walk": NOISE["angle_random_walk"],
            "gyro.rate_random_walk": NOISE["rate_random_walk"],
            "tracker.cross_noise": NOISE["cross_noise"],
            "tracker.roll_noise": NOISE["roll_noise"],
            "tracker.sample_time": 0.05,
            "tracker.samples_per_measurement": 4,
            "tracker.latency": 0.1,
            **{f"filter.{name}": value for name, value in NOISE.items()},
            "filter.sigma_bias_start": Value(10, "deg/h"),
        },
        held={"plant.tau_B": [0, 0, 0], "plant.tau_dist_B": [0.001, 0, -0.0005]},
    )
    return system, Experiment(stop_time=stop, communication_step_size=0.01)
