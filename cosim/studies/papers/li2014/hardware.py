"""Thrusters, suspension and sensors of li2014, which names them without a number: all chosen.

Ion thruster along x, as GOCE's: 1 to 20 mN, 2.5 mN/s, 12 uN, 12 uN/sqrt(Hz); micro-thrusters +-0.65 mN; suspension 2e-8
N m; position and attitude in the cage as seen by LISA Pathfinder's; star tracker and gyro assumed; all at 10 Hz.
"""

from typing import Any

from components.numbers.li2014 import (
    ATTITUDE_NOISE,
    CAGE_ATTITUDE_NOISE,
    CAGE_POSITION_NOISE,
    FILTER_TIME,
    MICRO,
    RATE_NOISE,
    SUSPENSION_TORQUE,
    THRUST,
    THRUST_NOISE,
    THRUST_QUANTUM,
    THRUST_RATE,
    THRUSTER_TORQUE,
)
from cosim.system import Value


def hardware() -> dict[str, Any]:
    """Return the parameters of thrusters, suspension and sensors."""
    (least, most), micro = THRUST, MICRO
    return {
        "actuators.force_lower": Value([least, -micro, -micro], "N"),
        "actuators.force_upper": Value([most, micro, micro], "N"),
        "actuators.force_rate": Value([THRUST_RATE, 0.0, 0.0], "N/s"),
        "actuators.force_quantum": Value([THRUST_QUANTUM, 0.0, 0.0], "N"),
        "actuators.force_noise": Value([THRUST_NOISE, 0.0, 0.0], "N/Hz^(1/2)"),
        "actuators.f_last": Value([least, 0.0, 0.0], "N"),  # an ion thruster cannot be switched off
        "actuators.f_now": Value([least, 0.0, 0.0], "N"),
        "actuators.torque_limit": Value([THRUSTER_TORQUE] * 3, "N.m"),
        "suspension.torque_limit": Value([SUSPENSION_TORQUE] * 3, "N.m"),
        "sensor.attitude_noise": Value([ATTITUDE_NOISE] * 3, "rad/Hz^(1/2)"),
        "sensor.rate_noise": Value([RATE_NOISE] * 3, "rad/s/Hz^(1/2)"),
        "cage_sensor.position_noise": Value([CAGE_POSITION_NOISE] * 3, "m/Hz^(1/2)"),
        "cage_sensor.attitude_noise": Value([CAGE_ATTITUDE_NOISE] * 3, "rad/Hz^(1/2)"),
        "cage_sensor.filter_time": Value(FILTER_TIME, "s"),
    }
