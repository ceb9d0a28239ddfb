"""The house: no circle between files, modules of a size that one reads at once."""

import statistics
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import grimp
import pytest

ROOT = Path(__file__).parents[1]
PACKAGES = ("components", "fmus", "cosim")


def lines() -> dict[str, int]:
    """Lines of every source file of ours."""
    files = [file for package in PACKAGES for kind in ("*.py", "*.c", "*.h") for file in (ROOT / package).rglob(kind)]
    return {str(file.relative_to(ROOT)): len(file.read_text(encoding="utf-8").splitlines()) for file in files}


def test_no_circle_between_files():
    graph = grimp.build_graph(*PACKAGES)
    files = {module: graph.find_modules_directly_imported_by(module) for module in graph.modules}
    try:
        TopologicalSorter(files).prepare()
    except CycleError as error:
        pytest.fail(" -> ".join(error.args[1]))


def test_modules_are_small():
    sizes = lines()
    assert {name for name, size in sizes.items() if size > 400} <= {"fmus/export/native/fmi2.c"}
    assert statistics.median(size for size in sizes.values() if size > 10) <= 120
