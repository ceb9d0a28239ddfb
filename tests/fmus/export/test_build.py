"""What is built when: only what is missing or out of date, and finding that out costs nothing."""

import ast
import shutil
import subprocess
import sys
import textwrap
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path

import pytest

import components
import fmus
from components.catalog import CATALOG
from fmus.description.read import read_description
from fmus.errors import BuildError, ComponentFailed
from fmus.export import references
from fmus.export.build import build, build_reference, component_docs
from fmus.export.python.python_fmu import TRAVELLERS
from fmus.export.sources import sources_of
from fmus.toolchain import find_compiler

CONSTANT = '''
"""A constant."""
import numbers_of_mine as numbers
from components.framework import Component, Output, Parameter

class Constant(Component):
    k = Parameter(unit="1", start=numbers.NUMBER, doc="number")
    y = Output(unit="1", doc="the same")

    def outputs(self, t, x, u, p):
        return {"y": p.k}
'''

EDIT_WHILE_RUNNING = """
    from pathlib import Path
    import components
    from fmus.export.build import build_reference
    file = Path(components.__file__).parent / "environment" / "harmonic_torque.py"
    file.write_text(file.read_text().replace("start=neutral.ORBIT_RATE", "start=0.0022"))
    print(build_reference("HarmonicTorque"))
"""
FREQUENCY_OF_THE_NEXT_PROCESS = """
    from fmpy import read_model_description
    from fmus.export.build import build_reference
    description = read_model_description(str(build_reference("HarmonicTorque")))
    print(next(v.start for v in description.modelVariables if v.name == "frequency"))
"""


def run(code: str, root: Path, monkeypatch) -> str:
    monkeypatch.setenv("ADCS_BUILD", str(root / "build"))
    command = [sys.executable, "-c", f"import sys; sys.path.insert(0, {str(root)!r})\n{textwrap.dedent(code)}"]
    done = subprocess.run(command, cwd=root, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


def test_a_source_edited_while_a_process_runs_is_built_by_the_next_one(tmp_path, monkeypatch):
    """What a process built from its modules must not pass for a build of what was edited meanwhile."""
    for package in (components, fmus):
        source = Path(package.__file__).parent
        shutil.copytree(source, tmp_path / source.name, ignore=shutil.ignore_patterns("__pycache__"))
    run(EDIT_WHILE_RUNNING, tmp_path, monkeypatch)
    assert run(FREQUENCY_OF_THE_NEXT_PROCESS, tmp_path, monkeypatch) == "0.0022"


def test_what_is_built_again_when(tmp_path, monkeypatch):
    """Only when something that goes into it has changed, and by whom it was made does not matter."""
    monkeypatch.setenv("ADCS_BUILD", str(tmp_path / "cache"))
    told: list[str] = []

    def path(**options) -> Path:
        return build_reference("Sum", announce=told.append, **options)

    first = path()
    assert path() == first == tmp_path / "cache" / "native" / "Sum.fmu"
    assert told == ["building Sum (native)"]
    first.write_bytes(first.read_bytes() + b"x")  # by another hand than ours
    path()
    assert len(told) == 2
    monkeypatch.setenv("CC", f"{find_compiler()[0]} -DANOTHER")
    path()
    assert len(told) == 3
    assert {p.name for p in first.parent.iterdir()} == {"Sum.fmu", ".Sum.fmu.key"}


def test_a_users_file_is_read_each_time(tmp_path, monkeypatch):
    monkeypatch.setenv("ADCS_BUILD", str(tmp_path / "cache"))
    file, helper, told = tmp_path / "mine.py", tmp_path / "numbers_of_mine.py", list[str]()
    file.write_text(CONSTANT)
    for number in (1.5, 1.5, 2.5):
        helper.write_text(f"NUMBER = {number}\n")
        fmu = build_reference(f"{file}:Constant", announce=told.append)
        assert read_description(fmu).variables["k"].start == number
    assert len(told) == 2


def test_a_python_only_component_is_known_as_such_without_its_import(tmp_path, monkeypatch):
    monkeypatch.setenv("ADCS_BUILD", str(tmp_path / "cache"))
    file, told = tmp_path / "plain.py", list[str]()
    text = CONSTANT.replace("Component", "PythonComponent").replace("numbers_of_mine", "math")
    file.write_text(text.replace("numbers.NUMBER", "numbers.pi"))
    first = build_reference(f"{file}:Constant", announce=told.append)
    assert told == ["building Constant (python)"]
    monkeypatch.setattr(references.Reference, "component", None)  # would be called, were it imported
    assert build_reference(f"{file}:Constant") == first
    assert build_reference(f"{file}:Constant", "python") == first


def test_a_component_of_equations_is_not_taken_from_the_other_back_end(tmp_path, monkeypatch):
    monkeypatch.setenv("ADCS_BUILD", str(tmp_path / "cache"))
    python = build_reference("Sum", "python")
    assert build_reference("Sum", "native") != python


def test_a_mistake_in_the_syntax_of_a_users_file_is_told_with_its_line(tmp_path, monkeypatch):
    monkeypatch.setenv("ADCS_BUILD", str(tmp_path / "cache"))
    (tmp_path / "bad.py").write_text("x = 1\ny = = 2\n")
    with pytest.raises(ComponentFailed, match=r"SyntaxError: .*bad\.py, line 2"):
        build_reference(f"{tmp_path / 'bad.py'}:Bad")


def test_threads_that_ask_for_one_fmu_build_it_once(tmp_path, monkeypatch):
    monkeypatch.setenv("ADCS_BUILD", str(tmp_path / "cache"))
    told: list[str] = []
    with ThreadPoolExecutor(4) as threads:
        ask = partial(build_reference, announce=told.append)
        found = list(threads.map(ask, ["Sum", "Sum", "HarmonicTorque", "Sum", "HarmonicTorque"]))
    assert sorted(told) == ["building HarmonicTorque (native)", "building Sum (native)"]
    assert [p.stem for p in found] == ["Sum", "Sum", "HarmonicTorque", "Sum", "HarmonicTorque"]


def test_files_of_one_name_in_several_threads_each_get_their_own(tmp_path, monkeypatch):
    monkeypatch.setenv("ADCS_BUILD", str(tmp_path / "cache"))
    for i in range(6):
        (tmp_path / str(i)).mkdir()
        (tmp_path / str(i) / "mine.py").write_text(CONSTANT)
        (tmp_path / str(i) / "numbers_of_mine.py").write_text(f"NUMBER = {i}.5\n")
    with ThreadPoolExecutor(6) as threads:
        components = threads.map(
            lambda i: references.parse(f"{tmp_path / str(i) / 'mine.py'}:Constant").component(), range(6)
        )
        assert [float(c.parameters[0].start) for c in components] == [i + 0.5 for i in range(6)]


WITHOUT_IMPORTS = """
    import sys
    import numpy
    from components.catalog import MODULES
    from fmus import build, BuildError
    from fmus.export.build import build_reference, component_docs
    print(build_reference("FlexibleSpacecraft", {backend!r}))
    assert len(component_docs()) == len(MODULES) > 20
    heavy = {{"casadi", "fmpy", "lxml", "pythonfmu", "scipy", "components.framework", "importlib.metadata"}}
    assert not heavy & set(sys.modules), heavy & set(sys.modules)
"""


@pytest.mark.parametrize("backend", ["native", "python"])
def test_what_is_up_to_date_is_answered_without_casadi_or_a_component(backend):
    """And the list of components too."""
    fmu = build_reference("FlexibleSpacecraft", backend)
    done = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(WITHOUT_IMPORTS.format(backend=backend))], capture_output=True, text=True
    )
    assert (done.stdout.strip(), done.stderr) == (str(fmu), "")


def test_the_first_lines_of_components():
    docs = component_docs()
    assert list(docs) == list(CATALOG)
    for name, text in docs.items():
        cls = CATALOG[name]
        assert text == (cls.__doc__ or sys.modules[cls.__module__].__doc__).strip().partition("\n")[0]


def test_importing_fmus_imports_nothing_and_hands_on_build(tmp_path):
    assert fmus.build is build
    assert fmus.BuildError is BuildError
    with pytest.raises(AttributeError, match="no attribute 'bild'"):
        fmus.bild
    code = "import sys, fmus; print([m for m in sys.modules if m.startswith(('casadi', 'lxml', 'numpy', 'fmus.'))])"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True).stdout == "[]\n"


def test_what_only_a_type_checker_imports_does_not_travel():
    """Nor do the parts that build: what travels needs numpy and casadi only."""
    carried = {file for module in TRAVELLERS for file in sources_of(module).files}
    outside = {file for file in carried if not file.startswith("components/framework/")}
    assert outside == {
        "components/__init__.py",
        "fmus/__init__.py",
        *(
            f"fmus/description/{name}.py"
            for name in ("__init__", "annotations", "description", "errors", "html", "names", "units")
        ),
        *(f"fmus/export/{name}.py" for name in ("__init__", "describe", "regions", "source_loader")),
        "fmus/export/python/__init__.py",
        *(
            f"fmus/export/python/{name}.py"
            for name in (
                *("buffered", "conditions", "failure", "internal_step", "modes", "normalising", "plain", "runtime"),
                *("starting", "vector"),
            )
        ),
    }


def test_what_travels_needs_numpy_and_casadi_only():
    """On the target there may be neither lxml nor fmpy."""
    needed: set[str] = set()
    for file in {file for module in TRAVELLERS for file in sources_of(module).files.values()}:
        for node in ast.walk(ast.parse(file.read_text())):
            if isinstance(node, ast.Import):
                needed |= {alias.name.partition(".")[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and node.level == 0:
                needed.add(node.module.partition(".")[0])
    assert needed - sys.stdlib_module_names == {"numpy", "casadi", "components", "fmus"}
