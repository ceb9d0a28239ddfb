"""What is imported when: names and help must not wait for what builds, flies and draws."""

import os
import subprocess
import sys

import pytest

FLY = ("fmpy", "pyarrow", "lxml")
DRAW = ("matplotlib", "pandas", "scipy")


def imported(code: str) -> set[str]:
    """The modules that a new process has after some code; a package counts as a module of its name."""
    code = f"import sys\n{code}\nprint(*sys.modules, file=sys.stderr)"
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(p for p in sys.path if p)}
    done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True)
    return set(done.stderr.split())


@pytest.fixture
def alone(tmp_path, monkeypatch):
    """A cache of FMUs in which no other test builds meanwhile: one name is one file there, whatever its key."""
    monkeypatch.setenv("ADCS_BUILD", str(tmp_path / "cache"))


def command(*arguments: str) -> str:
    """Code that runs `adcs` to its end."""
    return f"""
sys.argv = ["adcs", *{arguments!r}]
from adcs_cosim import main
try:
    main()
except SystemExit as end:
    assert not end.code
"""


def test_import_cosim_loads_nothing_that_builds_flies_or_draws():
    loaded = imported("import cosim")
    assert not loaded & {"casadi", "numpy", "typer", "rich", *FLY, *DRAW}
    assert {name for name in loaded if name.startswith(("cosim.", "fmus.", "components."))} == set()


def test_a_system_is_data():
    loaded = imported("from cosim import Connection, Experiment, System, Value; System(name='s', components={})")
    assert not loaded & {"casadi", "components.framework", *FLY, *DRAW}


@pytest.mark.parametrize("arguments", [("--help",), ("run", "--help"), ("list",)])
def test_names_and_help_wait_for_nothing(arguments):
    loaded = imported(command(*arguments))
    assert not loaded & {"casadi", "components.framework", *FLY, *DRAW}


def test_an_fmu_that_is_up_to_date_is_found_without_building(alone):
    code = "from fmus.export.build import build_reference; build_reference('Sum')"
    imported(code)
    assert not imported(code) & {"casadi", "components.framework", "pythonfmu", *FLY, *DRAW}


def test_a_flight_draws_nothing_and_needs_no_pandas(alone, tmp_path):
    run = command("run", "zhang2018-ppatc", "--stop", "0.01", "--force", "--out", str(tmp_path / "out"))
    imported(run)
    assert not imported(run) & {
        "casadi",
        "matplotlib",
        "pandas",
        "scipy.signal",
    }
