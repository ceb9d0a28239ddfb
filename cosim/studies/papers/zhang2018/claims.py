"""The claims of zhang2018, each with the criterion that decides it.

e_i is the error of an Euler angle (tracking.py), not what a controller says of itself. Every claim is judged in both
readings of the unit of angle, degrees first: in them the paper prints bounds, start and centres.
"""

from collections.abc import Callable, Mapping

import numpy as np

from cosim.arrays import FloatArray
from cosim.results.result import Result
from cosim.studies.metrics import settling_time
from cosim.studies.papers.claims import AXES, Claim, Measured, Readings, format_all, in_all_readings, per_axis, window
from cosim.studies.papers.zhang2018.system import (
    ATC,
    ATC_HALF,
    OMEGA,
    OVERSHOOT,
    PPATC,
    PPATC_HALF,
    READINGS,
    RHO_0,
    RHO_INF,
    STOP_TIME,
    ZETA,
)
from cosim.studies.papers.zhang2018.tracking import STEADY, bound, tracking_error


def _largest(run: Result, begin: float = STEADY) -> FloatArray:
    return np.max(np.abs(tracking_error(run)[window(run, begin)]), axis=0)


def _settling(run: Result) -> list[float]:
    e = tracking_error(run)
    times = [settling_time(run.time, e[:, [i]], RHO_INF) for i in range(3)]
    return [np.inf if t is None else t for t in times]


def _margins(run: Result) -> tuple[FloatArray, FloatArray]:
    """Return the extremes of z = e / rho, taken towards the side where e starts, per axis."""
    e = tracking_error(run)
    z = e / bound(run.time)[:, None] * np.where(e[0] >= 0, 1.0, -1.0)
    return z.min(axis=0), z.max(axis=0)


def _within_bounds(run: Result) -> dict[str, bool]:
    least, most = _margins(run)
    return {axis: bool(-OVERSHOOT <= a and b < 1) for axis, a, b in zip(AXES, least, most, strict=True)}


def _swings(run: Result) -> list[int]:
    """Return how often e goes through zero from one swing beyond 0.005 deg to the next, per axis."""
    counts: list[int] = []
    for column in tracking_error(run).T:
        signs = np.sign(column[np.abs(column) > RHO_INF])
        counts.append(int(np.count_nonzero(np.diff(signs))))
    return counts


def _undershoot(run: Result) -> FloatArray:
    """Return how far e goes beyond zero to the other side, deg, per axis."""
    e = tracking_error(run)
    return np.max(-e * np.where(e[0] >= 0, 1.0, -1.0), axis=0).clip(0.0)


def _ppatc_steady(runs: Mapping[str, Result]) -> Measured:
    largest = _largest(runs[PPATC])
    return Measured(f"{format_all(largest)} deg", per_axis(largest, lambda e: e <= RHO_INF))


def _ppatc_bounds(runs: Mapping[str, Result]) -> Measured:
    least, most = _margins(runs[PPATC])
    spans = ", ".join(f"{axis} {a:.3f} to {b:.3f}" for axis, a, b in zip(AXES, least, most, strict=True))
    return Measured(f"z = e/rho: {spans}", _within_bounds(runs[PPATC]))


def _ppatc_first(runs: Mapping[str, Result]) -> Measured:
    fast, slow = _settling(runs[PPATC]), _settling(runs[ATC])
    text = f"{' / '.join(f'{t:.1f}' for t in fast)} s, ATC {' / '.join(f'{t:.1f}' for t in slow)} s"
    return Measured(text, {axis: a < b for axis, a, b in zip(AXES, fast, slow, strict=True)})


def _atc_misses(runs: Mapping[str, Result]) -> Measured:
    largest = _largest(runs[ATC])
    return Measured(f"{format_all(largest)} deg", per_axis(largest, lambda e: e > RHO_INF))


def _atc_oscillates(runs: Mapping[str, Result]) -> Measured:
    counts, depth = _swings(runs[ATC]), _undershoot(runs[ATC])
    text = f"reversals {' / '.join(map(str, counts))}, undershoot {format_all(depth)} deg"
    return Measured(text, per_axis(counts, lambda n: n >= 2))


def _half_ppatc(runs: Mapping[str, Result]) -> Measured:
    full, half = runs[PPATC], runs[PPATC_HALF]
    reduced = tracking_error(half)
    original = tracking_error(full)
    change = np.array([np.interp(half.time, full.time, column) for column in original.T]).T - reduced
    late = np.max(np.abs(change[window(half, 20.0)]), axis=0)
    most = np.max(np.abs(change), axis=0)
    holds = per_axis(most, lambda d: d <= 0.1 * RHO_0, "change of") | per_axis(
        late, lambda d: d <= 0.1 * RHO_INF, "late change of"
    )
    holds |= {f"bounds of {axis}": good for axis, good in _within_bounds(half).items()}
    holds |= per_axis(_largest(half), lambda e: e <= RHO_INF, "accuracy of")
    return Measured(f"change at most {format_all(most)} deg, after 20 s {format_all(late)} deg", holds)


def _half_atc(runs: Mapping[str, Result]) -> Measured:
    before, after = _largest(runs[ATC]), _largest(runs[ATC_HALF])
    shallow, deep = _undershoot(runs[ATC]), _undershoot(runs[ATC_HALF])
    holds = per_axis(after / before, lambda ratio: ratio > 1.1, "accuracy of")
    worse = (deep > 1.1 * shallow) & (deep > RHO_INF)
    holds |= {f"oscillation of {axis}": bool(w) for axis, w in zip(AXES, worse, strict=True)}
    text = f"steady {format_all(before)} -> {format_all(after)} deg, "
    text += f"undershoot {format_all(shallow)} -> {format_all(deep)} deg"
    return Measured(text, holds)


def _vibration(run: Result, begin: float, end: float) -> float:
    """Return the amplitude of mode 1 of panel 1, from its rate: that hides the slow part due to the reference."""
    return float(np.max(np.abs(run["plant.eta_dot"][window(run, begin, end), 0]))) / float(OMEGA[0])


def _suppressed(runs: Mapping[str, Result]) -> Measured:
    run = runs[PPATC]
    early, late = _vibration(run, 20.0, 50.0), _vibration(run, 170.0, 200.0)
    # Rate of decay between windows 150 s apart, over the panel's own; a motionless panel has no decay to compare.
    rate = np.log(early / late) / 150.0 / (ZETA * OMEGA[0]) if early > 0 and late > 0 else np.inf
    peaks = [float(np.max(np.abs(runs[name]["plant.eta"][:, 0]))) for name in (PPATC, ATC)]
    text = f"peak eta_11 {peaks[0]:.2g}, ATC {peaks[1]:.2g} kg^1/2 m; decay {rate:.2f} times its own damping's"
    holds = {
        "decays": late < early / 2 or early == 0,
        "faster than by its own damping": bool(rate > 1.5),
        "excited no more than by ATC": peaks[0] <= 1.1 * peaks[1],
    }
    return Measured(text, holds)


OPEN = "the unit of angle of gains and centres (two readings); Table 1's rates as Euler rates; d in body axes"


def _claim(
    text: str,
    said: str,
    criterion: str,
    measure: Callable[[Mapping[str, Result]], Measured],
    *runs: str,
    chosen: str = "",
) -> Claim:
    """Return a claim in both readings; `measure` knows the runs by their names in degrees."""

    def read(reading: str, suffix: str) -> Claim:
        def measured(results: Mapping[str, Result]) -> Readings:
            return {reading: measure({name: results[name + suffix] for name in runs})}

        return Claim(
            paper="zhang2018",
            text=text,
            paper_number=said,
            criterion=criterion,
            runs=[name + suffix for name in runs],
            until=STOP_TIME,
            measure=measured,
            depends="; ".join(filter(None, (OPEN, chosen))),
        )

    return in_all_readings([read(name, reading.suffix) for name, reading in READINGS.items()])


CLAIMS = (
    _claim(
        "PPATC: steady-state error within 0.005 deg",
        "0.005 deg",
        "the largest error from 100 s on is at most 0.005 deg, on each axis",
        _ppatc_steady,
        PPATC,
    ),
    _claim(
        "PPATC: error within its bounds, no overshoot",
        "between 0 and rho",
        "e_i keeps its sign and stays below rho at every row, on each axis",
        _ppatc_bounds,
        PPATC,
    ),
    _claim(
        "PPATC settles before ATC",
        "figures 2-4",
        "the last time at which the error exceeds 0.005 deg is earlier than with ATC, on each axis",
        _ppatc_first,
        PPATC,
        ATC,
        chosen="settled: within 0.005 deg",
    ),
    _claim(
        "ATC misses the accuracy of 0.005 deg",
        "> 0.005 deg",
        "the largest error from 100 s on is more than 0.005 deg, on each axis",
        _atc_misses,
        ATC,
    ),
    _claim(
        "ATC: error visibly oscillates",
        "figures 2-4",
        "e_i reverses at least twice between swings of more than 0.005 deg, on each axis",
        _atc_oscillates,
        ATC,
        chosen="a swing: beyond 0.005 deg",
    ),
    _claim(
        "half gains: PPATC changes little and keeps its bounds",
        "figures 9-11",
        "e_i changes by at most 10 % of rho_0 at any time and of rho_inf from 20 s on, stays within its bounds, and "
        "within 0.005 deg from 100 s on, on each axis",
        _half_ppatc,
        PPATC,
        PPATC_HALF,
        chosen="little: a tenth of the bound",
    ),
    _claim(
        "half gains: ATC less accurate, oscillates more",
        "figures 9-11",
        "the largest error from 100 s on grows by over 10 %; the undershoot too, to over 0.005 deg; on each axis",
        _half_atc,
        ATC,
        ATC_HALF,
        chosen="less, more: by a tenth",
    ),
    _claim(
        "PPATC suppresses the panels' vibration",
        "figure 8",
        "mode 1 of panel 1: its vibration more than halves from 20-50 s to 170-200 s; more than 1.5 times as fast as "
        "by the panel's own damping; its peak is at most 10 % above that with ATC",
        _suppressed,
        PPATC,
        ATC,
        chosen="suppressed: faster than by its own damping, no stronger than with ATC",
    ),
)
