"""What every flight of the table is asked to do: one slew, one disturbance, from one start, judged by one threshold."""

from typing import Any

import numpy as np

from cosim.system import Value

STOP, STEP, EVERY = 400.0, 1e-3, 10  # s, s, rows: every 10th point
THRESHOLD = 0.01  # deg, settled below
START_ERROR = (0.2, 0.15, -0.2)  # deg, rotation vector from reference to body at the start: within PPATC's bounds
STEADY = 50.0  # s, at the end: the window of the steady error
TORQUE_LIMIT = 1.0  # N m: of wheels for a vehicle whose paper has an ideal torque, and what a controller is told of it

TURN: dict[str, Any] = {  # about a skew axis, so that all axes couple; the largest vehicle needs 0.06 N m an axis
    "guidance.axis": [1 / np.sqrt(3)] * 3,
    "guidance.angle": Value(10.0, "deg"),
    "guidance.max_rate": Value(0.15, "deg/s"),
    "guidance.max_acceleration": Value(0.01, "deg/s2"),
    "guidance.start_time": Value(10.0, "s"),
    "guidance.smooth": 1.0,
}
DISTURBANCE: dict[str, Any] = {
    "environment.bias": Value([1e-3, 0.0, 1e-3], "N.m"),
    "environment.sine": Value([0.0, 1e-3, 1e-3], "N.m"),
    "environment.cosine": Value([1e-3, 1e-3, 0.0], "N.m"),
    "environment.frequency": Value(0.0011, "rad/s"),
}

WORDS = (
    "slew: 10 deg about (1, 1, 1)/sqrt(3), at most 0.15 deg/s, smooth, begun after 10 s; start error "
    f"({', '.join(f'{angle:g}' for angle in START_ERROR)}) deg at rest",
    "disturbance: 1e-3 [1 + cos nt, sin nt + cos nt, 1 + sin nt] N m in body axes, n = 0.0011 rad/s",
    f"settled: no component of the error above {THRESHOLD:g} deg any more; steady error: largest of the last "
    f"{STEADY:g} s of {STOP:g} s; step {STEP * 1e3:g} ms",
)
