"""The folder of a result: what may be in it, and how it is made, emptied and told."""

import json
import math
import os
from collections.abc import Generator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from cosim.errors import ResultUnwritable
from cosim.results.names import FILES, INFO, PARTS

LONGEST = 255
"""Bytes of a name that file systems take."""


def place(out: Path | str | None) -> Path | None:
    """Return the folder that is meant, absolute; raises `ResultUnwritable` for a path that no folder can have."""
    if out is None:
        return None
    folder = Path(out)
    if "\0" in str(folder):
        raise ResultUnwritable(Path(str(folder).replace("\0", "\\0")), "there is a NUL in its name")
    try:
        for part in folder.parts:
            size = len(os.fsencode(part))
            if size > LONGEST:
                raise ResultUnwritable(folder, f"a name of {size} bytes is in it, {LONGEST} are allowed")
        os.stat(folder.absolute())
    except FileNotFoundError as error:
        if not folder.is_absolute() and not _working_folder_is_there():
            raise ResultUnwritable(folder, "the working folder has been deleted") from error
    except NotADirectoryError:
        pass  # `make_folder` says which file is in the way
    except (OSError, ValueError) as error:
        raise ResultUnwritable(folder, getattr(error, "strerror", None) or str(error)) from error
    return folder.absolute()


def _working_folder_is_there() -> bool:
    try:
        return os.path.isdir(os.getcwd())
    except OSError:
        return False


def holds_result(folder: Path) -> bool:
    """Whether a folder holds a result, or what a run has left of one."""
    return any(os.path.lexists(folder / name) for name in FILES)


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
    for path in (folder / name for name in (*FILES, *PARTS)):
        if path.is_dir() and not path.is_symlink():
            raise ResultUnwritable(path, "it is a folder")
        with writing(path):
            path.unlink(missing_ok=True)


@contextmanager
def writing(path: Path) -> Generator[None]:
    """Within, a file is written; one that there is no room for is removed. Raises `ResultUnwritable`."""
    try:
        yield
    except OSError as error:
        with suppress(OSError):
            path.unlink(missing_ok=True)
        raise ResultUnwritable(path, error.strerror or str(error)) from error


def write_text(path: Path, text: str) -> None:
    """Write a file whole or not at all. Raises `ResultUnwritable`."""
    part = path.with_name(f".{path.name}")
    try:
        with writing(part):
            part.write_text(text, encoding="utf-8")
            part.replace(path)
    except ResultUnwritable as error:
        raise ResultUnwritable(path, error.problem) from error


def write_info(folder: Path, info: Mapping[str, Any], room: int = 0) -> int:
    """Write run.json whole or not at all. Raises `ResultUnwritable`.

    `room`: so many blanks follow the last value; returned is where that stands, in bytes.
    """
    *_, last = info
    value = json.dumps(info[last], default=str)
    text = json.dumps(info, indent=2, allow_nan=False, default=str).removesuffix("\n}")
    write_text(folder / INFO, f"{text}{' ' * room}\n}}\n")
    return len(text.encode()) - len(value.encode())


def finite(value: Any) -> Any:
    """Return a metric with None for what is not finite, which JSON has no word for: a run may end far out."""
    if isinstance(value, list):
        return [finite(v) for v in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
