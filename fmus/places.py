"""Where this project keeps what it makes for itself: built FMUs, the compiled kernel, extracted FMUs.

All in one folder of the user's: $ADCS_BUILD, else the platform's cache folder. Where that cannot be written, a
temporary folder takes its place, and one line says so; never the package. FMUs are code that is loaded into the
process, so a folder that somebody else can write is refused.
"""

import atexit
import logging
import os
import shutil
import stat
import sys
import tempfile
import threading
from pathlib import Path
from typing import IO

from fmus.errors import PlaceUnusable

if sys.platform == "win32":
    import msvcrt

    def _lock(file: IO[bytes], wait: bool) -> None:
        msvcrt.locking(file.fileno(), msvcrt.LK_LOCK if wait else msvcrt.LK_NBLCK, 1)
else:
    import fcntl

    def _lock(file: IO[bytes], wait: bool) -> None:
        fcntl.flock(file, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB))


LOCK, TURN, TEMPORARY = ".lock", ".turn", "adcs-cosim-"
_turn = threading.RLock()  # one thread at a time makes, sweeps or finds a folder
_usable: set[Path] = set()
_own: dict[tuple[int, Path | None], Path] = {}
"""Temporary folders of processes: (process, cache) -> extracted FMUs, (process, None) -> what stands for the cache."""
_held: dict[Path, IO[bytes]] = {}  # folder -> its lock, locked


def _after_fork() -> None:
    global _turn
    _turn = threading.RLock()  # another thread of the parent may have held it


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_after_fork)


def _hold(file: IO[bytes], wait: bool) -> bool:
    """Lock a file until it is closed; return whether it is, False too on a file system without locks."""
    try:
        _lock(file, wait)
    except OSError:
        return False
    return True


def cache() -> Path:
    """Return the folder of all that is kept between runs, made and checked; raises PlaceUnusable."""
    chosen = os.environ.get("ADCS_BUILD")
    with _turn:
        folder = Path(chosen).absolute() if chosen else _default_or_temporary()
        problem = _problem(folder)
        if problem:
            raise PlaceUnusable(folder, problem, "Set ADCS_BUILD to a folder that you can write, or unset it.")
        _refuse_what_others_write(folder)
    return folder


def kernel() -> Path:
    """Return the folder of compiled kernels, made."""
    return made(cache() / "kernel")


def extracted() -> Path:
    """Return this process's folder of extracted FMUs, made; it is removed at exit.

    What processes that ended without their exit have left is removed when it is made.
    """
    place = cache()
    with _turn:
        folder = _own.get((os.getpid(), place))
        if folder is None or not folder.is_dir():
            folder = _own[os.getpid(), place] = _of_this_process(made(place / "extracted"))
    return folder


def workshop(beside: Path | None = None) -> Path:
    """Return where a temporary folder belongs: this process's own, which the next one sweeps if this one is killed.

    `beside`: a folder, made here, that what is made goes to by a change of its name; outside the cache it is that one.
    """
    if beside is not None and not made(beside).absolute().is_relative_to(cache()):
        return beside
    return extracted()


def made(folder: Path) -> Path:
    """Make a folder, and those above it, for this user alone; return it."""
    if not folder.is_dir():
        if folder.parent != folder:
            made(folder.parent)
        folder.mkdir(mode=0o700, exist_ok=True)
    return folder


def keep(part: Path, path: Path) -> None:
    """Give a file that is whole its name, once it is on the disk: after a power cut it is whole or not there."""
    with part.open("rb+") as file:
        os.fsync(file.fileno())
    os.replace(part, path)


# ---- the cache -------------------------------------------------------------------------------------------------


def _default() -> Path:
    """Return the platform's cache folder for us; RuntimeError where the user has no home."""
    if sys.platform == "win32":
        base = os.environ.get("LOCALAPPDATA") or Path.home() / "AppData" / "Local"
    elif sys.platform == "darwin":
        base = _home() / "Library" / "Caches"
    else:
        base = os.environ.get("XDG_CACHE_HOME") or _home() / ".cache"
    return Path(base).absolute() / "adcs-cosim"


def _home() -> Path:
    if os.environ.get("HOME") == "":  # pathlib takes that for the root folder
        raise RuntimeError("HOME is empty")
    return Path.home()


def _default_or_temporary() -> Path:
    try:
        folder = _default()
    except RuntimeError as error:
        return _instead("the cache folder", str(error))
    problem = _problem(folder)
    return _instead(str(folder), problem) if problem else folder


def _problem(folder: Path) -> str:
    """Make a folder and try whether it can be written, once; return what is wrong, "" if nothing is."""
    if folder in _usable and folder.is_dir():
        return ""
    try:
        with tempfile.TemporaryFile(dir=made(folder), prefix=".trial-"):
            _usable.add(folder)
        return ""
    except OSError as error:
        return f"{error.strerror}: {error.filename}" if error.filename else str(error)


def _instead(folder: str, problem: str) -> Path:
    """Return a temporary folder for this process, the same at each call."""
    found = _own.get((os.getpid(), None))
    if found is None:
        _sweep_temporary()
        found = _own[os.getpid(), None] = Path(tempfile.mkdtemp(prefix=TEMPORARY))
        _held[found] = open(found.with_suffix(LOCK), "ab")
        _hold(_held[found], wait=False)
        atexit.register(_remove, os.getpid(), found)
        logging.getLogger(__name__).warning(
            "%s cannot be written (%s): FMUs are built in %s, which goes at the end of this process. "
            "Set ADCS_BUILD to a folder that you can write to keep them.",
            folder,
            problem,
            found,
        )
    return found


def _refuse_what_others_write(folder: Path) -> None:
    if os.name != "posix":
        return
    found = folder.stat()
    if found.st_mode & 0o022:
        mode = stat.filemode(found.st_mode)
        raise PlaceUnusable(
            folder,
            f"others can write it (mode {stat.S_IMODE(found.st_mode):04o}, {mode}), and what lies there is run",
            f"Take that away: chmod go-w '{folder}'.",
        )
    if found.st_uid not in (0, os.geteuid()):
        raise PlaceUnusable(
            folder,
            f"it belongs to another user (number {found.st_uid}, this is {os.geteuid()}), and what lies there is run",
            "Set ADCS_BUILD to a folder of your own.",
        )


# ---- folders of processes ----------------------------------------------------------------------------------------


def _of_this_process(parent: Path) -> Path:
    """Sweep, then make a folder for this process; its lock, beside it, is held as long as the process lives.

    The lock tells whether the owner lives, on whatever machine or in whatever container it runs; the number after the
    pid tells it from one that has the same pid there or later.
    """
    with open(parent / TURN, "ab") as turn:  # one process at a time: none takes a lock that is just being made
        _hold(turn, wait=True)
        _sweep(parent)
        folder = parent / f"{os.getpid()}-{os.urandom(8).hex()}"
        _held[folder] = open(folder.with_suffix(LOCK), "ab")
        _hold(_held[folder], wait=False)
        folder.mkdir(mode=0o700)
    atexit.register(_remove, os.getpid(), folder)
    return folder


def _sweep_temporary() -> None:
    """Remove what processes of this user that were killed have left in the system's temporary folder."""
    try:
        _sweep(Path(tempfile.gettempdir()), TEMPORARY)
    except OSError:  # a lock of another user's, or one that another process has just removed
        return


def _sweep(parent: Path, prefix: str = "") -> None:
    """Remove the folders whose lock nobody holds any more."""
    for lock in parent.glob(f"{prefix}*{LOCK}"):
        with open(lock, "ab") as file:
            dead = _hold(file, wait=False)
        if dead:
            shutil.rmtree(lock.with_suffix(""), ignore_errors=True)
            lock.unlink(missing_ok=True)


def _remove(pid: int, folder: Path) -> None:
    """Remove a folder at exit, unless this is a process forked from its owner."""
    if os.getpid() == pid:
        shutil.rmtree(folder, ignore_errors=True)
        if folder in _held:
            _held.pop(folder).close()
            folder.with_suffix(LOCK).unlink(missing_ok=True)
