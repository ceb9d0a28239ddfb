"""What the runs are of that were interrupted."""

from pathlib import Path

import pytest

from .. import both, slope_fmus
from .left import counter, interrupted


@pytest.fixture(scope="module")
def fmu(tmp_path_factory):
    """y counts steps."""
    return counter(tmp_path_factory.mktemp("counter"))


@pytest.fixture(scope="module")
def slopes(tmp_path_factory):
    return slope_fmus.made(tmp_path_factory.mktemp("slopes"))


@pytest.fixture
def alone(fmu):
    return both.of({"a": fmu}, [])


@pytest.fixture
def left(alone, tmp_path, monkeypatch):
    """A run of 1 s that was interrupted at 0.5 s, in the folder `out` of where the test is."""
    monkeypatch.chdir(tmp_path)
    interrupted(alone, both.experiment(), Path("out"))
    return Path("out")
