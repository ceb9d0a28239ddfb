"""A runner of `peers/` in a process of its own, by the interpreter that has its tool."""

import json
import os
import subprocess
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

FOLDER = Path(__file__).parent / "peers"
ROOT = FOLDER.parents[2]
ALL = "all"


@dataclass(frozen=True)
class Interpreters:
    """The interpreters of the tools, by their names; `ALL`: of all that have none of their own."""

    paths: Mapping[str, str] = field(default_factory=dict)

    @classmethod
    def told(cls, entries: Sequence[str]) -> "Interpreters":
        """Read PATH, for all tools, or TOOL=PATH."""
        return cls(dict(entry.split("=", 1) if "=" in entry else (ALL, entry) for entry in entries))

    def of(self, tool: str) -> str:
        return self.paths.get(tool, self.paths.get(ALL, sys.executable))


class Missing(Exception):
    """A runner gave no figures; what it said last."""


def run(python: str, runner: str, told: Sequence[str], folder: Path) -> dict[str, Any]:
    """Return the figures that a runner prints as its last line of JSON. Raises `Missing`."""
    paths = [str(FOLDER), str(ROOT)]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(paths)}
    command = [python, str(FOLDER / runner), *told]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, cwd=folder, check=False)
    lines = [line for line in done.stdout.splitlines() if line.startswith("{")]
    if done.returncode or not lines:
        raise Missing((done.stderr.strip().splitlines() or [f"status {done.returncode}"])[-1])
    return json.loads(lines[-1])
