"""The library of FMUs: shared by threads, and without a compiler."""

from concurrent.futures import ThreadPoolExecutor

import pytest

from cosim.cli import library
from cosim.cli.library import Library
from cosim.errors import FmuError
from fmus.errors import NoCompiler


@pytest.fixture
def asked(monkeypatch):
    """What is asked of the builder, on a machine without a compiler: (reference, back end)."""
    asked: list[tuple[str, str]] = []

    def build(reference, backend, announce):
        asked.append((reference, backend))
        if backend == "native":
            raise NoCompiler(["cc"])
        return reference

    monkeypatch.setattr(library, "build_reference", build)
    return asked


def test_without_a_compiler_all_threads_take_the_python_back_end_and_one_tells(asked):
    told: list[str] = []
    locate = Library("native", told.append)
    names = [f"C{i}" for i in range(8)]
    with ThreadPoolExecutor(4) as threads:
        assert list(threads.map(locate, names)) == names
    assert {name for name, backend in asked if backend == "python"} == set(names)
    (line,) = told
    assert line.endswith("Until then: python back end.")
    assert locate.backend == "python"


def test_a_file_is_taken_as_it_is_or_missed_by_name(asked, tmp_path):
    file = tmp_path / "A.fmu"
    with pytest.raises(FmuError, match=r"A\.fmu: there is no such file"):
        Library()(str(file))
    file.touch()
    assert Library()(str(file)) == file
    assert asked == []
