"""A compiler that fails on everything: the python back end builds, the loop runs in Python, and a line says so."""

import shutil

import pytest

from cosim.cli.library import Library
from cosim.masters.kernel import library as kernel
from fmus.errors import NoCompiler

FALSE = shutil.which("false")

pytestmark = pytest.mark.skipif(FALSE is None, reason="there is no program that fails on everything")


@pytest.fixture(autouse=True)
def broken(monkeypatch, tmp_path):
    monkeypatch.setenv("CC", str(FALSE))
    monkeypatch.setenv("ADCS_BUILD", str(tmp_path / "cache"))
    monkeypatch.setattr(kernel, "_loaded", {})


def test_a_run_takes_the_python_back_end_with_one_line():
    told: list[str] = []
    locate = Library("native", told.append)
    assert [locate(name).parent.name for name in ("Sum", "HarmonicTorque")] == ["python", "python"]
    (line,) = [line for line in told if "compiler" in line]
    assert "\n" not in line
    assert line.startswith(f"no C compiler found (tried {FALSE}, which compiles nothing at all: it says nothing).")
    assert line.endswith("Until then: python back end.")


def test_there_is_no_kernel_and_it_is_said_why():
    with pytest.raises(NoCompiler, match="which compiles nothing at all"):
        kernel.library()
