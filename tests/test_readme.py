"""What the README says is run: its files and commands, in an empty folder outside the repository."""

import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from cosim.studies.papers import describe

README = (Path(__file__).parents[1] / "README.md").read_text(encoding="utf-8")
BLOCK = re.compile(r"^```(\w+) ?(\S*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
BLOCKS = BLOCK.findall(README)
FILES = {name: text for language, name, text in BLOCKS if language == "python"}
COMMANDS = [line for language, kind, text in BLOCKS if language == "sh" and not kind for line in text.splitlines()]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """An empty folder with the README's Python files in it."""
    place = tmp_path_factory.mktemp("readme")
    for name, text in FILES.items():
        (place / name).write_text(text, encoding="utf-8")
    return place


def adcs(line: str, folder: Path) -> str:
    name, *arguments = shlex.split(line)
    assert name == "adcs"
    done = subprocess.run([sys.executable, "-m", "cosim", *arguments], cwd=folder, capture_output=True, text=True)
    assert done.returncode == 0, f"{line}\n{done.stdout}{done.stderr}"
    return done.stdout


@pytest.mark.slow
def test_every_command_and_file_of_the_readme_runs_in_order(folder):
    printed = {line: adcs(line, folder) for line in COMMANDS}
    swap = next(text for line, text in printed.items() if "AdaptiveTracking" in line)
    assert "dropped parameter controller.rho_0" in swap
    assert "kept    plant.q_BN -> controller.q_BN" in swap
    for name in ("from_python.py", "many_flights.py", "read_results.py"):
        done = subprocess.run([sys.executable, name], cwd=folder, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
    assert (folder / "overlay" / "attitude_error.png").is_file()
    assert {p.stem for p in (folder / "fmus").glob("*.fmu")} >= {"guidance", "environment", "controller", "plant"}


@pytest.mark.parametrize("name", [n for n in FILES if n.startswith("pd_")])
def test_a_controller_in_the_readme_takes_about_15_lines(name):
    code = [line for line in FILES[name].splitlines() if line.strip()]
    assert len(code) <= 16


def test_the_number_of_experiments_is_that_of_the_papers():
    assert f"flies the {len(describe())} experiments of five published control systems" in README
