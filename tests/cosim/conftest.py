"""The command line in a folder of its own, outside the repository; a disk of its own."""

import shutil
import subprocess
from collections.abc import Callable
from dataclasses import dataclass

import pytest
from typer.testing import CliRunner

from cosim.cli.commands import app


@dataclass(frozen=True)
class Outcome:
    """What a command left in the terminal."""

    status: int
    out: str
    err: str


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """An empty folder, which the test is in."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def adcs(folder) -> Callable[..., Outcome]:
    """`adcs` in that folder, in this process; an exception that a user would see as a traceback is raised."""

    def call(*arguments: object) -> Outcome:
        result = CliRunner().invoke(app, [str(a) for a in arguments])
        if result.exception is not None and not isinstance(result.exception, SystemExit):
            raise result.exception
        return Outcome(result.exit_code, result.stdout, result.stderr)

    return call


@pytest.fixture
def disk(tmp_path):
    """A disk of its own: call it with its size in kilobytes; skipped where nothing can be mounted."""
    place = tmp_path / "disk"
    place.mkdir()

    def call(kilobytes):
        mount = ["mount", "-t", "tmpfs", "-o", f"size={kilobytes}k,mode=700", "none", str(place)]
        if shutil.which("mount") is None or subprocess.run(mount, capture_output=True, check=False).returncode:
            pytest.skip("nothing can be mounted here")
        return place

    yield call
    subprocess.run(["umount", "-l", str(place)], capture_output=True, check=False)
