"""Which process flies a run, and whether it still lives."""

import os
import platform
import subprocess
import sys
from collections.abc import Mapping
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import Any


def describe() -> dict[str, Any]:
    """Return which process runs, where, since when, and when the flight that begins has begun (UTC)."""
    began = f"{datetime.now(UTC):%Y-%m-%dT%H:%M:%SZ}"
    own = os.getpid()
    return {"process": own, "host": platform.node(), "process_start": _start(own), "started": began}


def has_ended(info: Mapping[str, Any]) -> bool:
    """Whether the process of run.json has ended for certain; of one on another machine nobody here knows.

    A process with its number that started at another time is another one.
    """
    number, start = info.get("process"), info.get("process_start")
    if not isinstance(number, int) or start is None or info.get("host") != platform.node():
        return False
    return _start(number) != start


def name(info: Mapping[str, Any]) -> str:
    """Return the process of run.json in words."""
    return f"process {info.get('process')} on {info.get('host')}, since {info.get('started')}"


def _start(number: int) -> str | None:
    """Return what tells a living process from every other one of its number, None where there is none."""
    if sys.platform == "linux":
        with suppress(OSError, ValueError):
            # after the name in brackets: the state, and as the 20th field the start in ticks since the boot
            fields = Path(f"/proc/{number}/stat").read_text(errors="replace").rpartition(")")[2].split()
            boot = Path("/proc/sys/kernel/random/boot_id").read_text().strip()
            return None if fields[0] in "ZX" else f"{boot} {fields[19]}"
        return None
    if sys.platform == "win32":
        return None  # it is not known there: the lock alone tells whether the folder is in use
    done = subprocess.run(["ps", "-p", str(number), "-o", "lstart="], capture_output=True, text=True, check=False)
    return done.stdout.strip() or None
