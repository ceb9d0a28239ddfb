"""What `adcs show` says of a result folder: what flew, how it ended, what is kept."""

import os
from collections.abc import Mapping, Sequence
from fractions import Fraction
from pathlib import Path
from typing import Any

from cosim.cli import console
from cosim.errors import ResultUnreadable, near
from cosim.results import process, story
from cosim.results.checkpoint import Checkpoint, CheckpointRefused
from cosim.results.folder import holds_result
from cosim.results.names import CHECKPOINT, FORMATS, INFO, STREAM
from cosim.results.result import Result
from cosim.time import written


def is_result(folder: Path) -> bool:
    """Whether a path is a folder with a result, or with what a run has left of one."""
    return os.path.isdir(folder) and holds_result(folder)


def write_result(folder: Path) -> None:
    """Print what flew, how it ended, how far it came, the rows, what FMUs said; raises `ResultUnreadable`.

    Of a run whose process has died run.json says so from now on.
    """
    info = story.settle(folder)
    console.write("\n".join([*_ending(info), _rows(folder, info), *_checkpoint(folder), *_process(info)]))
    components: Mapping[str, Mapping[str, Any]] = info.get("components", {})
    rows = [(name, c["reference"], c["generation_tool"] or "", c["guid"]) for name, c in components.items()]
    console.write_table(("instance", "FMU", "made by", "GUID"), rows, whole=(0, 1))
    for line in (*console.said(info), *console.returned(info)):
        console.write(line)


def _ending(info: Mapping[str, Any]) -> Sequence[str]:
    """Return the first lines: what flew and how it ended, as run.json has it."""
    if not info:
        return [f"there is no {INFO}: how the run ended is not known"]
    lines = [f"{info['system']}: {info['status']}"]
    if info.get("why"):
        lines.append(str(info["why"]))
    if info.get("event"):
        lines.append(console.event(info["event"]))
    lines += console.happened(info)
    times = f"{info['start_time']:g} to {info['stop_time']:g} s in steps of {info['communication_step_size']:g} s"
    loop = f", loop {info['loop']['name']}" if info.get("loop") else ""
    return [*lines, f"asked for: {times}, master {info['master']['name']}{loop}"]


def _rows(folder: Path, info: Mapping[str, Any]) -> str:
    """Return how many rows there are, how far they reach, and where."""
    try:
        result = Result.read(folder)
    except ResultUnreadable as error:
        return f"no rows: {error}"
    reached = f", the last at {result.time[-1]:.12g} s" if len(result) else ""
    file = next(f for f in (*(f"result.{kind}" for kind in FORMATS), STREAM) if (folder / f).is_file())
    lost = info.get("rows", len(result)) - len(result)
    missing = f"; {lost} more were recorded" if lost > 0 else ""
    return f"{len(result)} rows{reached}, in {near(folder / file)}{missing}"


def _checkpoint(folder: Path) -> Sequence[str]:
    """Return what can be gone on from: the time that the checkpoint is of, its rows, when it was saved, and how."""
    if not (folder / CHECKPOINT).exists():
        return []
    try:
        found = Checkpoint.read(folder)
    except CheckpointRefused as error:
        return [f"no checkpoint: {error}"]
    of = f"checkpoint of {found.time:.12g} s with {found.rows} rows, saved {found.written[:19].replace('T', ' ')} UTC"
    return [f"{of}, then every {written(Fraction(found.every))}; go on from it: adcs run --resume {near(folder)}"]


def _process(info: Mapping[str, Any]) -> Sequence[str]:
    return [f"flown by {process.name(info)}\n"] if info.get("process") else []
