"""One run at a time writes into a folder: a lock that ends with the process that has it, whatever ends that."""

import os
import platform
import sys
from collections.abc import Generator
from contextlib import contextmanager, suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import IO

from cosim.errors import ResultBusy, ResultUnwritable
from cosim.results.folder import make_folder

LOCK = ".run.lock"

if sys.platform == "win32":
    import msvcrt

    def _lock(file: IO[str]) -> None:
        msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)
else:
    import fcntl

    def _lock(file: IO[str]) -> None:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)


@contextmanager
def claimed(folder: Path | None) -> Generator[None]:
    """Within, the folder is made and this run's alone; None: there is nothing to claim.

    Raises `ResultBusy` where another run has it, `ResultUnwritable`.
    """
    if folder is None:
        yield
        return
    make_folder(folder)
    path = folder / LOCK
    with _locked(path) as file:
        words = f"process {os.getpid()} on {platform.node()}, since {datetime.now(UTC):%Y-%m-%d %H:%M:%S} UTC\n"
        with suppress(OSError):  # a full disk: it is locked all the same
            os.truncate(file.fileno(), 0)
            os.write(file.fileno(), words.encode())
        try:
            yield
        finally:
            release(folder)


def release(folder: Path) -> None:
    """Remove the lock's file; where an open one cannot be removed it stays, without a lock."""
    with suppress(OSError):
        (folder / LOCK).unlink()


def _locked(path: Path) -> IO[str]:
    """Return the lock file, locked; it may be removed by its owner between opening and locking."""
    while True:
        try:
            file = path.open("a+", encoding="utf-8")
        except OSError as error:
            raise ResultUnwritable(path, error.strerror or str(error)) from error
        try:
            _lock(file)
        except (BlockingIOError, PermissionError) as error:
            file.seek(0)
            owner = file.read().strip() or "another run"
            file.close()
            raise ResultBusy(path.parent, owner) from error
        except OSError:
            return file  # a file system without locks
        with suppress(OSError):
            if os.path.samestat(os.fstat(file.fileno()), path.stat()):
                return file
        file.close()
