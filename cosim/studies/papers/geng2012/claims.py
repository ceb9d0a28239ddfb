"""The claims of geng2012, each with the criterion that decides it and the readings in which it is judged.

The cluster that the paper flies comes first, then the one that it words, then configuration N, which is ours, and what
else the paper leaves open, in N. Where a claim compares, the runs of a reading are with and without compensation.
"""

from collections.abc import Callable, Iterable, Mapping

from cosim.results.result import Result
from cosim.studies.papers.claims import Claim, Measured, Readings
from cosim.studies.papers.geng2012 import measures as m
from cosim.studies.papers.geng2012.loop import STOP_TIME
from cosim.studies.papers.geng2012.system import (
    COMPENSATED,
    DEGREES,
    END_PHASE_COMPENSATED,
    END_PHASE_UNCOMPENSATED,
    END_PHASE_WHEELS,
    LIGHT,
    LIGHT_UNCOMPENSATED,
    LINEAR,
    NOMINAL,
    NOMINAL_UNCOMPENSATED,
    OBSERVER_PLACED,
    OBSERVER_PLACED_REAL,
    OBSERVER_START,
    PREPOSITIONED,
    PRINTED_GAMMA,
    STRONG,
    UNCOMPENSATED,
    WEAK,
    Z_WHEEL_COMPENSATED,
    Z_WHEEL_DEGREES,
    Z_WHEEL_ONLY,
    Z_WHEEL_PRINTED_GAMMA,
    Z_WHEEL_UNCOMPENSATED,
)

NETWORKS = {
    "one wheel with the printed gamma": (Z_WHEEL_PRINTED_GAMMA,),
    "one wheel with the printed gamma and sigma in degrees": (Z_WHEEL_DEGREES,),
    "one wheel with gamma = 1": (Z_WHEEL_COMPENSATED,),
    "three wheels in the end phase with gamma = 1": (END_PHASE_COMPENSATED,),
    "N with the printed gamma": (PRINTED_GAMMA,),
    "N with the printed gamma and sigma in degrees": (DEGREES,),
    "N with gamma = 1": (COMPENSATED,),
    "N with J x 0.8": (LIGHT,),
    "N with a wrong start of the observer": (OBSERVER_START,),
    "N with placed poles of the observer": (OBSERVER_PLACED,),
}
CONSTANT = {
    "one wheel": (Z_WHEEL_UNCOMPENSATED,),
    "three wheels in the end phase": (END_PHASE_UNCOMPENSATED,),
    "N": (UNCOMPENSATED,),
    "N with J x 0.8": (LIGHT_UNCOMPENSATED,),
    "N with rho_0 = 0.02 N m": (WEAK,),
    "N with rho_0 = 0.5 N m": (STRONG,),
}
PAIRS = {
    "one wheel": (Z_WHEEL_COMPENSATED, Z_WHEEL_UNCOMPENSATED),
    "three wheels in the end phase": (END_PHASE_COMPENSATED, END_PHASE_UNCOMPENSATED),
    "N": (COMPENSATED, UNCOMPENSATED),
    "N with J x 0.8": (LIGHT, LIGHT_UNCOMPENSATED),
    "N with rho_0 = 0.02 N m": (COMPENSATED, WEAK),
    "N with rho_0 = 0.5 N m": (COMPENSATED, STRONG),
}
CLUSTERS = {
    "one wheel": (Z_WHEEL_COMPENSATED,),
    "three wheels in the end phase": (END_PHASE_COMPENSATED,),
    "N": (COMPENSATED,),
}

LAW = "J x 1.2, G linear-quadratic, observer without gains where not said: chosen; N, configuration N, is ours"
GAIN = "rho_0 = 0.15 N m where not said: chosen; "
LEARNING = "gamma = 1 where not said: chosen, 0.01 is printed; "
HAND_OVER = "hand-over from 1 to 0.3 deg of |e| + 4 s |w|, wheels on at once: chosen; "


def _claim(
    text: str,
    said: str,
    criterion: str,
    measure: Callable[..., Measured],
    readings: Mapping[str, Iterable[str]],
    depends: str,
    *,
    beyond: bool = False,
) -> Claim:
    """Return a claim that `measure` judges of the runs of each reading, given in their order."""
    named = {reading: tuple(names) for reading, names in readings.items()}

    def judge(runs: Mapping[str, Result]) -> Readings:
        return {reading: measure(*(runs[name] for name in names)) for reading, names in named.items()}

    return Claim(
        paper="geng2012",
        text=text,
        paper_number=said,
        criterion=criterion,
        runs=tuple(dict.fromkeys(name for names in named.values() for name in names)),
        until=STOP_TIME,
        measure=judge,
        depends=depends,
        beyond=beyond,
    )


CLAIMS = (
    _claim(
        "without compensation 0.1 deg at 50 s, 0.1 deg/s",
        "0.1 deg, 0.1 deg/s at 50 s",
        "every component of the error is within 0.1 deg, and of the rate within 0.1 deg/s, from 50 s on",
        m.reached_without,
        CONSTANT,
        GAIN + HAND_OVER + LAW,
    ),
    _claim(
        "with compensation 0.1 deg at 40 s",
        "0.1 deg at 40 s",
        "every component of the error is within 0.1 deg from 40 s on",
        m.pointed,
        NETWORKS,
        LEARNING + HAND_OVER + LAW,
    ),
    _claim(
        "with compensation 0.02 deg/s at 40 s",
        "0.02 deg/s at 40 s",
        "every component of the rate is within 0.02 deg/s from 40 s on",
        m.stable,
        NETWORKS,
        LEARNING + HAND_OVER + LAW,
    ),
    _claim(
        "compensation makes the transition 10 s shorter",
        "10 s",
        "the error settles within 0.1 deg at least 10 s earlier than with the constant gain",
        m.shorter,
        PAIRS,
        LEARNING + GAIN + HAND_OVER + LAW,
    ),
    _claim(
        "with compensation pointing and rate are more precise",
        "figures 4, 6",
        "the largest component of the error from 50 s on, and of the rate, is smaller than with the constant gain",
        m.more_precise,
        PAIRS,
        LEARNING + GAIN + HAND_OVER + LAW,
    ),
    _claim(
        "the gyros never become singular",
        "figure 7",
        "det(A W A^T + V), of the matrix that the steering inverts, is more than 0.01 at every time; det(A A^T), of "
        "the gyros themselves, is so after the first second, and in the last 10 s",
        m.regular,
        CLUSTERS,
        LEARNING + "A in units of h_0; " + LAW,
    ),
    _claim(
        "the network's estimate settles at about 30 s",
        "30 s, 0.01 N m",
        "from 30 s on the gain of each axis is within 0.01 N m of its last value, which is more than that",
        m.learned,
        NETWORKS,
        LEARNING + HAND_OVER + LAW,
    ),
    _claim(
        "compensation suppresses every mode",
        "figures 5, 9",
        "the largest value of each modal coordinate in 40 to 50 s is over 10 % smaller than with the constant gain",
        m.quieter,
        PAIRS,
        LEARNING + GAIN + HAND_OVER + LAW,
    ),
    _claim(
        "wheels in the end phase shorten the transition and raise the accuracy",
        "section 2",
        "with three wheels in the end phase the error settles within 0.1 deg earlier than with one, and its largest "
        "component from 50 s on is smaller",
        m.helped,
        {
            "network": (END_PHASE_COMPENSATED, Z_WHEEL_COMPENSATED),
            "constant gain": (END_PHASE_UNCOMPENSATED, Z_WHEEL_UNCOMPENSATED),
            "linear law": (END_PHASE_WHEELS, Z_WHEEL_ONLY),
        },
        LEARNING + GAIN + HAND_OVER + LAW,
    ),
    _claim(
        "parallel gyros are turned before the manoeuvre without torque",
        "section 2",
        "before the manoeuvre the torque on the hub is below 1e-9 N m, at its start the gimbals are at pi/4 and "
        "5 pi/4, and the error settles within 1 s of where it does with gimbals that started there",
        m.turned,
        {"three wheels in the end phase": (PREPOSITIONED, END_PHASE_COMPENSATED)},
        "both gimbals by the same angle in 10 s, wheels and law at rest: chosen; " + LEARNING + HAND_OVER + LAW,
    ),
    _claim(
        "V = |sigma|^2 / 2 falls where |E| < rho (constant gain)",
        "section 3.1",
        "V falls from row to row wherever |E| is below the gain that acts, rho |s| / (|s| + epsilon), at both; E from "
        "the motion of the body, not from the law",
        m.falls,
        {
            reading: CONSTANT[reading]
            for reading in ("one wheel", "N", "N with rho_0 = 0.02 N m", "N with rho_0 = 0.5 N m")
        },
        "boundary layer epsilon = 1e-3 N m/s: chosen, printed is s/|s|; " + GAIN + LAW,
    ),
    _claim(
        "V of the surface and the weights falls (network)",
        "section 3.2",
        "none: V contains the ideal weights W*, which no flight shows",
        m.unknown_weights,
        CLUSTERS,
        LEARNING + LAW,
    ),
    _claim(
        "compensation is 10 s faster than the linear law alone",
        "",
        "the error settles within 0.1 deg at least 10 s earlier than without any switching term",
        m.shorter,
        {
            "one wheel": (Z_WHEEL_COMPENSATED, Z_WHEEL_ONLY),
            "three wheels in the end phase": (END_PHASE_COMPENSATED, END_PHASE_WHEELS),
            "N": (COMPENSATED, LINEAR),
        },
        LEARNING + HAND_OVER + LAW,
        beyond=True,
    ),
    _claim(
        "compensation suppresses every mode better than the linear law alone",
        "",
        "the largest value of each modal coordinate in 40 to 50 s is over 10 % smaller than without any switching term",
        m.quieter,
        {"N": (COMPENSATED, LINEAR)},
        LEARNING + LAW,
        beyond=True,
    ),
    _claim(
        "compensation saves 10 s whatever the inertia",
        "",
        "the error settles within 0.1 deg at least 10 s earlier than with the constant gain",
        m.shorter,
        {
            "J x 1.2": (COMPENSATED, UNCOMPENSATED),
            "J x 1": (NOMINAL, NOMINAL_UNCOMPENSATED),
            "J x 0.8": (LIGHT, LIGHT_UNCOMPENSATED),
        },
        LEARNING + GAIN + LAW,
        beyond=True,
    ),
    _claim(
        "any stable poles of the observer will do",
        "",
        "every component of the error is within 0.1 deg from 40 s on",
        m.pointed,
        {
            "frequencies of the modes": (OBSERVER_PLACED,),
            "real": (OBSERVER_PLACED_REAL,),
        },
        LEARNING + LAW,
        beyond=True,
    ),
)
