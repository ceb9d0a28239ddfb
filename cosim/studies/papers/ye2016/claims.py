"""The claims of ye2016, each with the criterion that decides it.

The paper's eigenvalues can be read in two ways: "printed poles" are -0.2 +- 0.2i and so on, "slow poles" a tenth of
that. It prints alpha_F, but no vehicle: a vehicle of ten times the chosen one is the same flight with alpha_F = 1e5.
Its figures may have degrees where it says rad.
"""

from collections.abc import Mapping

import numpy as np

from cosim.results.result import Result
from cosim.studies.papers.claims import Claim, Measure, Measured, Readings, window
from cosim.studies.papers.ye2016 import full_model, theory
from cosim.studies.papers.ye2016.system import (
    ADAPTIVE,
    ADAPTIVE_SLOW,
    BETA_G,
    DELTA_G,
    FULL_MODEL,
    INERTIA,
    INERTIA_PRINTED,
    NONADAPTIVE,
    NONADAPTIVE_SLOW,
    PLACED,
    PRINTED,
    SERVO,
    SLOW_PLACED,
    SLOW_PRINTED,
    STOP_TIME,
)
from cosim.studies.papers.ye2016.tracking import (
    LATE,
    euler_error,
    largest,
    momentum_error,
    rate_error,
    squared_norms,
)

VEHICLE = "the vehicle, its cluster and the deviations, a diagonal K: chosen"
GYROS = "I_cg = I_cs = 0.02, I_ct = 0.01, I_cws = 0.016 kg m2, a gimbal servo of 10 ms, alpha_F = 1e5: all chosen"
HALF_A_DECADE = np.sqrt(10.0)
WITHOUT = {"printed poles": NONADAPTIVE, "slow poles": NONADAPTIVE_SLOW}
PLACED_K = {"printed poles with a placed K": PLACED, "slow poles with a placed K": SLOW_PLACED}
WITH = {
    "printed poles": PRINTED,
    "printed poles with alpha_F = 1e5": ADAPTIVE,
    "slow poles": SLOW_PRINTED,
    "slow poles with alpha_F = 1e2": ADAPTIVE_SLOW,
}


def _of_order(value: float, said: float) -> bool:
    return bool(said / HALF_A_DECADE <= value <= said * HALF_A_DECADE)


def _nonadaptive(runs: Mapping[str, Result]) -> Readings:
    found = {reading: _orders(runs[name], 0.3, 1e-3) for reading, name in (WITHOUT | PLACED_K).items()}
    return found | {"printed poles in degrees": _orders(runs[NONADAPTIVE], 0.3, 1e-3, unit="deg")}


def _adaptive(runs: Mapping[str, Result]) -> Readings:
    found = {reading: _orders(runs[name], 3e-3, 1e-4, LATE) for reading, name in WITH.items()}
    return found | {"printed poles in degrees": _orders(runs[PRINTED], 3e-3, 1e-4, LATE, unit="deg")}


def _orders(run: Result, attitude: float, rate: float, begin: float = 0.0, unit: str = "rad") -> Measured:
    """Judge whether the largest errors from `begin` on are of the order of these, in a unit of angles."""
    factor = np.degrees(1.0) if unit == "deg" else 1.0
    (angle, whole), (speed, fastest) = (
        [factor * largest(error, run, t) for t in (begin, 0.0)] for error in (euler_error, rate_error)
    )
    text = f"{angle:.3g} {unit}, {speed:.2g} {unit}/s"
    text += f" (whole run {whole:.2g} {unit}, {fastest:.2g} {unit}/s)" if begin else ""
    return Measured(text, {"attitude": _of_order(angle, attitude), "rate": _of_order(speed, rate)})


def _better(runs: Mapping[str, Result]) -> Readings:
    found: dict[str, Measured] = {}
    for reading, adapting in WITH.items():
        without = WITHOUT[reading.partition(" with ")[0]]
        (whole_angle, angle), (whole_speed, speed) = (
            [largest(error, runs[without], t) / largest(error, runs[adapting], t) for t in (0.0, LATE)]
            for error in (euler_error, rate_error)
        )
        text = f"attitude x {angle:.3g}, rate x {speed:.3g} (whole run {whole_angle:.3g} and {whole_speed:.3g})"
        found[reading] = Measured(text, {"attitude": angle >= 100, "rate": speed >= 10})
    return found


def _bounded(runs: Mapping[str, Result]) -> Measured:
    found = {name: max(float(rows.max()) for rows in squared_norms(run)) for name, run in runs.items()}
    text = ", ".join(f"{name.removeprefix('ye2016-')} {value:.3g}" for name, value in found.items())
    # 1e-4: between two internal steps an estimate passes the edge by what the step's error is.
    return Measured(text, {name: value <= BETA_G + DELTA_G + 1e-4 for name, value in found.items()})


def _momentum(runs: Mapping[str, Result]) -> Readings:
    return {reading: _converges(runs[name]) for reading, name in WITH.items()}


def _converges(run: Result) -> Measured:
    error = momentum_error(run)
    early, late = float(np.interp(100.0, run.time, error)), float(error[window(run, 100.0)].max())
    text = f"{early:.3g} of the start's at 100 s, {error[-1]:.2g} at the end, at most {late:.3g} in between"
    return Measured(text, {"quickly": early <= 0.5, "to the true value": bool(error[-1] <= 0.1)})


def _inertia(runs: Mapping[str, Result]) -> Measured:
    texts, holds = ["the law has no estimate of J"], dict[str, bool]()
    for wrong, right, text in ((INERTIA_PRINTED, PRINTED, "alpha_F = 1e7"), (INERTIA, ADAPTIVE, "alpha_F = 1e5")):
        errors = [largest(euler_error, runs[name], LATE) for name in (right, wrong)]
        estimates = [momentum_error(runs[name])[-1] for name in (right, wrong)]
        found = " rad, momentum ".join(f"{a:.3g} -> {b:.3g}" for a, b in (errors, estimates))
        texts.append(f"{text}: attitude {found}")
        holds[text] = errors[1] <= 1.1 * errors[0]
    return Measured("; ".join(texts), holds)


def _claim(
    text: str, said: str, criterion: str, measure: Measure, *runs: str, depends: str = "", beyond: bool = False
) -> Claim:
    def of_its_runs(given: Mapping[str, Result]) -> Measured | Readings:
        return measure({name: given[name] for name in runs})

    return Claim(
        paper="ye2016",
        text=text,
        paper_number=said,
        criterion=criterion,
        runs=runs,
        until=STOP_TIME,
        measure=of_its_runs,
        depends=depends,
        beyond=beyond,
    )


CLAIMS = (
    _claim(
        "without adaptation: errors of the order of 0.3 rad and 1e-3 rad/s",
        "0.3 rad, 1e-3 rad/s",
        "the largest 3-2-1 angle and rate error of the run are within a factor of sqrt(10) of these",
        _nonadaptive,
        *WITHOUT.values(),
        *PLACED_K.values(),
        depends=VEHICLE,
    ),
    _claim(
        "with adaptation: settled errors of 0.003 rad and 1e-4 rad/s",
        "0.003 rad, 1e-4 rad/s",
        "the largest errors from 400 s on are within a factor of sqrt(10) of these",
        _adaptive,
        *WITH.values(),
        depends=f"{VEHICLE}; alpha_F = 1e2 of the slow poles: chosen",
    ),
    _claim(
        "adaptation gains two orders in attitude, one in rate",
        "x 100, x 10",
        "the largest errors from 400 s on fall by these factors",
        _better,
        *WITHOUT.values(),
        *WITH.values(),
        depends=f"{VEHICLE}; alpha_F = 1e2 of the slow poles: chosen",
    ),
    _claim(
        "the projection keeps the estimated deviations bounded",
        "|Theta|^2 <= 0.15",
        "the largest |Theta_cGi|^2, |Theta_wGj|^2 of the run is at most 0.1501, in each adaptive run",
        _bounded,
        *WITH.values(),
        depends=VEHICLE,
    ),
    _claim(
        "the estimated momentum quickly converges to the true one",
        "figures 8-9",
        "its error is at most half of that at the start after 100 s, and at most a tenth at the end",
        _momentum,
        *WITH.values(),
        depends=f"{VEHICLE}; 100 s, a half and a tenth: chosen",
    ),
    _claim(
        "the gyros' J' w, A_g I_cg gamma'' and w x A_g I_cg gamma' are small and can be neglected",
        "small",
        "on the full model each is at most of the order (within sqrt(10)) of the 1e-5 N m from outside that the paper "
        "neglects too, after the first second and at the start",
        full_model.measure_terms,
        FULL_MODEL,
        depends=f"{GYROS}; the start from rest, where the servo catches up with the command",
    ),
    _claim(
        "V' = -e^T Q e / 2: V never grows",
        "V' <= 0",
        "between any two rows V of (23) falls, with the true axes and momentum, and over the run by the integral of "
        "e^T Q e / 2, within 1 %",
        theory.measure_storage,
        *theory.FLIGHTS,
        depends=f"{VEHICLE}; printed poles, where the projection never acts: with it V falls faster",
    ),
    _claim(
        "the law estimates the satellite's inertia (abstract)",
        "estimated",
        "with 1.1 times the true J in the law, the largest attitude error from 400 s on is within a tenth of that with "
        "the true J, as if it were learnt",
        _inertia,
        PRINTED,
        INERTIA_PRINTED,
        ADAPTIVE,
        INERTIA,
        depends="J 10 % too large: chosen; equations (24) to (26) have no estimate of J, so that no reading can help",
    ),
    _claim(
        "the law keeps its accuracy on the full model",
        "",
        "the largest errors from 400 s on are within a tenth of those of ye2016-adaptive",
        full_model.measure_effect,
        ADAPTIVE,
        SERVO,
        FULL_MODEL,
        depends=GYROS,
        beyond=True,
    ),
)
