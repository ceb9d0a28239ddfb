"""What section 1 of ye2016 neglects, measured on the plant that has it, and what it does to the law.

    J' w,  A_g I_cg gamma'',  w x A_g I_cg gamma':  the terms of its full equation that (4) is without    (1)

The paper calls them small. Its own measure of small is the torque from outside, of the order of 1e-5 N m, which it
neglects too.
"""

from collections.abc import Mapping

import numpy as np

from cosim.arrays import FloatArray
from cosim.results.result import Result
from cosim.studies.metrics import rotations
from cosim.studies.papers.claims import Measured, window
from cosim.studies.papers.ye2016.system import ADAPTIVE, FULL_MODEL, SERVO
from cosim.studies.papers.ye2016.tracking import LATE, euler_error, largest, rate_error

OUTSIDE = 1e-5  # N m, the torque from outside that the paper names
STARTED = 1.0  # s: the servo, at rest at the start, has long reached what is commanded
TERMS = {  # name of a term -> output of the plant, symbol
    "J' w": ("inertia_torque_B", r"$|\dot J \omega|$"),
    "A_g I_cg gamma''": ("acceleration_torque_B", r"$|A_g I_{cg} \ddot\gamma|$"),
    "w x A_g I_cg gamma'": ("gyroscopic_torque_B", r"$|\omega \times A_g I_{cg} \dot\gamma|$"),
}


def neglected(run: Result) -> dict[str, FloatArray]:
    """Return the size of each neglected term, N m."""
    return {term: np.linalg.norm(run[f"plant.{output}"], axis=1) for term, (output, _) in TERMS.items()}


def measure_terms(runs: Mapping[str, Result]) -> Measured:
    """Judge whether each term is at most of the order of the torque from outside, at the start and after it."""
    run = runs[FULL_MODEL]
    late, texts, holds = window(run, STARTED), list[str](), dict[str, bool]()
    for term, rows in neglected(run).items():
        first, then = float(rows.max()), float(rows[late].max())
        texts.append(f"{term} {then:.2g} N m" + (f" (at the start {first:.2g})" if first > then else ""))
        holds |= {term: then <= OUTSIDE * np.sqrt(10)}
        if not holds[term] or first > then:
            holds |= {f"{term} at the start": first <= OUTSIDE * np.sqrt(10)}
    return Measured("; ".join(texts), holds)


def measure_effect(runs: Mapping[str, Result]) -> Measured:
    """Judge whether the law's errors stay as they are on the design model."""
    design, servo, full = (runs[name] for name in (ADAPTIVE, SERVO, FULL_MODEL))
    attitude = rotations(full["plant.q_BN"])
    away = [float((rotations(run["plant.q_BN"]).inv() * attitude).magnitude().max()) for run in (design, servo)]
    text = f"at most {away[0]:.2g} rad from the design model, {away[1]:.2g} rad from that with the same servo"
    holds: dict[str, bool] = {}
    for what, error, unit in (("attitude", euler_error, "rad"), ("rate", rate_error, "rad/s")):
        ours, theirs = largest(error, full, LATE), largest(error, design, LATE)
        text += f"; {what} error {ours:.4g} instead of {theirs:.4g} {unit}"
        holds[what] = abs(ours / theirs - 1) <= 0.1
    return Measured(text, holds)
