"""An FMU against the CSV beside it, NAME_ref.csv or NAME_out.csv: `time`, then columns named as its variables.

The flight is that of the CSV's rows; the tolerance is the FMU's own of its DefaultExperiment, of each column's largest
value. An array of FMI 3.0 is one column, elements with blanks between them. Binaries are passed over and named.
"""

import csv
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from setup import Setup, described

from cosim.time import exact_seconds

EXACT = 1e-9
"""The tolerance where an FMU has none."""


def against_reference(path: Path, fly: Callable[[Setup], Any]) -> tuple[str, str]:
    """Return outcome and what there is to say."""
    name = path.stem.split("+")[-1]
    files = [path.with_name(f"{name}_{kind}.csv") for kind in ("ref", "out")]
    file = next((file for file in files if file.is_file()), None)
    if file is None:
        return "no reference", f"no {files[0].name} beside it"
    about = described(path)
    with open(file, newline="", encoding="utf-8") as read:
        head, *rows = csv.reader(read)
    times = np.array([float(row[0]) for row in rows])
    kinds = {v.name: v.type for v in about.modelVariables}
    wanted = [c for c in head[1:] if kinds.get(c, "Binary") != "Binary"]
    if not wanted:
        return "no reference", f"{file.name} has none of its variables"
    flown = fly(_setup(times, wanted, about))
    if flown.columns is None:
        return "refused", flown.why
    said = about.defaultExperiment.tolerance if about.defaultExperiment else None
    tolerance = float(said or EXACT)
    grid = [int(np.argmin(np.abs(flown.columns["time"] - t))) for t in times]
    off = {c: _off(flown.columns, c, [row[head.index(c)] for row in rows], grid) for c in wanted}
    worst = max(off, key=off.__getitem__)
    passed = sorted(set(head[1:]) - set(wanted))
    more = f"; without {', '.join(passed)}" if passed else ""
    outcome = "within" if off[worst] <= tolerance else "BEYOND"
    compared = f"{len(wanted)} columns, {len(rows)} rows"
    return outcome, f"{compared}, {off[worst]:.1e} of {worst}, tolerance {tolerance:g}{more}"


def _setup(times: np.ndarray, wanted: list[str], about: Any) -> Setup:
    step = exact_seconds(float(np.round(np.diff(times)[np.diff(times) > 0].min(), 9)), "step")
    begin, end = exact_seconds(times[0], "start"), exact_seconds(times[-1], "stop")
    points = tuple(float(begin + k * step) for k in range(round((end - begin) / step) + 1))
    said = about.defaultExperiment.tolerance if about.defaultExperiment else None
    return Setup(float(begin), float(step), points, float(said) if said else None, tuple(wanted))


def _off(found: Any, name: str, given: list[str], grid: list[int]) -> float:
    """The largest deviation, of the largest value; of texts and flags 0 or infinite."""
    own = [key for key in found if key == name or key.startswith(f"{name}[")]
    if found[own[0]].dtype.kind not in "fb":
        return 0.0 if [str(found[own[0]][k]) for k in grid] == given else np.inf
    words = {"true": 1.0, "false": 0.0}
    there = np.array([[words[w] if w in words else float(w) for w in row.split()] for row in given])
    here = np.column_stack([found[key][grid] for key in own])
    return float(np.max(np.abs(here - there)) / max(np.max(np.abs(there)), 1e-300))
