"""The C compiler as a judge of a native FMU's sources."""

import subprocess
from pathlib import Path

from fmus.toolchain import FLAGS, find_compiler

WARNINGS = ("-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wshadow", "-Werror")


def complaints(sources: Path, *more: str) -> str:
    """What the compiler says of fmi2.c in a folder of sources with all warnings on; "" where nothing."""
    command = [*find_compiler(), *FLAGS, *WARNINGS, "fmi2.c", *more]
    done = subprocess.run(command, cwd=sources, capture_output=True, text=True, check=False)
    return done.stderr or "" if done.returncode == 0 else f"status {done.returncode}: {done.stderr}"
