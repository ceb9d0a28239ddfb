"""The claims of ye2016, each with the criterion that decides it.

The paper's eigenvalues can be read in two ways: "printed" is -0.2 +- 0.2i and so on, "slow" a tenth of that.
"""

from collections.abc import Mapping

import numpy as np

from cosim.results.result import Result
from cosim.studies.papers.claims import Claim, Measure, Measured, Readings
from cosim.studies.papers.ye2016 import full_model
from cosim.studies.papers.ye2016.system import (
    ADAPTIVE,
    ADAPTIVE_SLOW,
    BETA_G,
    DELTA_G,
    FULL_MODEL,
    NONADAPTIVE,
    NONADAPTIVE_SLOW,
    PRINTED,
    SERVO,
    STOP_TIME,
)
from cosim.studies.papers.ye2016.tracking import LATE, euler_error, largest, momentum_error, rate_error, squared_norms

GYROS = "I_cg = I_cs = 0.02, I_ct = 0.01, I_cws = 0.016 kg m2, a gimbal servo of 10 ms, alpha_F = 1e5: all chosen"
HALF_A_DECADE = np.sqrt(10.0)
READINGS = {"printed poles": (NONADAPTIVE, PRINTED), "slow poles": (NONADAPTIVE_SLOW, ADAPTIVE_SLOW)}


def _of_order(value: float, said: float) -> bool:
    return bool(said / HALF_A_DECADE <= value <= said * HALF_A_DECADE)


def _nonadaptive(runs: Mapping[str, Result]) -> Measured:
    return _orders({reading: runs[without] for reading, (without, _) in READINGS.items()}, 0.3, 1e-3, 0.0)


def _adaptive(runs: Mapping[str, Result]) -> Measured:
    return _orders({reading: runs[adapting] for reading, (_, adapting) in READINGS.items()}, 3e-3, 1e-4, LATE)


def _orders(runs: Mapping[str, Result], attitude: float, rate: float, begin: float) -> Measured:
    texts: list[str] = []
    holds: dict[str, bool] = {}
    for reading, run in runs.items():
        angle, speed = largest(euler_error, run, begin), largest(rate_error, run, begin)
        text = f"{reading}: {angle:.3g} rad, {speed:.2g} rad/s"
        if begin:
            whole = largest(euler_error, run), largest(rate_error, run)
            text += f" (whole run {whole[0]:.2g} rad, {whole[1]:.2g} rad/s)"
        texts.append(text)
        holds |= {f"attitude, {reading}": _of_order(angle, attitude), f"rate, {reading}": _of_order(speed, rate)}
    return Measured("; ".join(texts), holds)


def _better(runs: Mapping[str, Result]) -> Measured:
    texts: list[str] = []
    holds: dict[str, bool] = {}
    for reading, (without, adapting) in READINGS.items():
        (whole_angle, angle), (whole_speed, speed) = (
            [largest(error, runs[without], t) / largest(error, runs[adapting], t) for t in (0.0, LATE)]
            for error in (euler_error, rate_error)
        )
        whole = f"(whole run {whole_angle:.2g} and {whole_speed:.2g})"
        texts.append(f"{reading}: attitude x {angle:.3g}, rate x {speed:.3g} {whole}")
        holds |= {f"attitude, {reading}": angle >= 100, f"rate, {reading}": speed >= 10}
    return Measured("; ".join(texts), holds)


def _bounded(runs: Mapping[str, Result]) -> Measured:
    largest = {name: max(float(rows.max()) for rows in squared_norms(run)) for name, run in runs.items()}
    text = ", ".join(f"{name.removeprefix('ye2016-')} {value:.3g}" for name, value in largest.items())
    # 1e-4: between two internal steps an estimate passes the edge by what the step's error is.
    return Measured(text, {name: value <= BETA_G + DELTA_G + 1e-4 for name, value in largest.items()})


def _momentum(runs: Mapping[str, Result]) -> Measured:
    texts: list[str] = []
    holds: dict[str, bool] = {}
    for name, run in runs.items():
        error, short = momentum_error(run), name.removeprefix("ye2016-")
        early = float(np.interp(100.0, run.time, error))
        texts.append(f"{short}: {early:.2g} at 100 s, {error[-1]:.2g} at the end")
        holds |= {f"quickly, {short}": early <= 0.5, f"to the true value, {short}": bool(error[-1] <= 0.1)}
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
        "the largest 3-2-1 angle and rate error of the run are within a factor of sqrt(10) of these, with the poles as "
        "printed and with a tenth of them",
        _nonadaptive,
        NONADAPTIVE,
        NONADAPTIVE_SLOW,
    ),
    _claim(
        "with adaptation: settled errors of 0.003 rad and 1e-4 rad/s",
        "0.003 rad, 1e-4 rad/s",
        "the largest errors from 400 s on are within a factor of sqrt(10) of these, with the poles as printed and with "
        "a tenth of them",
        _adaptive,
        PRINTED,
        ADAPTIVE_SLOW,
    ),
    _claim(
        "adaptation gains two orders in attitude, one in rate",
        "x 100, x 10",
        "the largest errors from 400 s on fall by these factors, with the poles as printed and with a tenth of them",
        _better,
        NONADAPTIVE,
        PRINTED,
        NONADAPTIVE_SLOW,
        ADAPTIVE_SLOW,
    ),
    _claim(
        "the projection keeps the estimated deviations bounded",
        "|Theta|^2 <= 0.15",
        "the largest |Theta_cGi|^2, |Theta_wGj|^2 of the run is at most 0.1501, in each adaptive run",
        _bounded,
        ADAPTIVE,
        PRINTED,
        ADAPTIVE_SLOW,
    ),
    _claim(
        "the estimated momentum quickly converges to the true one",
        "figures 8-9",
        "its error is at most half of that at the start after 100 s, and at most a tenth at the end",
        _momentum,
        ADAPTIVE,
        PRINTED,
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
