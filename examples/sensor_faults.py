"""Gyro, star tracker and filter on a vehicle at rest; what goes wrong with them stands in sensor_faults.toml.

adcs run sensor_faults.py --fault sensor_faults.toml --plot
"""

from cosim import Connection, Experiment, System, Value

T = 0.1  # s, sample time
GYRO = {"angle_random_walk": Value(0.01, "deg/h^(1/2)"), "rate_random_walk": Value(5, "deg/h^(3/2)")}
TRACKER = {"cross_noise": Value(5, "arcsec"), "roll_noise": Value(40, "arcsec")}
LINKS = [
    ("plant.q_BN", "gyro.q_BN_true"),
    ("plant.q_BN", "tracker.q_BN_true"),
    ("plant.omega_BN_B", "gyro.omega_BN_B_true"),
    ("gyro.omega_BN_B", "filter.omega_BN_B_measured"),
    ("tracker.q_BN", "filter.q_BN_measured"),
    ("tracker.exposure_time", "filter.exposure_time"),
    ("tracker.valid", "filter.valid_measured"),
]


def sensor_faults():
    """Return the system and 400 s of it."""
    system = System(
        name="sensor_faults",
        components={"plant": "FlexibleSpacecraft:modes=0", "gyro": "Gyro", "tracker": "StarTracker", "filter": "MEKF"},
        connections=[Connection(*link, "after_step") for link in LINKS],
        parameters={
            **{f"{name}.sample_time": T for name in ("gyro", "tracker", "filter")},
            **{f"{name}.{key}": value for name in ("gyro", "filter") for key, value in GYRO.items()},
            **{f"{name}.{key}": value for name in ("tracker", "filter") for key, value in TRACKER.items()},
            "gyro.integrating": 1,
            "tracker.samples_per_measurement": 5,
        },
        hold_unconnected=True,
    )
    record = ["*", "filter.P_cross[1,1]", "filter.P_cross[2,2]", "filter.P_cross[3,3]"]
    return system, Experiment(stop_time=400.0, communication_step_size=T, record=record)
