"""FMUs of the parts, built once, and instances of them."""

import os
from pathlib import Path

import pytest

from fmus.export.native.native_fmu import build_native

from .parts import every
from .slaves import Slave, unpack

PARTS = every()


@pytest.fixture(autouse=True, scope="session")
def date():
    """One date for all FMUs that are built here: then the same component gives the same bytes."""
    before = os.environ.get("SOURCE_DATE_EPOCH")
    os.environ["SOURCE_DATE_EPOCH"] = "1790000000"
    yield
    os.environ.pop("SOURCE_DATE_EPOCH") if before is None else os.environ.update(SOURCE_DATE_EPOCH=before)


@pytest.fixture(scope="session")
def fmus(tmp_path_factory):
    """A function: name of a part -> its FMU, built once and unpacked beside itself."""
    folder = tmp_path_factory.mktemp("native")
    built: dict[str, Path] = {}

    def fmu(name: str) -> Path:
        if name not in built:
            built[name] = build_native(PARTS[name], folder / f"{name}.fmu")
            unpack(built[name])
        return built[name]

    return fmu


@pytest.fixture
def open_slave(fmus):
    """A function: name of a part -> an instance, freed at the end of the test."""
    opened: list[Slave] = []

    def slave(name: str, instance: str = "unit") -> Slave:
        opened.append(Slave(fmus(name).with_suffix(""), instance))
        return opened[-1]

    yield slave
    for one in opened:
        one.freeInstance()
