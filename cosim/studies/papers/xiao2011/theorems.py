"""Theorems 1 and 2 of xiao2011, where a flight can decide: gain and storage function where f and g are known."""

from collections.abc import Mapping

import numpy as np

from cosim.results.result import Result
from cosim.studies.papers.claims import Measured, format_all
from cosim.studies.papers.xiao2011 import gain, storage
from cosim.studies.papers.xiao2011.system import GAMMA, L2, L2_UNCONSTRAINED, OVERLOAD, OVERLOADED, SHAKE, SHAKEN, U_MAX
from cosim.studies.papers.xiao2011.tracking import angles

STEADY = 12.0 - 20 * 2 * np.pi / SHAKE[0]  # s: the last twenty periods of the shaken run


def _gain(run: Result, begin: float = 0.0) -> float:
    return float(max(gain.flown(run, begin)))


def _parameter(run: Result, name: str) -> float:
    """Return a parameter that the run was made with."""
    entry = (run.info.get("parameters") or {}).get(name)
    return float("nan") if entry is None else float(entry["value"])


def theorem_1(runs: Mapping[str, Result]) -> Measured:
    """Measure Theorem 1: the gain without a limit, V(t), and whether the loop flies."""
    run = runs[L2_UNCONSTRAINED]
    linear, omega = gain.supremum()
    measured = _gain(runs[SHAKEN], STEADY)
    peak = np.max(np.abs(run["actuators.tau_B"]))
    text = f"{measured:.4f} shaken at {SHAKE[0]:g} rad/s (linearised {linear:.4f} at {omega:.1f}); peak {peak:.0f} N m"
    final = np.max(np.abs(angles(run)[-1]) / np.abs(angles(run)[0]))
    excess = storage.excess(runs[SHAKEN])
    text += f"; V(t) up to {storage.storage(runs[SHAKEN]).max():.1e}, allowed {storage.bound(runs[SHAKEN]).max():.1e}"
    holds = {"gain": max(measured, linear) <= GAMMA, "flies": bool(final <= 0.001), "V(t)": excess <= storage.ROUNDING}
    return Measured(text, holds)


def theorem_2(runs: Mapping[str, Result]) -> Measured:
    """Measure Theorem 2: the gain with a limit, unsaturated and saturated, V(t), and the step (33) of its proof."""
    run = runs[L2]
    free, loaded = _gain(runs[SHAKEN], STEADY), _gain(runs[OVERLOADED])
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
    excess = storage.excess(runs[OVERLOADED])
    end, allowed = storage.storage(runs[OVERLOADED])[-1], storage.bound(runs[OVERLOADED])[-1]
    text += f"; V at the end {end:.2g}, allowed {allowed:.2g}"
    holds = {"unsaturated": free <= GAMMA, "saturated": loaded <= GAMMA, "V(t) saturated": excess <= storage.ROUNDING}
    return Measured(text, holds)
