"""Thrusters, suspension and sensors of li2014, which names them without a number: all chosen.

Ion thruster along x, as GOCE's: 1 to 20 mN, 2.5 mN/s, 12 uN, 12 uN/sqrt(Hz); micro-thrusters +-0.65 mN; suspension 2e-8
N m; position and attitude in the cage as seen by LISA Pathfinder's; star tracker and gyro assumed; all at 10 Hz.
"""

from typing import Any

from cosim.system import Value


def hardware() -> dict[str, Any]:
    """Return the parameters of thrusters, suspension and sensors."""
    micro = 0.65e-3
    return {
        "actuators.force_lower": Value([1e-3, -micro, -micro], "N"),
        "actuators.force_upper": Value([20e-3, micro, micro], "N"),
        "actuators.force_rate": Value([2.5e-3, 0.0, 0.0], "N/s"),
        "actuators.force_quantum": Value([12e-6, 0.0, 0.0], "N"),
        "actuators.force_noise": Value([12e-6, 0.0, 0.0], "N/Hz(1/2)"),
        "actuators.torque_limit": Value([1e-3] * 3, "N.m"),
        "suspension.torque_limit": Value([2e-8] * 3, "N.m"),
        "sensor.attitude_noise": Value([1e-5] * 3, "rad/Hz(1/2)"),
        "sensor.rate_noise": Value([1e-6] * 3, "rad/s/Hz(1/2)"),
        "cage_sensor.position_noise": Value([2e-9] * 3, "m/Hz(1/2)"),
        "cage_sensor.attitude_noise": Value([150e-9] * 3, "rad/Hz(1/2)"),
        "cage_sensor.filter_time": Value(0.1, "s"),
    }
