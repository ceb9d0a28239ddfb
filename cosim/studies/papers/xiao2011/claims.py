"""The claims of xiao2011, each with the criterion that decides it.

"About t" is within a fifth of t. The paper does not say which initial attitude it flies nor what "settled" is: the
claims are judged in the cases S and L of system.py, at 5 % of each angle's own start.
"""

from collections.abc import Iterable, Mapping

import numpy as np

from cosim.results.result import Result
from cosim.studies.papers.claims import Claim, Measure, Measured, format_all
from cosim.studies.papers.xiao2011 import gain
from cosim.studies.papers.xiao2011.system import (
    GAMMA,
    L2,
    L2_LARGE,
    L2_LARGE_K5,
    L2_PRINTED,
    L2_UNCONSTRAINED,
    OVERLOAD,
    OVERLOADED,
    PID,
    PID_LARGE,
    SHAKE,
    SHAKEN,
    U_MAX,
    K,
)
from cosim.studies.papers.xiao2011.tracking import angles, settling, vibration

ABOUT = 0.2  # "about t" is within this part of t
SETTLED, FINE = 0.05, 0.001  # parts of the start
STEADY = 12.0 - 20 * 2 * np.pi / SHAKE[0]  # s: the last twenty periods of the shaken run


def _about(value: float, said: float) -> bool:
    return bool(abs(value - said) <= ABOUT * said)


def _worst(values: Iterable[float]) -> float:
    return float(max(values))


def _time(value: float) -> str:
    return f"{value:.1f} s" if np.isfinite(value) else "never"


def _settles(run: Result) -> str:
    return f"{_time(_worst(settling(run, SETTLED)))} (5 %), {_time(_worst(settling(run, FINE)))} (0.1 %)"


def _settles_small(runs: Mapping[str, Result]) -> Measured:
    scaled, printed = (_worst(settling(runs[name], SETTLED)) for name in (L2, L2_PRINTED))
    text = f"weights as printed: {_time(printed)}; in units of 1/J: {_settles(runs[L2])}"
    return Measured(text, {"weights as printed": _about(printed, 80.0), "weights in 1/J": _about(scaled, 80.0)})


def _settles_large(runs: Mapping[str, Result]) -> Measured:
    worst = _worst(settling(runs[L2_LARGE_K5], SETTLED))
    return Measured(f"{_settles(runs[L2_LARGE_K5])}", {f"k = {K:g}": _about(worst, 80.0)})


def _settles_large_slower(runs: Mapping[str, Result]) -> Measured:
    worst = _worst(settling(runs[L2_LARGE], SETTLED))
    used = _parameter(runs[L2_LARGE], "controller.k_theta")
    text = f"k = {used:g}: {_settles(runs[L2_LARGE])}"
    return Measured(text, {"time": _about(worst, 80.0), "with the paper's k": used == K})


def _parameter(run: Result, name: str) -> float:
    """Return a parameter that the run was made with."""
    entry = (run.info.get("parameters") or {}).get(name)
    return float("nan") if entry is None else float(entry["value"])


def _limit_kept(runs: Mapping[str, Result]) -> Measured:
    applied = [np.max(np.abs(runs[name]["plant.tau_B"])) for name in (L2, L2_LARGE, L2_LARGE_K5)]
    raw = [np.max(np.abs(runs[name]["controller.u"])) for name in (L2, L2_LARGE_K5)]
    text = f"at most {max(applied):.6g} N m; before the limiter up to {raw[0]:.0f} (S), {raw[1]:.0f} N m (L, k = {K:g})"
    return Measured(text, {"limit": bool(max(applied) <= U_MAX * (1 + 1e-9))})


def _l2_vibration(runs: Mapping[str, Result]) -> Measured:
    small, large = (_worst(vibration(runs[name])) for name in (L2, L2_LARGE))
    text = f"to 5 % of the peak: S {_time(small)}, L with k = 0.2 {_time(large)}"
    return Measured(text, {"S": small <= 50.0 * (1 + ABOUT), "L": large <= 50.0 * (1 + ABOUT)})


def _pid_settles(runs: Mapping[str, Result]) -> Measured:
    worst = _worst(settling(runs[PID_LARGE], SETTLED))
    text = f"L {_time(worst)} (5 %); S {_settles(runs[PID])}"
    return Measured(text, {"L": _about(worst, 200.0)})


def _pid_vibration(runs: Mapping[str, Result]) -> Measured:
    large, small = (_worst(vibration(runs[name])) for name in (PID_LARGE, PID))
    return Measured(f"to 5 % of the peak: L {_time(large)}; S {_time(small)}", {"L": _about(large, 300.0)})


def _theorem_1(runs: Mapping[str, Result]) -> Measured:
    run = runs[L2_UNCONSTRAINED]
    linear, omega = gain.supremum()
    measured = _worst(gain.flown(runs[SHAKEN], STEADY))
    peak = np.max(np.abs(run["plant.tau_B"]))
    text = f"{measured:.4f} shaken at {SHAKE[0]:g} rad/s (linearised {linear:.4f} at {omega:.1f}); peak {peak:.0f} N m"
    final = np.max(np.abs(angles(run)[-1]) / np.abs(angles(run)[0]))
    return Measured(text, {"gain": max(measured, linear) <= GAMMA, "flies": bool(final <= FINE)})


def _theorem_2(runs: Mapping[str, Result]) -> Measured:
    run = runs[L2]
    free, loaded = _worst(gain.flown(runs[SHAKEN], STEADY)), _worst(gain.flown(runs[OVERLOADED]))
    z1, z2, e1 = run["controller.theta"], run["controller.z2"], run["controller.e1"]
    e2 = z2 - e1
    # (33): -p1 e2^2 - e1^2/2 + e1 (z1 + z2) <= 0, with p1 as large as one likes: at least where e2 vanishes.
    p1 = _parameter(run, "controller.p1")
    left = -p1 * e2**2 - e1**2 / 2 + e1 * (z1 + z2)
    saturated = np.abs(run["controller.u"]) > U_MAX
    fails = np.array([np.mean(left[saturated[:, i], i] > 0) if saturated[:, i].any() else 0.0 for i in range(3)])
    text = (
        f"unsaturated {free:.4f}; saturated by {OVERLOAD:g} N m from outside {loaded:.0f}; its proof's (33) fails in "
        f"{format_all(100 * fails, 2)} % of the saturated time of case S"
    )
    return Measured(text, {"unsaturated": free <= GAMMA, "saturated": loaded <= GAMMA})


def _claim(
    text: str, said: str, criterion: str, measure: Measure, until: float | Mapping[str, float], *runs: str
) -> Claim:
    return Claim(
        paper="xiao2011",
        text=text,
        paper_number=said,
        criterion=criterion,
        runs=runs,
        until=until,
        measure=measure,
    )


CLAIMS = (
    _claim(
        "L2-gain: attitude settles in about 80 s (case S)",
        "80 s",
        "the last time at which an angle exceeds 5 % of its start is 64 to 96 s, with the weights as printed and with "
        "those of g in units of 1/J. The start of case S was chosen for it",
        _settles_small,
        400.0,
        L2,
        L2_PRINTED,
    ),
    _claim(
        "L2-gain: attitude settles in about 80 s (case L, k = 5)",
        "80 s",
        "the last time at which an angle exceeds 5 % of its start is 64 to 96 s",
        _settles_large,
        600.0,
        L2_LARGE_K5,
    ),
    _claim(
        "L2-gain: attitude settles in about 80 s (case L, k = 0.2)",
        "80 s",
        "the last time at which an angle exceeds 5 % of its start is 64 to 96 s; k is the paper's",
        _settles_large_slower,
        600.0,
        L2_LARGE,
    ),
    _claim(
        "L2-gain: the torque keeps its limit",
        "0.2 N m",
        "the torque on the hub never exceeds 0.2 N m",
        _limit_kept,
        400.0,
        L2,
        L2_LARGE,
        L2_LARGE_K5,
    ),
    _claim(
        "L2-gain: vibration gone after about 50 s",
        "50 s",
        "each mode is within 5 % of its peak from 60 s on, in case S and in case L",
        _l2_vibration,
        400.0,
        L2,
        L2_LARGE,
    ),
    _claim(
        "PID: attitude settles in about 200 s (case L)",
        "200 s",
        "the last time at which an angle exceeds 5 % of its start is 160 to 240 s in case L",
        _pid_settles,
        400.0,
        PID_LARGE,
        PID,
    ),
    _claim(
        "PID: vibration gone after about 300 s (case L)",
        "300 s",
        "the last time at which a mode exceeds 5 % of its peak is 240 to 360 s in case L",
        _pid_vibration,
        400.0,
        PID_LARGE,
        PID,
    ),
    _claim(
        "Theorem 1 (no limit): L2 gain at most gamma",
        "0.2",
        "the gain is at most 0.2, of the loop linearised at the reference, network learning, and of a rigid body "
        "shaken where that is largest; and the loop without limits brings the angles to 0.1 % of their start",
        _theorem_1,
        {L2_UNCONSTRAINED: 100.0, SHAKEN: 12.0},
        L2_UNCONSTRAINED,
        SHAKEN,
    ),
    _claim(
        "Theorem 2 (torque limited): L2 gain at most gamma",
        "0.2",
        "the gain of a rigid body from rest is at most 0.2: shaken without a limit, and under a constant torque that "
        "saturates the wheels for a minute",
        _theorem_2,
        {L2: 400.0, SHAKEN: 12.0, OVERLOADED: 60.0},
        L2,
        SHAKEN,
        OVERLOADED,
    ),
)
