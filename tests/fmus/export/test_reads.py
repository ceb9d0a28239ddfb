"""What a component's code reads makes the FMU what it is: changed, it is built again; nothing else counts."""

import os
import shutil
import subprocess
import sys
import tempfile
import textwrap
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

import components
import fmus
from fmus.description.read import read_description
from fmus.errors import ComponentFailed
from fmus.export.build import BACKENDS, build_reference
from fmus.export.reads import Reads, hash_of_file, hold, noting
from fmus.export.references import parse

HERE = "Path(__file__).with_name('table.csv')"
COMPONENT = """
import os
from functools import cache
from pathlib import Path
import numpy as np
from components.framework import Component, Output, Parameter
{before}

class Table(Component):
    modes: int = 1
    k = Parameter(unit="1", start={start}, doc="number")
    y = Output(unit="1", doc="the same")

    def outputs(self, t, x, u, p):
        return {{"y": p.k + {output}}}
"""
WAYS = {
    "pathlib": {"start": f"float({HERE}.read_text())"},
    "open": {"before": f"with open({HERE}) as file: number = float(file.read())", "start": "number"},
    "os.open": {"start": f"float(os.read(os.open({HERE}, os.O_RDONLY), 99))"},
    "numpy": {"start": f"float(np.loadtxt({HERE}))"},
    "the body of the class": {"start": f"np.loadtxt({HERE})"},
    "a helper": {"before": "import helper", "start": "helper.number()"},
    "a helper of a helper's": {"before": "from helper_of_helper import number", "start": "number()"},
    "a source that is run": {
        "before": f"exec('n = ' + {HERE}.read_text())",
        "start": "n",
    },
    "the equations": {"output": f"float({HERE}.read_text())"},
    "the equations, once": {"before": f"@cache\ndef number(): return float({HERE}.read_text())", "output": "number()"},
}
HELPER = f"""
from pathlib import Path
def number():
    return float({HERE}.read_text())
"""


def write(folder: Path, before="", start="0.0", output="0") -> str:
    """A user's folder with a component that reads table.csv; return its reference."""
    folder.mkdir(exist_ok=True)
    (folder / "table.csv").write_text("1.5\n")
    (folder / "helper.py").write_text(HELPER)
    (folder / "helper_of_helper.py").write_text("from helper import number\n")
    (folder / "mine.py").write_text(COMPONENT.format(before=before, start=start, output=output))
    return f"{folder / 'mine.py'}:Table"


@pytest.fixture(autouse=True)
def cache(tmp_path, monkeypatch):
    monkeypatch.setenv("ADCS_BUILD", str(tmp_path / "cache"))
    return tmp_path / "cache"


@pytest.fixture
def built():
    """A function: reference -> whether it was built, and the start value of k."""

    def build(reference: str, backend: str = "native") -> tuple[bool, float]:
        told: list[str] = []
        fmu = build_reference(reference, backend, announce=told.append)
        return bool(told), read_description(fmu).variables["k"].start

    return build


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("way", WAYS)
def test_a_data_file_that_has_changed_is_built_again_once(tmp_path, built, way, backend):
    reference = write(tmp_path / "own", **WAYS[way])
    first = 0.0 if "equations" in way else 1.5
    assert built(reference, backend) == (True, first)
    assert built(reference, backend) == (False, first)
    (tmp_path / "own" / "table.csv").write_text("2.5\n")
    second = 0.0 if "equations" in way else 2.5
    assert built(reference, backend) == (True, second)
    assert built(reference, backend) == (False, second)


def test_the_next_process_sees_it_too(tmp_path, built):
    reference = write(tmp_path / "own", **WAYS["pathlib"])
    built(reference)
    (tmp_path / "own" / "table.csv").write_text("2.5\n")
    code = f"from fmus.export.build import build_reference; build_reference({reference!r}, announce=print)"
    for expected in ("building Table (native)\n", ""):
        done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
        assert (done.stdout, done.stderr) == (expected, "")
    assert built(reference) == (False, 2.5)


def test_what_a_module_keeps_in_memory_counts_for_each_fmu_of_it(tmp_path, built):
    """The second structure is built without a read: the first one's read is its too."""
    reference = write(tmp_path / "own", **WAYS["the equations, once"])
    assert built(reference)[0]
    assert built(f"{reference}:modes=2")[0]
    (tmp_path / "own" / "table.csv").write_text("2.5\n")
    assert built(f"{reference}:modes=2")[0]


def test_a_file_that_appears_and_vanishes(tmp_path, built):
    reference = write(tmp_path / "own", before="from optional import number", start="number")
    (tmp_path / "own" / "optional.py").write_text(
        f"from pathlib import Path\ntry:\n    number = float({HERE}.read_text())\nexcept OSError:\n    number = 7.0\n"
    )
    table = tmp_path / "own" / "table.csv"
    table.unlink()
    assert built(reference) == (True, 7.0)
    assert built(reference) == (False, 7.0)
    table.write_text("1.5")
    assert built(reference) == (True, 1.5)
    table.unlink()
    assert built(reference) == (True, 7.0)


def test_a_file_that_is_gone_is_told_with_the_line_that_needs_it(tmp_path, built):
    reference = write(tmp_path / "own", **WAYS["open"])
    built(reference)
    (tmp_path / "own" / "table.csv").unlink()
    with pytest.raises(ComponentFailed, match=r"FileNotFoundError: .*table\.csv' \(mine\.py, line 7\)"):
        built(reference)


def test_a_relative_name_means_the_folder_of_now(tmp_path, built, monkeypatch):
    reference = write(tmp_path / "own", start="float(open('table.csv').read())")
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "table.csv").write_text("2.5")
    for folder, expected in (("own", (True, 1.5)), ("other", (True, 2.5)), ("other", (False, 2.5))):
        monkeypatch.chdir(tmp_path / folder)
        assert built(reference) == expected


def test_the_same_source_beside_another_table(tmp_path, built):
    soft, hard = (write(tmp_path / name, **WAYS["pathlib"]) for name in ("soft", "hard"))
    (tmp_path / "hard" / "table.csv").write_text("2.5")
    assert built(soft) == (True, 1.5)
    assert built(hard) == (True, 2.5)


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("line", ["from .beside import NUMBER", "from . import beside; NUMBER = beside.NUMBER"])
def test_a_module_beside_that_is_imported_relative_to_it(tmp_path, built, line, backend):
    reference = write(tmp_path / "own", before=line, start="NUMBER")
    for number in (1.5, 2.5):
        (tmp_path / "own" / "beside.py").write_text(f"NUMBER = {number}\n")
        assert built(reference, backend) == (True, number)
        assert built(reference, backend) == (False, number)


def test_a_module_from_elsewhere_is_one_of_the_files(tmp_path, built, monkeypatch):
    """Also where Python reads its byte code instead."""
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    (elsewhere / "numbers_from_elsewhere.py").write_text("NUMBER = 1.5\n")
    reference = write(tmp_path / "own", before="from numbers_from_elsewhere import NUMBER", start="NUMBER")
    script = f"import sys; sys.path.append({str(elsewhere)!r}); from fmus.export.build import build_reference\n"
    script += f"build_reference({reference!r}, announce=print)"

    def lines() -> str:
        return subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True).stdout

    subprocess.run([sys.executable, "-m", "compileall", "-q", str(elsewhere)], check=True)
    assert [lines(), lines()] == ["building Table (native)\n", ""]
    (elsewhere / "numbers_from_elsewhere.py").write_text("NUMBER = 2.5  # edited\n")
    assert [lines(), lines()] == ["building Table (native)\n", ""]


CATALOG = """
    import fmpy
    from fmus.description.read import read_description
    from fmus.export.build import build_reference
    for backend in ("native", "python"):
        fmu = build_reference("HarmonicTorque", backend, announce=print)
        print(read_description(fmu).variables["frequency"].start)
    fmpy.simulate_fmu(str(fmu), stop_time=0.01)
"""


def test_a_data_file_of_a_component_of_ours(tmp_path):
    """In a copy of the packages whose harmonic torque reads its frequency from a file beside it."""
    for package in (components, fmus):
        source = Path(package.__file__).parent
        shutil.copytree(source, tmp_path / source.name, ignore=shutil.ignore_patterns("__pycache__"))
    file = tmp_path / "components" / "environment" / "harmonic_torque.py"
    reading = "start=float(__import__('pathlib').Path(__file__).with_name('rate.csv').read_text())"
    file.write_text(file.read_text().replace("start=neutral.ORBIT_RATE", reading))
    code = f"import sys; sys.path.insert(0, {str(tmp_path)!r})\n{textwrap.dedent(CATALOG)}"

    def lines() -> list[str]:
        done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        return done.stdout.splitlines()

    building = ["building HarmonicTorque (native)", "building HarmonicTorque (python)"]
    for rate in ("0.25", "0.5"):
        file.with_name("rate.csv").write_text(rate)
        assert lines() == [building[0], rate, building[1], rate]
    assert lines() == ["0.5", "0.5"]


# ---- what counts as read ---------------------------------------------------------------------------------------


@pytest.fixture
def run(tmp_path):
    """A function: code of a user's, run where its reads are noted -> the names of the files."""

    def noted(code: str) -> list[str]:
        (tmp_path / "code.py").write_text(code)
        reads = Reads()
        with noting(reads):
            exec(compile(code, str(tmp_path / "code.py"), "exec"), {"folder": tmp_path})
        return list(reads)

    return noted


def test_a_file_is_noted_with_what_it_held_when_it_was_first_read(tmp_path):
    table, reads = tmp_path / "table.csv", Reads()
    table.write_text("1")
    held = hash_of_file(str(table))
    code = compile("open(table).close()", str(tmp_path / "code.py"), "exec")
    for _ in range(2):
        with noting(reads):
            exec(code, {"table": str(table)})
        table.write_text("2")
    assert reads == {str(table): held}
    assert not hold(reads)
    table.write_text("1")
    assert hold(reads)


@pytest.mark.parametrize(
    "code",
    [
        "open(folder / 'new', 'w').close()",
        "open(folder / 'new', 'a').close()",
        "import os; os.close(os.open(folder / 'new', os.O_WRONLY | os.O_CREAT))",
        "import os; os.close(os.open(folder, os.O_RDONLY))",
        "import os; a, b = os.pipe(); open(b, 'w').close(); open(a).close()",
        "open('/proc/self/status').close()",
        "open('/dev/null').close()",
        "import json; open(json.__file__).close()",
        "import numpy; open(numpy.__file__).close()",
        "import zoneinfo, colorsys, numpy.polynomial",
        "import tempfile\nwith tempfile.NamedTemporaryFile() as f: open(f.name).close()",
        "try: open('a\\0b')\nexcept ValueError: pass",
        "import components.numbers.zhang2018, fmus.places",
    ],
)
def test_what_does_not_count(run, code):
    assert run(code) == []


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no FIFOs here")
def test_a_fifo_is_left_alone(run, tmp_path):
    os.mkfifo(tmp_path / "fifo")
    assert run("import os; os.close(os.open(folder / 'fifo', os.O_RDONLY | os.O_NONBLOCK))") == []


def test_what_a_library_reads_while_it_is_imported_is_its_own_affair(run, tmp_path):
    library = tmp_path / "site-packages"
    library.mkdir()
    (tmp_path / "settings").write_text("x")
    read = "open(__import__('pathlib').Path(__file__).parents[1] / 'settings').close()\n"
    (library / "library_that_reads.py").write_text(f"{read}def read(): {read}")
    path = f"import sys; sys.path.insert(0, {str(library)!r}); import library_that_reads; sys.path.pop(0)\n"
    assert run(path) == []
    assert run(f"{path}library_that_reads.read()") == [str(tmp_path / "settings")]


def test_threads_note_each_its_own(tmp_path):
    files = [tmp_path / str(i) for i in range(8)]
    code = compile("open(name).close()", str(tmp_path / "code.py"), "exec")

    def read(file: Path) -> list[str]:
        file.write_text("x")
        reads = Reads()
        with noting(reads):
            for _ in range(50):
                exec(code, {"name": str(file)})
        exec(code, {"name": str(tmp_path / "0")})
        return list(reads)

    with ThreadPoolExecutor(8) as threads:
        assert list(threads.map(read, files)) == [[str(file)] for file in files]


def test_threads_that_build_from_one_file_read_it_once(tmp_path):
    reference = write(tmp_path / "own", **WAYS["pathlib"])
    with ThreadPoolExecutor(8) as threads:
        found = list(threads.map(lambda _: parse(reference).component_and_reads({}), range(8)))
    assert {id(type(component)) for component, _ in found} == {id(type(found[0][0]))}
    assert [list(reads) for _, reads in found] == [[str(tmp_path / "own" / "table.csv")]] * 8


def test_a_file_in_a_temporary_folder_of_a_users_counts(run):
    """Only what is gone when the build is over does not."""
    with tempfile.NamedTemporaryFile() as file:
        assert run(f"open({file.name!r}).close()") == [file.name]
