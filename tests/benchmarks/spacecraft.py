"""The same spacecraft in Basilisk and here: hub, four wheels, MRP feedback, a fixed reference, RK4 at 10 ms inside.

    tau_command = -K sigma_BR - P omega_BR_B, held from t_k to t_k+1                              (1)

Both have the torque of the state at t_k act up to t_k+1, and integrate by the same Runge-Kutta with one inner step a
communication step; rotors are so light (1e-12 of J) that to turn them with the hub takes nothing, which Basilisk has in
its motor equation and this project in J. Equations are equal, so the flights may differ by the error of RK4 alone: one
integrates MRP, rate and wheel speeds, the other a quaternion and momenta. The judge of both is scipy's DOP853 of these
equations, the torque held as well. Heavier rotors would differ by their part of J: Basilisk's motor torque turns a
rotor with the hub, here it changes its speed relative to the hub.
"""

import json
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from statistics import median
from typing import Any

import apart
import bench
import numpy as np
from apart import Interpreters, Missing
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from components.framework import AttitudeController, Component, Parameter
from components.mathematics import mrp, quaternion
from cosim import Connection, Experiment, Library, Result, System, prepare
from cosim.flights import Prepared
from fmus import build


class MRPFeedback(Component):
    """(1), the short way."""

    ports = AttitudeController
    K = Parameter(unit="N.m", start=3.5, doc="stiffness")
    P = Parameter(unit="N.m.s/rad", start=30.0, doc="damping")

    def outputs(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        q_BR = quaternion.error(u.q_BN, u.q_RN)
        rate = u.omega_BN_B - quaternion.dcm(q_BR) @ u.omega_RN_R
        return {
            "tau_command_B": -p.K * mrp.from_quaternion(q_BR) - p.P * rate,  # (1)
            "attitude_error": quaternion.rotation_vector(q_BR),
        }


@dataclass(frozen=True)
class Spacecraft:
    """Numbers in SI; `spin_axes_B` a column a wheel. A row of a flight: sigma_BN, omega_BN_B, wheel momenta."""

    mass: float = 750.0
    J: tuple = ((900.0, 0, 0), (0, 800.0, 0), (0, 0, 600.0))
    spin_axes_B: tuple = tuple(map(tuple, np.array([[1, 1, -1, -1], [1, -1, 1, -1], [1, -1, -1, 1]]) / np.sqrt(3)))
    rotor_inertia: float = 1e-9
    wheel_momentum: tuple = (8.0, -5.0, 3.0, 6.0)
    sigma_BN: tuple = (0.1, 0.2, -0.3)
    omega_BN_B: tuple = (0.001, -0.01, 0.03)
    K: float = 3.5
    P: float = 30.0
    step: float = 0.01
    stop: float = 100.0
    samples: int = 20


SETUPS = 50
"""Flights of one step, of which the least counts; Basilisk's runner takes 20."""


def system(craft: Spacecraft, folder: Path) -> System:
    q_BN = Rotation.from_mrp(craft.sigma_BN).as_quat(scalar_first=True)
    seen = ["plant.q_BN", "plant.omega_BN_B", "guidance.q_RN", "guidance.omega_RN_R", "guidance.omega_dot_RN_R"]
    return System(
        name="spacecraft",
        components={
            "guidance": "AttitudeStep",
            "controller": str(build(MRPFeedback(), folder / "MRPFeedback.fmu")),
            "wheels": "ReactionWheels:wheels=4",
            "plant": "FlexibleSpacecraft:modes=0",
        },
        connections=[
            *(Connection(port, f"controller.{port.split('.')[1]}", "after_step") for port in seen),
            Connection("controller.tau_command_B", "wheels.tau_command_B"),
            Connection("wheels.h_B", "plant.h_B"),
        ],
        vehicle={"J": craft.J},
        parameters={
            "plant.q_BN": q_BN,
            "plant.omega_BN_B": craft.omega_BN_B,
            "wheels.spin_axes_B": craft.spin_axes_B,
            "wheels.rotor_inertia": [craft.rotor_inertia] * 4,
            "wheels.wheel_momentum": craft.wheel_momentum,
            "controller.K": craft.K,
            "controller.P": craft.P,
            "plant.solver.step": craft.step,
            "wheels.solver.step": craft.step,
        },
        hold_unconnected=True,
    )


def cpu(call: Callable[[], Any]) -> tuple[float, Any]:
    began = time.process_time()
    given = call()
    return time.process_time() - began, given


def ours(prepared: Prepared, craft: Spacecraft, record: bool) -> dict[str, Any]:
    """CPU seconds of the steps and of a further flight's set-up, and the rows, of the kernel."""
    sample = round(craft.stop / craft.step / craft.samples)
    names = ["plant.q_BN", "plant.omega_BN_B", "wheels.wheel_momentum"]
    recorded = [*names, "controller.attitude_error", "wheels.wheel_speed", "wheels.motor_torque"]
    whole = Experiment(
        stop_time=craft.stop,
        communication_step_size=craft.step,
        every=1 if record else sample,
        record=tuple(recorded if record else names),
    )
    short = replace(whole, stop_time=craft.step, every=1)
    prepared.fly(short)
    built = min(cpu(lambda: prepared.fly(short))[0] for _ in range(SETUPS))
    seconds, result = min((cpu(lambda: prepared.fly(whole)) for _ in range(3)), key=lambda flown: flown[0])
    assert result.info["loop"]["name"] == "kernel", result.info["loop"]
    return {"seconds": seconds - built, "built": built, "rows": rows(result, sample if record else 1, names)}


def rows(result: Result, every: int, names: list[str]) -> np.ndarray:
    q, w, h = (result[name][every::every] for name in names)
    return np.column_stack([Rotation.from_quat(q, scalar_first=True).as_mrp(), w, h])


def exact(craft: Spacecraft) -> np.ndarray:
    """The same by DOP853, step by step, in this function's own words: hub momentum and wheel momenta."""
    J, A = np.array(craft.J), np.array(craft.spin_axes_B)
    share = np.linalg.pinv(A)

    def rates(_: float, x: np.ndarray, motor: np.ndarray) -> np.ndarray:
        q, w, h = x[:4], x[4:7], x[7:]
        q_dot = 0.5 * np.concatenate([[-q[1:] @ w], q[0] * w + np.cross(q[1:], w)])
        return np.concatenate([q_dot, np.linalg.solve(J, -A @ motor - np.cross(w, J @ w + A @ h)), motor])

    q = Rotation.from_mrp(craft.sigma_BN).as_quat(scalar_first=True)
    x, found = np.concatenate([q, craft.omega_BN_B, craft.wheel_momentum]), []
    steps = round(craft.stop / craft.step)
    for k in range(1, steps + 1):
        sigma = Rotation.from_quat(x[:4], scalar_first=True).as_mrp()
        motor = share @ (craft.K * sigma + craft.P * x[4:7])
        x = solve_ivp(rates, (0, craft.step), x, "DOP853", args=(motor,), rtol=1e-13, atol=1e-15).y[:, -1]
        if k % (steps // craft.samples) == 0:
            found.append([*Rotation.from_quat(x[:4], scalar_first=True).as_mrp(), *x[4:]])
    return np.array(found)


def off(one: np.ndarray, other: np.ndarray) -> tuple[float, float, float]:
    """The largest differences: attitude in deg, rate in rad/s, wheel momentum in N m s."""
    turned = Rotation.from_mrp(one[:, :3]).inv() * Rotation.from_mrp(other[:, :3])
    rest = np.abs(one - other)
    return float(np.degrees(turned.magnitude().max())), float(rest[:, 3:6].max()), float(rest[:, 6:].max())


def main(folder: Path, rounds: int, pythons: Interpreters) -> list[tuple[str, str, str, str]]:
    """Print the comparison; return the budgets: what, measured, budget, verdict."""
    craft, described = Spacecraft(), folder / "spacecraft.json"
    described.write_text(json.dumps(asdict(craft)))
    steps = craft.stop / craft.step
    print(f"\nhub, four wheels, MRP feedback: {craft.stop:g} s, RK4 at {craft.step * 1e3:g} ms on both sides")
    flown: dict[tuple[str, bool], list[dict[str, Any]]] = {}
    with prepare(system(craft, folder), Library("native")) as prepared:
        try:
            for _ in range(rounds):
                for record in (False, True):
                    told = [str(described), str(int(record))]
                    theirs = apart.run(pythons.of("basilisk"), "basilisk_flight.py", told, folder)
                    flown.setdefault(("Basilisk", record), []).append(theirs)
                    flown.setdefault(("ours", record), []).append(ours(prepared, craft, record))
        except Missing as why:
            print(f"without Basilisk: {why}")
            return []

    def us(who: str, record: bool) -> list[float]:
        return [f["seconds"] / steps * 1e6 for f in flown[who, record]]

    def setup(who: str, what: str) -> list[float]:
        return [f[what] * 1e3 for f in flown[who, False]]

    table = [("", "Basilisk", "ours", "Basilisk by ours")]
    for record, what in ((False, "a step, us of CPU"), (True, "every step recorded")):
        them, us_ = us("Basilisk", record), us("ours", record)
        table.append((what, f"{median(them):.3g}", f"{median(us_):.3g}", f"{bench.ratio(them, us_):.3g}"))
    new, again, own = setup("Basilisk", "built"), setup("Basilisk", "initialized"), setup("ours", "built")
    table.append(("set-up of a further flight, ms of CPU", f"{median(new):.3g}", f"{median(own):.3g}", ""))
    table.append(("the simulation that there is, initialized again", f"{median(again):.3g}", "", ""))
    bench.table(table)
    reference = exact(craft)
    them, us_ = (np.array(flown[who, False][0]["rows"]) for who in ("Basilisk", "ours"))
    table = [("largest difference", "attitude deg", "rate rad/s", "momentum N.m.s")]
    for what, pair in (
        ("Basilisk to ours", (them, us_)),
        ("Basilisk to DOP853", (them, reference)),
        ("ours to DOP853", (us_, reference)),
    ):
        table.append((what, *(f"{d:.1e}" for d in off(*pair))))
    bench.table(table)
    return [
        bench.verdict("Basilisk by ours: a step", bench.ratio(us("Basilisk", False), us("ours", False)), ">=", 8.0),
        bench.verdict("set-up of a further flight, ms", median(own), "<=", 10.0),
        bench.verdict("ours by Basilisk: that set-up", bench.ratio(own, new), "<=", 1.0),
    ]
