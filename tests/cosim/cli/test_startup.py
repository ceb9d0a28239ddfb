"""What is imported when: a rebuild of nothing must not wait for what designs, flies and draws."""

import os
import subprocess
import sys

import pytest

HEAVY = ("matplotlib", "pandas", "pyarrow", "scipy")


def imported(module: str) -> set[str]:
    """The packages that a new process has after importing a module."""
    code = f"import sys, {module}; print(*{{name.partition('.')[0] for name in sys.modules}})"
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(p for p in sys.path if p)}
    done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True)
    return set(done.stdout.split())


@pytest.mark.parametrize("module", ["components.catalog", "fmus.export.build", "cosim.cli.commands"])
def test_nothing_heavy_is_imported_to_build(module):
    assert not imported(module) & set(HEAVY)
