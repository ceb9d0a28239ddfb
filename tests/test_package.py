"""What is said of the package as a whole: version, types, how to cite it."""

import re
from importlib.metadata import metadata, version
from pathlib import Path

import pytest

import cosim

ROOT = Path(__file__).parents[1]


def test_one_version_everywhere():
    cited = re.search(r"^version: (\S+)$", (ROOT / "CITATION.cff").read_text(encoding="utf-8"), re.MULTILINE)
    assert cited and cited[1] == cosim.__version__ == version("adcs-cosim")
    assert f"## {cosim.__version__}" in (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("package", ["components", "cosim", "fmus"])
def test_types_are_told(package):
    assert (ROOT / package / "py.typed").is_file()
    assert re.search(rf'^{package} = \["py.typed"', (ROOT / "pyproject.toml").read_text(encoding="utf-8"), re.MULTILINE)


def test_metadata():
    told = metadata("adcs-cosim")
    assert told["Author"] == "the adcs-cosim authors" and told["License-Expression"] == "MIT"
    assert "Typing :: Typed" in told.get_all("Classifier", [])
    assert {"docs", "peers", "test", "cross"} <= set(told.get_all("Provides-Extra", []))
