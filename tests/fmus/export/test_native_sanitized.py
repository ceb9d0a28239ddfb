"""Native FMUs under the compiler's sanitizers: no byte out of bounds, nothing undefined, nothing left allocated."""

import os
import shutil
import subprocess
from functools import cache
from pathlib import Path

import pytest

from components.catalog import CATALOG
from fmus.export.native.native_fmu import describe_native, native_sources

from .parts import every

HOST = Path(__file__).with_name("flown.c")
FLAGS = ("-fsanitize=address,undefined", "-fno-sanitize-recover=all", "-std=c99", "-g", "-O1", "-ffp-contract=off")
PARTS = ("Swing", "Wheel", "Sum", "Gain", "Modes_0")
COMPONENTS = {name: every()[name] for name in PARTS} | {"FlexibleSpacecraft": CATALOG["FlexibleSpacecraft"]()}


@cache
def sanitizing_compiler(folder: Path) -> str:
    """The compiler, or "" where it has no sanitizers."""
    (folder / "empty.c").write_text("int main(void) { return 0; }\n")
    for name in ("gcc", "clang", "cc"):
        command = [name, *FLAGS, "empty.c", "-o", "empty"]
        if shutil.which(name) and subprocess.run(command, cwd=folder, capture_output=True).returncode == 0:
            return name
    return ""


@pytest.fixture(scope="module")
def compiler(tmp_path_factory):
    found = sanitizing_compiler(tmp_path_factory.mktemp("sanitizers"))
    if not found:
        pytest.skip("no gcc or clang with sanitizers here")
    return found


@pytest.mark.parametrize("name", COMPONENTS)
def test_a_flight_with_right_and_wrong_calls(name, compiler, tmp_path):
    component = COMPONENTS[name]
    for file, data in native_sources(component, describe_native(component, name)).items():
        (tmp_path / file).write_bytes(data)
    shutil.copy(HOST, tmp_path)
    built = subprocess.run(
        [compiler, *FLAGS, HOST.name, "-o", "flown", "-lm"], cwd=tmp_path, capture_output=True, text=True
    )
    assert built.returncode == 0, built.stderr
    environment = os.environ | {"ASAN_OPTIONS": "detect_leaks=1", "LD_PRELOAD": ""}
    flown = subprocess.run(["./flown"], cwd=tmp_path, capture_output=True, text=True, env=environment)
    assert (flown.returncode, flown.stdout, flown.stderr) == (0, "", "")
