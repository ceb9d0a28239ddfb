"""The claims of geng2012, each with the criterion that decides it.

The error is the rotation vector from reference to body, computed from the plant's and the guidance's attitude; errors,
rates and modal coordinates are compared component by component. The paper prints neither its linear gain nor its
constant switching gain: where a claim depends on such a choice, a run with another choice is part of the criterion.
"""

from collections.abc import Mapping

import numpy as np

from cosim.results.result import Result
from cosim.studies.metrics import attitude_error, settling_time
from cosim.studies.papers.claims import Claim, Measure, Measured, format_all, window
from cosim.studies.papers.geng2012.loop import STOP_TIME
from cosim.studies.papers.geng2012.system import (
    COMPENSATED,
    GAMMA_PRINTED,
    LINEAR,
    PRINTED_GAMMA,
    STRONG,
    STRONG_RHO_0,
    UNCOMPENSATED,
    WEAK,
    WEAK_RHO_0,
)

POINTING = 0.1  # deg
SINGULAR = 0.01  # det(A A^T) below which the gyros are called singular; the most is 1
SETTLED_RHO = 0.01  # N m, the paper's


def settled(run: Result, threshold: float = POINTING) -> float:
    """Return the last time at which a component of the error exceeds the threshold (deg), infinite if at the end."""
    error = attitude_error(run)
    if error is None:
        return np.inf
    time = settling_time(run.time, error, threshold)
    return np.inf if time is None else time


def largest_rate(run: Result, begin: float) -> float:
    """Return the largest component of the body rate from a time on, deg/s."""
    return float(np.degrees(np.max(np.abs(run["plant.omega_BN_B"][window(run, begin)]))))


def _seconds(time: float) -> str:
    return f"{time:.1f} s" if np.isfinite(time) else "never"


def _uncompensated(runs: Mapping[str, Result]) -> Measured:
    time, rate, weak = settled(runs[UNCOMPENSATED]), largest_rate(runs[UNCOMPENSATED], 50.0), settled(runs[WEAK])
    text = (
        f"0.1 deg {_seconds(time)}, {rate:.3f} deg/s from 50 s; rho_0 = {WEAK_RHO_0} N m: {_seconds(weak)}, "
        f"{STRONG_RHO_0} N m: {_seconds(settled(runs[STRONG]))}"
    )
    return Measured(text, {"pointing": time <= 50, "rate": rate <= 0.1, f"pointing, rho_0 = {WEAK_RHO_0}": weak <= 50})


def _compensated(runs: Mapping[str, Result]) -> Measured:
    time, slow = settled(runs[COMPENSATED]), runs[PRINTED_GAMMA]
    error = attitude_error(slow)
    at_40 = np.inf if error is None else float(np.max(np.abs(error[window(slow, 40.0)][0])))
    text = f"{_seconds(time)} with gamma = 1; {at_40:.2f} deg at 40 s with the printed gamma = {GAMMA_PRINTED}"
    return Measured(text, {"gamma = 1": time <= 40, "gamma as printed": settled(slow) <= 40})


def _stable(runs: Mapping[str, Result]) -> Measured:
    run = runs[COMPENSATED]
    rate = largest_rate(run, 40.0)
    time = settling_time(run.time, np.degrees(run["plant.omega_BN_B"]), 0.02)
    text = f"{rate:.4f} deg/s from 40 s on, within 0.02 deg/s from {_seconds(np.inf if time is None else time)}"
    return Measured(text, {"rate": rate <= 0.02})


def _shorter(runs: Mapping[str, Result]) -> Measured:
    network, constant, linear = (settled(runs[name]) for name in (COMPENSATED, UNCOMPENSATED, LINEAR))
    text = f"{_seconds(constant)} -> {_seconds(network)}; the linear law alone {_seconds(linear)}: not established"
    if network <= min(constant, linear) - 10:
        text = text.removesuffix(": not established")
    return Measured(text, {"10 s before every law without network": network <= min(constant, linear) - 10})


def _singular(runs: Mapping[str, Result]) -> Measured:
    run = runs[COMPENSATED]
    measure = run["steering.singularity"].ravel()
    turning, end = (float(np.min(measure[window(run, begin)])) for begin in (1.0, STOP_TIME - 10))
    part = float(np.mean(measure < SINGULAR))
    holds = {"after the first second": turning > SINGULAR, "near the end": end > SINGULAR}
    text = (
        f"det(A A^T) {measure[0]:.1g} at the start, {end:.1g} near the end, {np.max(measure):.2g} at most, below "
        f"{SINGULAR} for {100 * part:.0f} % of the time"
    )
    return Measured(text, holds)


def _estimate(runs: Mapping[str, Result]) -> Measured:
    run = runs[COMPENSATED]
    rho = run["controller.rho"]
    late = rho[window(run, 30.0)]
    away = np.max(np.abs(late - rho[-1]), axis=0)
    text = f"rho(30 s) {format_all(late[0])}, rho({STOP_TIME:g} s) {format_all(rho[-1])} N m"
    learned = np.abs(rho[-1]) > SETTLED_RHO  # a gain that never left zero has settled at nothing
    axes = zip(("x", "y", "z"), away, learned, strict=True)
    return Measured(text, {axis: bool(d <= SETTLED_RHO and some) for axis, d, some in axes})


def _vibration(runs: Mapping[str, Result]) -> Measured:
    def late(name: str) -> float:
        return float(np.max(np.abs(runs[name]["plant.eta"][window(runs[name], 40.0, 50.0)])))

    network, constant, linear = (late(name) for name in (COMPENSATED, UNCOMPENSATED, LINEAR))
    text = (
        f"max |eta| 40-50 s: {network:.2g} with, {constant:.2g} without, {linear:.2g} kg^1/2 m by the linear law alone"
    )
    return Measured(text, {"than without": network < 0.9 * constant, "than the linear law": network < 0.9 * linear})


def _claim(text: str, said: str, criterion: str, measure: Measure, *runs: str) -> Claim:
    return Claim(
        paper="geng2012",
        text=text,
        paper_number=said,
        criterion=criterion,
        runs=runs,
        until=STOP_TIME,
        measure=measure,
    )


CLAIMS = (
    _claim(
        "without compensation 0.1 deg at 50 s, 0.1 deg/s",
        "0.1 deg, 0.1 deg/s at 50 s",
        "every component of the error is within 0.1 deg from 50 s on, also with a constant gain of 0.02 N m; every "
        "component of the rate is within 0.1 deg/s from 50 s on",
        _uncompensated,
        UNCOMPENSATED,
        WEAK,
        STRONG,
    ),
    _claim(
        "with compensation 0.1 deg at 40 s",
        "0.1 deg at 40 s",
        "every component of the error is within 0.1 deg from 40 s on, with gamma = 1 and with gamma as printed",
        _compensated,
        COMPENSATED,
        PRINTED_GAMMA,
    ),
    _claim(
        "with compensation 0.02 deg/s at 40 s",
        "0.02 deg/s at 40 s",
        "every component of the rate is within 0.02 deg/s from 40 s on",
        _stable,
        COMPENSATED,
    ),
    _claim(
        "compensation makes the transition 10 s shorter",
        "10 s",
        "the error settles within 0.1 deg at least 10 s earlier than with either law without network: the constant "
        "gain and the linear law alone",
        _shorter,
        COMPENSATED,
        UNCOMPENSATED,
        LINEAR,
    ),
    _claim(
        "the gyros never become singular",
        "figure 7",
        "det(A A^T) is more than 0.01 at every time after the first second, and in the last 10 s",
        _singular,
        COMPENSATED,
    ),
    _claim(
        "the network's estimate settles at about 30 s",
        "30 s, 0.01 N m",
        "from 30 s on the gain of each axis is within 0.01 N m of its last value, which is more than that",
        _estimate,
        COMPENSATED,
    ),
    _claim(
        "compensation suppresses the modes",
        "figures 5, 9",
        "the largest modal coordinate of 40-50 s is over 10 % smaller than with the constant gain, and than with the "
        "linear law alone",
        _vibration,
        COMPENSATED,
        UNCOMPENSATED,
        LINEAR,
    ),
)
