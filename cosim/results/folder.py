"""The folder of a result: what may be in it, and how it is made, emptied and told."""

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from cosim.errors import ResultUnwritable
from cosim.results.names import FILES, INFO, PARTS


def holds_result(folder: Path) -> bool:
    """Whether a folder holds a result, or what a run has left of one."""
    return any((folder / name).exists() for name in FILES)


def make_folder(folder: Path) -> None:
    """Make a folder for results; raises `ResultUnwritable`."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        problem = "it is a file" if folder.is_file() else error.strerror or str(error)
        raise ResultUnwritable(folder, problem) from error


def clear(folder: Path) -> None:
    """Make the folder; remove an older result in it, what one that died has left, and nothing else.

    Raises `ResultUnwritable`.
    """
    make_folder(folder)
    try:
        for name in (*FILES, *PARTS):
            (folder / name).unlink(missing_ok=True)
    except OSError as error:
        raise ResultUnwritable(folder, error.strerror or str(error)) from error


def write_info(folder: Path, info: Mapping[str, Any], room: int = 0) -> int:
    """Write run.json whole or not at all. Raises `ResultUnwritable`.

    `room`: so many blanks follow the last value; returned is where that stands, in bytes.
    """
    part = folder / f".{INFO}"
    *_, last = info
    value = json.dumps(info[last], default=str)
    text = json.dumps(info, indent=2, allow_nan=False, default=str).removesuffix("\n}")
    try:
        part.write_text(f"{text}{' ' * room}\n}}\n", encoding="utf-8")
        part.replace(folder / INFO)
    except OSError as error:
        raise ResultUnwritable(folder / INFO, error.strerror or str(error)) from error
    return len(text.encode()) - len(value.encode())


def finite(value: Any) -> Any:
    """Return a metric with None for what is not finite, which JSON has no word for: a run may end far out."""
    if isinstance(value, list):
        return [finite(v) for v in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
