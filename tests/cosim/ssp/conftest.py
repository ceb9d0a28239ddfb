"""FMUs that every package here is made of, and packages of systems of ours."""

import pytest

from cosim import Library
from cosim.cli.packing import export

from .packages import fmus as fmus


@pytest.fixture(scope="module")
def library():
    return Library()


@pytest.fixture(scope="module")
def unbuilt(library):
    """FMUs go out as they are in the library: to build start values into each takes seconds (test_export.py does)."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("cosim.cli.packing.build_reference", lambda reference, *_: library(reference))
        yield


@pytest.fixture
def exported(tmp_path, library):
    """Write a system and return the file."""

    def call(system, experiment, **more):
        path = tmp_path / f"{system.name}.ssp"
        export(path, system, experiment, library, **more)
        return path

    return call
