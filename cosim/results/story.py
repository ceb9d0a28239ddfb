"""run.json from the first step of a run to its end, whatever that is."""

import os
from collections.abc import Generator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from cosim.errors import ResultUnwritable, near
from cosim.results import runinfo
from cosim.results.folder import write_info
from cosim.results.names import INFO, STREAM
from cosim.slaves import breadcrumb

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
