"""How two flights of one FMU differ, and what is the cause."""

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
from setup import Setup

from fmus.description.names import canonical

Columns = Mapping[str, np.ndarray]
Again = Callable[..., Columns | None]

Both = Callable[[Setup], tuple[Columns | None, Columns | None]]

CLOSE = 1e-9
"""A tolerance at which two integrators have one solution."""

SHORT = 5
"""How many names are listed."""


def difference(here: Columns, there: Columns, told: Setup) -> str:
    """Return what differs in words, nothing where all bits of all common columns agree."""
    names = {canonical(name): name for name in there if name != "time"}
    common = [name for name in here if name in names]
    if not common:
        return "" if not names else f"no common columns: {', '.join(list(names)[:SHORT])}"
    rows = min(len(here["time"]), len(there["time"]))
    worst: dict[str, float] = {}
    for name in common:
        a, b = here[name][:rows], there[names[name]][:rows]
        same = (a == b) | (np.isnan(a) & np.isnan(b))
        if not same.all():
            scale = max(np.nanmax(np.abs(b)), 1e-300)
            off = np.abs(a - b)[~same]
            worst[name] = float(np.max(np.where(np.isfinite(off), off, np.inf)) / scale)
    said: list[str] = []
    if len(here["time"]) != len(there["time"]):
        ends = here["time"][-1], there["time"][-1]
        said.append(f"{len(here['time'])} rows to {ends[0]:g} s here, {len(there['time'])} to {ends[1]:g} s in fmpy")
    if worst:
        most = max(worst, key=worst.__getitem__)
        said.append(f"{len(worst)} of {len(common)} columns, {worst[most]:.1e} of {most}")
    return "; ".join(said)


def cause(found: str, here: Columns, again: Again, both: Both, told: Setup, kind: str) -> tuple[str, str]:
    """Return outcome and cause, by flights in fmpy that change one thing; of models, by one with a closer tolerance."""
    if kind == "ME":
        closer = replace(told, tolerance=CLOSE)
        one, other = both(closer)
        left = "no flight" if one is None or other is None else difference(one, other, told) or "equal bits"
        return "differs", f"{found}: two ways of an integrator; at a tolerance of {CLOSE:g}: {left}"
    exact = again(exact=True)
    if exact is not None and not difference(here, exact, told):
        return "differs", f"{found}: t + h, fmpy sums up its times; at the same times equal bits"
    held = again(exact=True, inputs=True)
    if held is not None and not difference(here, held, told):
        return "differs", f"{found}: its inputs are set here; in fmpy with inputs set, at the same times, equal bits"
    if exact is not None:
        twice = again(exact=True)
        if twice is not None and (own := difference(exact, twice, told)):
            return "differs", f"{found}: not the same twice in fmpy either ({own})"
        found = difference(here, exact, told)
    return "DIFFERS", f"{found}: at the same times"
