"""How long a component of n states takes to become a native FMU: a chain of n/2 masses, and all its derivatives.

Beside the time passed stands that of the processor, the compiler's included, which a busy machine does not change much.
"""

import os
import tempfile
import time
from pathlib import Path

import bench
import casadi as ca

from components.framework import Component, Input, Parameter, State
from fmus.export.native.native_fmu import build_native


class Chain(Component):
    """Masses on hardening springs between two walls, damped by the sine of their speeds."""

    masses: int = 50
    stiffness = Parameter(unit="1/s2", start=1.0, doc="stiffness by mass")
    push = Input(unit="m/s2", doc="acceleration of all")
    position = State(unit="m", shape=("masses",), start=0.1, output=True, doc="position")
    speed = State(unit="m/s", shape=("masses",), doc="speed")

    def derivatives(self, t, x, u, p):
        q = x.position
        stretch = ca.vertcat(q[1:], 0) - 2 * q + ca.vertcat(0, q[:-1])
        force = p.stiffness * (stretch + stretch**3) - 0.1 * ca.sin(x.speed)
        return {"position": x.speed, "speed": force + u.push}


def processor() -> float:
    """Seconds that this process and those that it started have used."""
    return sum(os.times()[:4])


def main() -> None:
    rows = []
    with tempfile.TemporaryDirectory() as place:
        for states in (100, 200, 400, 800):
            began, busy = time.perf_counter(), processor()
            build_native(Chain(masses=states // 2), Path(place) / "Chain.fmu")
            passed, used = time.perf_counter() - began, processor() - busy
            rows.append((f"{states} states", passed, "s", None))
            rows.append(("  of the processor", used, "s", 5.0 if states == 800 else None))
    bench.limits("a native FMU of a chain of masses, from the class to the file", rows)


if __name__ == "__main__":
    main()
