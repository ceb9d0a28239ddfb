"""A python FMU carries the data files that its component reads, or says which it cannot carry."""

import importlib
import shutil
import sys
import zipfile
from pathlib import Path

import pytest

from cosim.errors import CallFailed
from cosim.slaves.fmi2 import FmuSlave
from fmus import build
from fmus.errors import BuildError, ComponentFailed
from fmus.export.python.python_fmu import build_python
from fmus.export.references import parse

TABLE = """
from pathlib import Path
import numpy as np
from components.framework import Output, Parameter, PythonComponent

HERE = Path(__file__).parent

class Table(PythonComponent):
    k = Parameter(unit="1", start=float(np.loadtxt({path})), doc="number")
    y = Output(unit="1", doc="the same")

    def outputs(self, t, x, u, p):
        return {{"y": {y}}}
"""


def write(folder: Path, path="HERE / 'table.csv'", y="p.k", number=1.5) -> Path:
    folder.mkdir(exist_ok=True)
    (folder / "data").mkdir(exist_ok=True)
    for name in ("table.csv", "data/table.csv", "not_read.csv"):
        (folder / name).write_text(f"{number}\n")
    (folder / "mine.py").write_text(TABLE.format(path=path, y=y))
    return folder / "mine.py"


def built(file: Path, target: Path) -> Path:
    return build_python(parse(f"{file}:Table").component(), target)


def output(fmu: Path) -> float:
    slave = FmuSlave("one", fmu)
    slave.instantiate()
    slave.setup_experiment(0.0)
    slave.enter_initialization_mode()
    slave.exit_initialization_mode()
    slave.do_step(0.0, 0.1)
    (value,) = slave.get_real((slave.description.variables["y"].value_reference,))
    slave.terminate()
    return value


def data_in(fmu: Path) -> list[str]:
    with zipfile.ZipFile(fmu) as archive:
        return [n for n in archive.namelist() if n.startswith("resources/source/") and not n.endswith(".py")]


@pytest.mark.parametrize("path", ["table.csv", "data/table.csv"])
def test_what_lies_beside_the_source_is_there_in_the_fmu(tmp_path, path):
    fmu = built(write(tmp_path / "own", f"HERE / {path!r}"), tmp_path / "Table.fmu")
    shutil.rmtree(tmp_path / "own")
    assert data_in(fmu) == [f"resources/source/{path}"]
    assert output(fmu) == 1.5


def test_what_the_equations_read_when_the_fmu_is_built_is_there_too(tmp_path):
    file = write(tmp_path / "own", "HERE / 'data/table.csv'", "p.k + float(np.loadtxt(HERE / 'table.csv'))", 1.75)
    file.write_text(file.read_text().replace("PythonComponent", "Component"))
    fmu = built(file, tmp_path / "Table.fmu")
    shutil.rmtree(tmp_path / "own")
    assert data_in(fmu) == ["resources/source/data/table.csv", "resources/source/table.csv"]
    assert output(fmu) == 3.5


def test_two_fmus_of_one_source_each_have_their_own_table(tmp_path):
    one = built(write(tmp_path / "one", y="float(np.loadtxt(HERE / 'table.csv'))"), tmp_path / "One.fmu")
    two = built(write(tmp_path / "two", y="float(np.loadtxt(HERE / 'table.csv'))", number=2.5), tmp_path / "Two.fmu")
    assert [output(one), output(two), output(one)] == [1.5, 2.5, 1.5]


def test_a_class_that_was_imported_before_anybody_listened(tmp_path, monkeypatch):
    """As from a user's own script: `build(Table(), path, "python")`."""
    write(tmp_path / "own")
    monkeypatch.syspath_prepend(tmp_path / "own")
    module = importlib.import_module("mine")
    fmu = build(module.Table(), tmp_path / "Table.fmu", "python")
    del sys.modules["mine"]
    assert data_in(fmu) == ["resources/source/table.csv"]
    assert output(fmu) == 1.5


def test_the_same_bytes_whatever_was_built_before(tmp_path):
    """Another class of the file reads another table, which this one's FMU does not need."""
    file = write(tmp_path / "own")
    reading = "def declare(self):\n        np.loadtxt(HERE / 'not_read.csv')\n        return {}\n"
    file.write_text(f"{file.read_text()}\nclass Other(Table):\n    {reading}")
    first = built(file, tmp_path / "a" / "Table.fmu").read_bytes()
    fmu = build_python(parse(f"{file}:Other").component(), tmp_path / "Other.fmu")
    assert data_in(fmu) == ["resources/source/not_read.csv", "resources/source/table.csv"]
    assert built(file, tmp_path / "b" / "Table.fmu").read_bytes() == first


@pytest.mark.parametrize(
    "path",
    ["'{folder}/own/table.csv'", "HERE.parent / 'table.csv'", "'{folder}/table.csv'", "'own/table.csv'"],
    ids=["beside, by its whole name", "above", "elsewhere", "from the working folder"],
)
def test_what_would_be_missing_elsewhere_is_refused_by_name(tmp_path, monkeypatch, path):
    (tmp_path / "table.csv").write_text("1.5")
    monkeypatch.chdir(tmp_path)
    file = write(tmp_path / "own", path.format(folder=tmp_path))
    with pytest.raises(BuildError) as caught:
        built(file, tmp_path / "Table.fmu")
    missing = tmp_path / "own" / "table.csv" if "own" in path else tmp_path / "table.csv"
    assert str(caught.value) == (
        f"Table reads {missing}, which would be missing where its python FMU goes: an FMU carries what lies in "
        f"{tmp_path / 'own'} and is named from there. Put it there and read Path(__file__).with_name('table.csv')."
    )


def test_a_source_that_cannot_run_elsewhere_is_refused_with_its_line(tmp_path):
    file = write(tmp_path / "own")
    file.write_text(file.read_text().replace("HERE = ", "assert 'own' in __file__\nHERE = "))
    with pytest.raises(ComponentFailed, match=r"^AssertionError:  \(mine\.py, line 6\)$"):
        built(file, tmp_path / "Table.fmu")


def test_a_class_inside_a_function_is_refused(tmp_path):
    file = write(tmp_path / "own")
    file.write_text(file.read_text() + "\ndef made():\n    class Inner(Table): pass\n    return Inner()\n")
    inner = sys.modules[type(parse(f"{file}:Table").component()).__module__].made()
    with pytest.raises(BuildError, match=r"mine\.py has no Inner outside of functions and classes"):
        build(inner, tmp_path / "Inner.fmu", "python")


def test_a_table_edited_in_the_fmu_is_refused_where_a_start_value_follows_from_it(tmp_path):
    fmu = built(write(tmp_path / "own"), tmp_path / "Table.fmu")
    with zipfile.ZipFile(fmu) as source, zipfile.ZipFile(tmp_path / "Edited.fmu", "w") as copy:
        for entry in source.namelist():
            copy.writestr(entry, b"9.5" if entry.endswith("table.csv") else source.read(entry))
    with pytest.raises(CallFailed, match="variables of the edited source differ from"):
        output(tmp_path / "Edited.fmu")
    assert output(fmu) == 1.5


def test_what_is_read_in_flight_only_is_told_as_missing(tmp_path):
    """It is seen neither by the import nor by the build."""
    fmu = built(write(tmp_path / "own", y="float(np.loadtxt(HERE / 'not_read.csv'))"), tmp_path / "Table.fmu")
    with pytest.raises(CallFailed, match=r"FileNotFoundError: .*not_read\.csv not found\. \(mine\.py, line 13\)"):
        output(fmu)
