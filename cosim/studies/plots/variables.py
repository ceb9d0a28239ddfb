"""Figures of chosen variables, and of the difference of two runs."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase

import numpy as np
from matplotlib.figure import Figure

from cosim.arrays import FloatArray, IntArray
from cosim.errors import SimulationError, UnknownName
from cosim.results.result import Result
from cosim.studies.metrics import rotations
from cosim.studies.plots.marks import mark
from cosim.studies.plots.pages import Panel, Trace, draw_panels
from cosim.studies.plots.shown import components_of, unit_of
from cosim.studies.roles import Loop, loops
from fmus.description.names import canonical

NANOSECONDS = 1e9
USUAL = ("q_BN", "q_SN", "omega_BN_B", "omega_SN_S", "tau_B", "h_B", "eta", "r_rel")
"""Of a plant: what a difference shows unless variables are named."""


@dataclass(eq=False)
class NothingInCommon(SimulationError):
    """Two runs of which no difference can be taken; `what` they do not share, of each what it has."""

    what: str
    first: str
    second: str
    advice: str

    def __str__(self) -> str:
        """What is not shared, both sides, the way out."""
        return f"the runs have no {self.what} in common: {self.first}; {self.second}. {self.advice}"


def choose(runs: Mapping[str, Result], patterns: Sequence[str]) -> list[str]:
    """Return the variables that patterns choose, arrays whole, in the order of the runs' columns.

    A pattern is a name (of an array or an element) or has * and ?; "[" stands for itself, as in names. Raises
    `UnknownName` for a pattern that no run has a number for.
    """
    known = list(dict.fromkeys(name for run in runs.values() for name in _numbers(run)))
    chosen: dict[str, None] = {}
    for pattern in patterns:
        wanted = canonical(pattern)
        if any(wanted in run for run in runs.values()) and wanted not in known:
            found = [wanted]  # an element
        else:
            found = [name for name in known if name == wanted or fnmatchcase(name, pattern.replace("[", "[[]"))]
        if not found:
            raise UnknownName("variable", pattern, f"the result{'s' if len(runs) > 1 else ''}", known)
        chosen |= dict.fromkeys(found)
    return [name for name in known if name in chosen] + [name for name in chosen if name not in known]


def draw_variables(runs: Mapping[str, Result], patterns: Sequence[str]) -> dict[str, Figure]:
    """Return the figures of the variables that patterns choose, a panel each; raises `UnknownName`."""
    panels: list[Panel] = []
    for name in choose(runs, patterns):
        first = next(run for run in runs.values() if name in run)
        unit, factor = unit_of(name, first.units.get(name))
        traces = [
            Trace(label, run.time, factor * _flat(run[name]))
            for label, run in runs.items()
            if name in run and run[name].shape[1:] == first[name].shape[1:]
        ]
        panels.append(Panel(name, unit, components_of(name, first[name].shape[1:]), traces))
    return mark(draw_panels(panels, "variables", f"Variables of {', '.join(runs)}"), runs)


def draw_difference(runs: Mapping[str, Result], patterns: Sequence[str] = ()) -> tuple[dict[str, Figure], str]:
    """Return figures of the second run less the first, and in words at which times.

    Rows of both runs at one time, to a nanosecond, are compared; nothing is interpolated, for that would show as a
    difference. Of two attitudes it is the rotation vector from the first to the second, deg. Raises `UnknownName`,
    `NothingInCommon`.
    """
    (first_name, first), (second_name, second) = runs.items()
    one, other = common_times(first, second)
    if len(one) < 2:
        raise NothingInCommon(
            "two times" if len(one) else "time",
            f"{first_name} has {_times(first)}",
            f"{second_name} has {_times(second)}",
            "Fly both with one --step and --every.",
        )
    shared = [n for n in _numbers(first) if n in second and first[n].shape[1:] == second[n].shape[1:]]
    if not shared:
        raise NothingInCommon(
            "variable",
            f"{first_name} has {_listed(first)}",
            f"{second_name} has {_listed(second)}",
            "Record some variables of equal names in both.",
        )
    names = choose({"": _only(first, shared)}, patterns) if patterns else _usual(first, shared)
    time, label = first.time[one], f"{second_name} less {first_name}"
    panels = [_difference(name, first, second, one, other, time, label) for name in names]
    figures = draw_panels(panels, "difference", f"Difference: {label}")
    return figures, f"{label} at {len(one)} common times, of {len(first)} and {len(second)} rows"


def common_times(first: Result, second: Result) -> tuple[IntArray, IntArray]:
    """Return the rows of two runs that are of one time, to a nanosecond."""
    before, after = (np.rint(run.time * NANOSECONDS).astype(np.int64) for run in (first, second))
    _, one, other = np.intersect1d(before, after, return_indices=True)
    return one, other


def _difference(
    name: str, first: Result, second: Result, one: IntArray, other: IntArray, time: FloatArray, label: str
) -> Panel:
    before, after = first[name][one], second[name][other]
    components, (unit, factor) = components_of(name, before.shape[1:]), unit_of(name, first.units.get(name))
    if components == ["w", "x", "y", "z"]:
        turned = (rotations(before).inv() * rotations(after)).as_rotvec(degrees=True)
        return Panel(name, "deg", ["x", "y", "z"], [Trace(label, time, turned)])
    rows = factor * (_flat(after).astype(float) - _flat(before).astype(float))
    return Panel(name, unit, components, [Trace(label, time, rows)])


def _usual(run: Result, shared: Sequence[str]) -> Sequence[str]:
    """Return what a difference shows unless it is named: of the plants, else all."""
    found: list[Loop] = loops(run)
    names = [f"{loop.plant}.{name}" for loop in found for name in USUAL]
    return [name for name in names if name in shared] or shared


def _only(run: Result, names: Sequence[str]) -> Result:
    """Return a run with some of its arrays alone."""
    kept = [c for c in run.table.column_names if c == "time" or any(c == n or c.startswith(f"{n}[") for n in names)]
    return Result(run.table.select(kept), run.info)


def _numbers(run: Result) -> list[str]:
    return [name for name in run.names if run[name].dtype != object]


def _flat(rows: FloatArray) -> FloatArray:
    return rows.reshape(len(rows), -1)


def _times(run: Result) -> str:
    apart = f" {np.median(np.diff(run.time)):.6g} s apart" if len(run) > 1 else ""
    return f"{len(run)} rows, {run.time[0]:.6g} to {run.time[-1]:.6g} s{apart}" if len(run) else "no rows"


def _listed(run: Result) -> str:
    return ", ".join(_numbers(run)) or "none"
