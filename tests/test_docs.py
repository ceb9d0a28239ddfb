"""What README and docs say is run: their files and commands, in an empty folder outside the repository."""

import re
import shlex
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest

from cosim.studies.papers import describe

ROOT = Path(__file__).parents[1]
BLOCK = re.compile(r"^```(\w*) ?(\S*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
DATA = ("csv", "toml")


@dataclass(frozen=True)
class Text:
    """A page and its code blocks: (language, name of the file or kind of commands, code)."""

    path: Path
    blocks: tuple[tuple[str, str, str], ...]

    @property
    def files(self) -> dict[str, str]:
        return {name: code for language, name, code in self.blocks if language in ("python", *DATA) and name}

    @property
    def commands(self) -> list[str]:
        shells = (code for language, kind, code in self.blocks if language == "sh" and kind != "pip")
        joined = (code.replace("\\\n", " ") for code in shells)
        return [line for code in joined for line in code.splitlines() if line]

    @property
    def programs(self) -> list[str]:
        """The Python files that print something where they are run; others are run by name in commands."""
        return [name for name, code in self.files.items() if name.endswith(".py") and "print(" in code]


def read(path: Path) -> Text:
    return Text(path, tuple(BLOCK.findall(path.read_text(encoding="utf-8"))))


README = read(ROOT / "README.md")
PAGES = [README, *(read(p) for p in (ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md"))))]
RUN = [page for page in PAGES if page.commands or page.programs]


def name_of(page: Text) -> str:
    return page.path.relative_to(ROOT).as_posix()


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder with the Python files and data of every page in it."""
    place = tmp_path_factory.mktemp("docs")
    for page in PAGES:
        for name, text in page.files.items():
            (place / name).write_text(text, encoding="utf-8")
    return place


@pytest.fixture(scope="module")
def printed(folder):
    """What the README's commands print: other pages go on from their results."""
    return {line: run(line, folder) for line in README.commands}


def run(line: str, folder: Path) -> str:
    name, *arguments = shlex.split(line)
    command = {"adcs": ["-m", "cosim"], "python": []}[name]
    done = subprocess.run([sys.executable, *command, *arguments], cwd=folder, capture_output=True, text=True)
    assert done.returncode == 0, f"{line}\n{done.stdout}{done.stderr}"
    return done.stdout


def test_every_block_is_run_or_says_what_it_is():
    """`text` is output, `sh pip` installs, `python FILE` and data are files."""
    for page in PAGES:
        for language, name, code in page.blocks:
            known = language in ("text", "sh", "") or name
            assert known, f"{name_of(page)}: a block of {language} without a name\n{code}"


@pytest.mark.slow
def test_the_readme_runs_in_order(printed, folder):
    swap = next(text for line, text in printed.items() if "AdaptiveTracking" in line)
    assert "dropped parameter controller.rho_0" in swap
    assert "kept    plant.q_BN -> controller.q_BN" in swap
    assert (folder / "overlay" / "attitude_error.png").is_file()
    assert len(list((folder / "fmus").glob("*.fmu"))) == 5


@pytest.mark.slow
@pytest.mark.parametrize("page", RUN, ids=name_of)
def test_a_page_runs_in_order(page, printed, folder):
    if page is not README:
        for line in page.commands:
            run(line, folder)
    for program in page.programs:
        run(f"python {program}", folder)


@pytest.mark.parametrize("name", [n for n in README.files if n.startswith("pd_")])
def test_a_controller_in_the_readme_takes_about_15_lines(name):
    code = [line for line in README.files[name].splitlines() if line.strip()]
    assert len(code) <= 16


def test_the_number_of_experiments_is_that_of_the_papers():
    index = (ROOT / "docs" / "papers" / "index.md").read_text(encoding="utf-8")
    assert f"flies the {len(describe())} experiments of five published control systems" in index
