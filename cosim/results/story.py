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
from cosim.results.names import CHECKPOINT, INFO, STREAM
from cosim.slaves import breadcrumb

_log = logging.getLogger(__name__)

ROOM = 2400
"""Blanks after the status of a run that goes on, for how it ends: written by a handler when an FMU ends the process
(crash.h), or where the disk is full."""

LONGEST_WHY = 300
"""Characters of a cause that fit there, of 4 bytes or escaped as they may be."""


class Story:
    """run.json of one run: "running" from its beginning on, at the end what came of it; without a folder nothing.

    `problem`: why the beginning could not be written, None where it was.
    """

    def __init__(self, folder: Path | None, info: Mapping[str, Any]) -> None:
        self.folder, self.at = folder, -1
        self.problem: ResultUnwritable | None = None
        if folder is not None:
            try:
                self.at = write_info(folder, {**info, "status": "running"}, ROOM)
            except ResultUnwritable as error:
                self.problem = error

    def end(self, info: Mapping[str, Any]) -> ResultUnwritable | None:
        """Write the end; where there is no room for it only how it ended, in the blanks, and return why."""
        if self.folder is None:
            return None
        try:
            write_info(self.folder, info)
        except ResultUnwritable as error:
            self._end_in_place(info if info.get("error") else {**info, **runinfo.broken(error)})
            return error
        return None

    def _end_in_place(self, info: Mapping[str, Any]) -> None:
        """Write how a run ended into the blanks of run.json, which is on the disk already."""
        if self.folder is None or self.at < 0:
            return
        why = str(info.get("why", ""))[:LONGEST_WHY]
        short = {"status": info["status"], "error": info.get("error"), "why": why}
        short |= {key: info[key] for key in ("reached_time", "rows") if key in info}
        text = json.dumps(short, ensure_ascii=False)[len('{"status": ') : -1].encode(errors="replace")
        with suppress(OSError), (self.folder / INFO).open("rb+") as file:
            file.seek(self.at)
            file.write(text.ljust(ROOM))


@contextmanager
def told(folder: Path | None, info: Mapping[str, Any]) -> Generator[Story]:
    """Have run.json say "running" within, "crashed" if an FMU ends the process, and what exception left, if one did."""
    story = Story(folder, info)
    try:
        with _open_to_handlers(folder, story.at):
            yield story
    except BaseException as error:
        story.end({**info, **runinfo.broken(error)})
        raise


@contextmanager
def _open_to_handlers(folder: Path | None, at: int) -> Generator[None]:
    if folder is None or at < 0 or os.name == "nt":  # there no handler writes, and what is open cannot be replaced
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
    if not os.path.isfile(path):
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
        raise ResultExists(folder, _left_behind(folder), (folder / CHECKPOINT).exists())


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
