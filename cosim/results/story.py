"""run.json from the first step of a run to its end, whatever that is."""

import json
import logging
import os
from collections.abc import Generator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from cosim.errors import ResultBusy, ResultExists, ResultUnreadable, ResultUnwritable, near
from cosim.results import process, runinfo
from cosim.results.claim import claimed
from cosim.results.folder import clear, holds_result, write_info
from cosim.results.names import INFO, STREAM
from cosim.slaves import breadcrumb

_log = logging.getLogger(__name__)

ROOM = 2400
"""Blanks after the status of a run that goes on: what a handler writes there when an FMU ends the process (crash.h)."""


@contextmanager
def told(folder: Path | None, info: Mapping[str, Any]) -> Generator[None]:
    """Have run.json say "running" within, "crashed" if an FMU ends the process, and what exception left, if one did."""
    if folder is None:
        yield
        return
    at = write_info(folder, {**info, "status": "running"}, ROOM)
    try:
        with _open_to_handlers(folder, at):
            yield
    except BaseException as error:
        with suppress(ResultUnwritable):
            write_info(folder, {**info, **runinfo.broken(error)})
        raise


@contextmanager
def _open_to_handlers(folder: Path, at: int) -> Generator[None]:
    if os.name == "nt":  # no handler writes, and what is open cannot be replaced
        yield
        return
    here = breadcrumb.here()
    outer = here.file, here.at, here.rows
    file = os.open(folder / INFO, os.O_WRONLY | os.O_CLOEXEC)
    here.file, here.at, here.rows = file, at, str(near(folder / STREAM)).encode()
    try:
        yield
    finally:
        here.file, here.at, here.rows = outer
        os.close(file)


def read_info(folder: Path) -> dict[str, Any]:
    """Return what run.json says, with the truth about a run whose process has died: empty where there is none.

    Raises `ResultUnreadable`.
    """
    path = folder / INFO
    if not path.is_file():
        return {}
    try:
        info = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise ResultUnreadable(path, f"it is no JSON: {error}") from error
    if not isinstance(info, dict):
        raise ResultUnreadable(path, f"it is no JSON of a run: {type(info).__name__}, needed is an object")
    if info.get("status") == "running" and process.has_ended(info):
        why = f"its process ended without a word ({process.name(info)}): a kill -9, memory that was out, a power cut"
        info |= {"status": "died", "why": why}
    return info


def settle(folder: Path) -> dict[str, Any]:
    """Return the same, and have run.json say it from now on where it can be written and no run is in the folder."""
    info = read_info(folder)
    if info.get("status") == "died":
        with suppress(ResultBusy, ResultUnwritable), claimed(folder):
            write_info(folder, info)
    return info


def refuse_existing(folder: Path) -> None:
    """Raise `ResultExists`, with how its run ended, if a folder holds a result."""
    if holds_result(folder):
        raise ResultExists(folder, _left_behind(folder))


def replace(folder: Path) -> None:
    """Make the folder, and remove an older result; a line tells of one whose run ended early.

    Raises `ResultUnwritable`.
    """
    behind = _left_behind(folder)
    if behind:
        _log.warning("%s is replaced: it held what is left of a run that %s", near(folder), behind)
    clear(folder)


def _left_behind(folder: Path) -> str:
    """Return how the run in a folder ended if that was by the end of its process."""
    try:
        info = settle(folder)
    except ResultUnreadable:
        return ""
    return f"{info['status']}: {info.get('why')}" if info.get("status") in ("died", "crashed") else ""
