"""Components that are large: their C in pieces, -O1, the same bits; and how long a build takes is told."""

import numpy as np
import pytest

from components.catalog import CATALOG
from fmus import toolchain
from fmus.export import build as building
from fmus.export.native import large
from fmus.export.native.functions import native_functions
from fmus.export.native.native_fmu import build_native, describe_native, native_sources

from .compiling import complaints
from .parts import every
from .slaves import Slave, unpack

PARTS = ("Swing", "Wheel", "Sum", "Modes_2")


@pytest.fixture
def cut(monkeypatch):
    """Everything is large, and a piece is three statements."""
    monkeypatch.setattr(large, "MANY_STATES", -1)
    monkeypatch.setattr(large, "LARGE", 0)
    monkeypatch.setattr(large, "PIECE", 3)


@pytest.fixture
def commands(monkeypatch) -> list[list[str]]:
    """The compiler's command lines."""
    seen: list[list[str]] = []
    original = toolchain._failure
    monkeypatch.setattr(toolchain, "_failure", lambda command, *rest: seen.append(command) or original(command, *rest))
    return seen


def flown(fmu) -> bytes:
    """All variables after each of some steps."""
    slave = Slave(unpack(fmu)).start()
    rows = []
    for k in range(20):
        slave.doStep(0.05 * k, 0.05)
        rows.append(slave.everything())
    slave.freeInstance()
    return np.array(rows).tobytes()


@pytest.mark.parametrize("name", PARTS)
def test_pieces_give_the_same_bits(tmp_path, cut, monkeypatch, name):
    pieces = build_native(every()[name], tmp_path / "pieces" / f"{name}.fmu")
    assert b"static void casadi_f" in native_sources(every()[name], describe_native(every()[name], name))["model.c"]
    monkeypatch.setattr(large, "LARGE", 10**9)
    assert flown(build_native(every()[name], tmp_path / "whole" / f"{name}.fmu")) == flown(pieces)


@pytest.mark.parametrize("name", PARTS)
def test_a_compiler_has_nothing_to_say_of_pieces(tmp_path, cut, name):
    for file, data in native_sources(every()[name], describe_native(every()[name], name)).items():
        (tmp_path / file).write_bytes(data)
    assert complaints(tmp_path, "-o", "out.so") == ""


def test_a_large_component_is_compiled_with_less_effort(tmp_path, cut, commands):
    build_native(every()["Gain"], tmp_path / "Gain.fmu")
    optimisations = [[word for word in command if word.startswith("-O")] for command in commands]
    assert optimisations == [["-O3", "-O1"]]


def test_a_small_one_is_as_it_was(tmp_path, commands):
    build_native(every()["Gain"], tmp_path / "Gain.fmu")
    assert [[word for word in command if word.startswith("-O")] for command in commands] == [["-O3"]]


def test_none_of_the_catalog_is_large():
    for make in CATALOG.values():
        component = make()
        assert not large.is_large(component.size(component.states), native_functions(component)), component.name


def test_many_states_with_long_equations_are_large():
    component = CATALOG["FlexibleSpacecraft"](modes=140)
    assert large.is_large(component.size(component.states), native_functions(component))


def test_the_time_so_far_is_told(tmp_path, monkeypatch):
    monkeypatch.setenv("ADCS_BUILD", str(tmp_path / "cache"))
    monkeypatch.setattr(building, "TELL_EVERY", 0.01)
    for options in ({}, {"folder": tmp_path / "out"}):
        told: list[str] = []
        building.build_reference("Sum", announce=told.append, **options)
        assert told[0] == "building Sum (native)"
        assert "building Sum (native): 0 s so far" in told
