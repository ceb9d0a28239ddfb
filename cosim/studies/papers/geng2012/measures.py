"""What decides the claims of geng2012: figures of one run, or of a run and one that it is compared with.

The error is the rotation vector from reference to body, computed from the plant's and the guidance's attitude; errors,
rates and modal coordinates are compared component by component. The manoeuvre begins at 0 s.
"""

import numpy as np

from components.numbers.geng2012 import GIMBAL_ANGLES
from cosim.arrays import FloatArray
from cosim.results.result import Result
from cosim.studies.metrics import attitude_error, settling_time
from cosim.studies.papers.claims import Measured, format_all, per_axis, window
from cosim.studies.papers.geng2012 import surface
from cosim.studies.papers.geng2012.loop import STOP_TIME

POINTING, RATE, STEADY_RATE = 0.1, 0.1, 0.02  # deg, deg/s, deg/s
SAVED = 10.0  # s
SINGULAR = 0.01  # det below which gyros, or the matrix that is inverted, are called singular
SETTLED_RHO = 0.01  # N m, the paper's
LEFT = 0.9  # of a modal coordinate, what counts as suppressed
NO_TORQUE, ARRIVED = 1e-9, 1e-9  # N m, rad
SAME = 1.0  # s


def settled(run: Result, threshold: float = POINTING) -> float:
    """Return the last time at which a component of the error exceeds the threshold (deg), infinite if at the end."""
    error = attitude_error(run)
    if error is None:
        return np.inf
    time = settling_time(run.time, error, threshold)
    return np.inf if time is None else time


def largest_error(run: Result, begin: float) -> FloatArray:
    """Return the largest size of each component of the error from a time on, deg."""
    error = attitude_error(run)
    return np.full(3, np.inf) if error is None else np.max(np.abs(error[window(run, begin)]), axis=0)


def largest_rate(run: Result, begin: float) -> FloatArray:
    """Return the largest size of each component of the body rate from a time on, deg/s."""
    return np.degrees(np.max(np.abs(run["plant.omega_BN_B"][window(run, begin)]), axis=0))


def reached_without(run: Result) -> Measured:
    """Pointing and rate from 50 s on."""
    errors, rates = largest_error(run, 50.0), largest_rate(run, 50.0)
    holds = per_axis(errors, lambda e: e <= POINTING, "pointing") | per_axis(rates, lambda w: w <= RATE, "rate")
    return Measured(f"0.1 deg {_seconds(settled(run))}, {np.max(rates):.3f} deg/s from 50 s on", holds)


def pointed(run: Result) -> Measured:
    """Pointing from 40 s on."""
    errors = largest_error(run, 40.0)
    text = f"0.1 deg {_seconds(settled(run))}, {np.max(errors):.2g} deg from 40 s on"
    return Measured(text, per_axis(errors, lambda e: e <= POINTING))


def stable(run: Result) -> Measured:
    """Rate from 40 s on."""
    rates = largest_rate(run, 40.0)
    return Measured(f"{np.max(rates):.2g} deg/s", per_axis(rates, lambda w: w <= STEADY_RATE))


def shorter(run: Result, other: Result) -> Measured:
    """Settling time against that of another law."""
    here, there = settled(run), settled(other)
    holds = bool(np.isfinite(here)) and here <= there - SAVED
    return Measured(f"{_seconds(there)} -> {_seconds(here)}", {"10 s": holds})


def more_precise(run: Result, other: Result) -> Measured:
    """Pointing and rate from 50 s on against those of another law."""
    error, rate = ([float(np.max(of(r, 50.0))) for r in (run, other)] for of in (largest_error, largest_rate))
    text = f"{error[0]:.2g} against {error[1]:.2g} deg, {rate[0]:.2g} against {rate[1]:.2g} deg/s"
    return Measured(text, {"pointing": error[0] < error[1], "rate": rate[0] < rate[1]})


def regular(run: Result) -> Measured:
    """How near to singular the gyros, and the matrix that the steering inverts, come."""
    gyros = run["steering.singularity"].ravel()
    inverted, least = (np.min(run[f"steering.inverted_{name}"]) for name in ("determinant", "singular_value"))
    late, end = (float(np.min(gyros[window(run, begin)])) for begin in (1.0, STOP_TIME - 10))
    part, turning = (float(100 * np.mean(gyros[of] < SINGULAR)) for of in (window(run, 0.0), window(run, 1.0, 20.0)))
    text = (
        f"det(A W A^T + V) >= {inverted:.2g}, its least singular value >= {least:.2g}; det(A A^T) below {SINGULAR} for "
        f"{part:.0f} % of the time and {turning:.0f} % of 1 to 20 s, {np.max(gyros):.2g} at most"
    )
    holds = {
        "inverted matrix": inverted > SINGULAR,
        "gyros, after 1 s": late > SINGULAR,
        "gyros, at the end": end > SINGULAR,
    }
    return Measured(text, {part: bool(good) for part, good in holds.items()})


def learned(run: Result) -> Measured:
    """How far the network's gain is from its last value after 30 s."""
    rho = run["controller.rho"]
    late = rho[window(run, 30.0)]
    away = np.max(np.abs(late - rho[-1]), axis=0)
    text = f"rho(30 s) {format_all(late[0])}, rho({STOP_TIME:g} s) {format_all(rho[-1])} N m"
    some = np.abs(rho[-1]) > SETTLED_RHO  # a gain that never left zero has settled at nothing
    return Measured(text, per_axis(np.where(some, away, np.inf), lambda d: d <= SETTLED_RHO))


def quieter(run: Result, other: Result) -> Measured:
    """Modal coordinates of 40 to 50 s against those of another law."""
    here, there = (np.max(np.abs(r["plant.eta"][window(r, 40.0, 50.0)]), axis=0) for r in (run, other))
    text = f"{format_all(here, 2)} against {format_all(there, 2)} kg^1/2 m"
    return Measured(
        text, {f"mode {i + 1}": bool(a < LEFT * b) for i, (a, b) in enumerate(zip(here, there, strict=True))}
    )


def helped(run: Result, other: Result) -> Measured:
    """Settling time and late error of a cluster against those of another one."""
    here, there = settled(run), settled(other)
    error, before = (float(np.max(largest_error(r, 50.0))) for r in (run, other))
    text = f"{_seconds(there)} -> {_seconds(here)}, from 50 s on {before:.2g} -> {error:.2g} deg"
    return Measured(text, {"transition": here < there, "accuracy": error < before})


def turned(run: Result, other: Result) -> Measured:
    """What turning the gimbals before the manoeuvre does to the body, and to the manoeuvre."""
    before = run.time < -1e-9
    torque = float(np.max(np.abs(run["actuators.tau_B"][before]), initial=0.0))
    away = float(np.max(np.abs(run["actuators.gimbal_angle"][window(run, 0.0)][0] - GIMBAL_ANGLES)))
    here, there = settled(run), settled(other)
    text = f"{torque:.1g} N m, gimbals within {away:.1g} rad; then 0.1 deg {_seconds(here)} against {_seconds(there)}"
    holds = {"torque": bool(before.any()) and torque < NO_TORQUE, "gimbals": away < ARRIVED}
    return Measured(text, holds | {"manoeuvre": here == there or abs(here - there) < SAME})


def falls(run: Result) -> Measured:
    """Whether V falls where the gain that acts is larger than E."""
    size, gain = np.linalg.norm(surface.uncertainty(run), axis=1), surface.acting(run)
    change = surface.slopes(run, size < gain)
    printed = surface.slopes(run, size < run["controller.rho"][:, 0])
    text = (
        f"falls in {np.sum(change < 0)} of {len(change)} intervals where |E| is below the acting gain, in "
        f"{np.sum(printed < 0)} of {len(printed)} where |E| < rho; |E| < rho for {100 * len(printed) / len(run):.0f} % "
        f"of the time, |E| <= {np.max(size):.2g} N m"
    )
    return Measured(text, {"V falls": bool(len(change)) and bool(np.all(change < 0))})


def unknown_weights(run: Result) -> Measured:
    """What can be told of the V of a network: its part |sigma|^2 / 2, which the theorem says nothing about."""
    V = surface.lyapunov(run)
    return Measured(f"W* is unknown; |sigma|^2 / 2 is {np.max(V):.2g} at most, {V[-1]:.1g} N2 m2 at the end", {})


def _seconds(time: float) -> str:
    return f"{time:.1f} s" if np.isfinite(time) else "never"
