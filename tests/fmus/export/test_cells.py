"""A component class from a notebook's cell, or from the script that runs: both back ends, and when it is refused."""

import hashlib
import linecache
import subprocess
import sys
import types
import zipfile

import numpy as np
import pytest

from cosim import Experiment, Library, System, simulate
from fmus.description.read import read_description
from fmus.errors import ComponentFailed, UnknownComponent
from fmus.export.build import build, build_reference
from fmus.export.references import parse

IMPORTS = """
import numpy as np
import helper_of_mine
from helper_of_mine import twice as double
import scipy
import scipy.special
from components.framework import Component, Output, Parameter, State, Input
from components.framework.variables import Variable
"""
DATA = """
GAINS = {"rate": [3.0, np.array([[1.0, 2.0], [0.1 + 0.2, np.nan]])], "name": ("a", {1, 2}, None, True)}
EMPTY = np.zeros((0, 3))
half = lambda v: 0.5 * v

def decorated(f):
    return f

@decorated
def gain():
    return double(GAINS["rate"][0]) + EMPTY.shape[1] + np.float64(0.5)
"""
BASE = """
class Decay(Component):
    solver_step = 1e-3
    x = State(unit="1", start=1.0, output=True, doc="decays")
"""
UNIT = """
class Unit(Decay):
    a = Parameter(unit="1/s", start=gain() + scipy.special.factorial(3), doc="rate")

    def derivatives(self, t, x, u, p):
        return {"x": -p.a * half(x.x) * helper_of_mine.FACTOR}
"""
HELPER = "import other_of_mine\nFACTOR = other_of_mine.FACTOR\ndef twice(x): return 2 * x\n"


@pytest.fixture
def notebook(tmp_path, monkeypatch):
    """Run cells as IPython does: a module without a file, the text of each cell in linecache. Returns (run, names)."""
    module = types.ModuleType("notebook_of_a_test")
    monkeypatch.setitem(sys.modules, module.__name__, module)
    monkeypatch.setattr(linecache, "cache", dict(linecache.cache))
    monkeypatch.syspath_prepend(str(tmp_path))
    (tmp_path / "helper_of_mine.py").write_text(HELPER)
    (tmp_path / "other_of_mine.py").write_text("FACTOR = 1.0\n")
    for name in ("helper_of_mine", "other_of_mine"):
        monkeypatch.delitem(sys.modules, name, raising=False)

    def run(*texts):
        for text in texts:
            file = f"/tmp/ipykernel_1/{hashlib.sha256(text.encode()).hexdigest()[:9]}.py"
            linecache.cache[file] = (len(text), None, text.splitlines(keepends=True), file)
            exec(compile(text, file, "exec"), module.__dict__)
        return types.SimpleNamespace(**vars(module))

    return run


def last(unit, locate=None):
    """What x is after 1 s."""
    system = System(name="alone", components={"unit": unit})
    return simulate(system, Experiment(stop_time=1.0, communication_step_size=0.1), locate=locate)["unit.x"][-1]


def start(unit):
    """The start value of the parameter a in the component that would be built."""
    return next(p.start for p in parse(unit).component().parameters if p.name == "a")


def test_both_back_ends_fly_what_the_cells_say(notebook):
    unit = notebook(IMPORTS, DATA, BASE, UNIT).Unit
    native, python = (last(unit, Library(backend)) for backend in ("native", "python"))
    assert native == python
    rate = (2 * 3.0 + 3 + 0.5 + 6) * 0.5
    assert native == pytest.approx(np.exp(-rate), rel=1e-9)


def test_the_python_fmu_carries_the_text_and_the_users_own_modules(notebook, tmp_path):
    unit = notebook(IMPORTS, DATA, BASE, UNIT).Unit
    fmu = build(unit(a=2.0), tmp_path / "Mine.fmu", "python")
    with zipfile.ZipFile(fmu) as archive:
        names = {n.removeprefix("resources/source/") for n in archive.namelist()}
        text = archive.read("resources/source/Unit.py").decode()
    assert {"helper_of_mine.py", "other_of_mine.py"} <= names
    assert not any(n.startswith(("numpy/", "scipy/")) for n in names)
    assert UNIT.strip() in text and "import numpy as np\n" in text and "@decorated\ndef gain" in text
    assert read_description(fmu).variables["a"].start == 2.0
    assert last(fmu) == pytest.approx(np.exp(-1.0), rel=1e-9)
    assert last(build(unit(a=2.0), tmp_path / "Native.fmu")) == last(fmu)


def test_a_module_of_the_users_that_is_edited_is_built_anew(notebook, tmp_path):
    unit = notebook(IMPORTS, DATA, BASE, UNIT).Unit
    before = last(unit)
    assert last(unit) == before
    (tmp_path / "other_of_mine.py").write_text("FACTOR = 2.0\n")
    assert last(unit) == pytest.approx(before**2, rel=1e-9)


def test_a_class_is_built_as_it_is_now(notebook):
    """A cell that is run again with its earlier text keeps its place in linecache."""
    one, two = "modes = 1\n" + BASE + UNIT, BASE + UNIT.replace("gain() +", "2 * gain() +")
    notebook(IMPORTS, DATA)
    units = [notebook(text).Unit for text in (one, two, one)]
    starts = [read_description(build_reference(unit)).variables["a"].start for unit in (*units, units[1])]
    assert starts == [15.5, 25.0, 15.5, 25.0]


def test_a_class_without_methods_is_found_by_what_it_declares(notebook):
    unit = "class Big(Unit):\n    modes: int = {}\n    a = Parameter(unit='1/s', start={}, doc='rate')\n"
    notebook(IMPORTS, DATA, BASE, UNIT)
    bigs = [notebook(unit.format(n, n)).Big for n in (1, 2, 1)]
    assert [start(big) for big in bigs] == [1.0, 2.0, 1.0]


def test_values_of_other_cells_that_changed_since_are_told(notebook):
    unit = notebook(IMPORTS, "RATE = 1.0\n", BASE, UNIT.replace("gain()", "RATE")).Unit
    assert start(unit) == 7.0
    notebook("RATE = 2.0\n")
    with pytest.raises(ComponentFailed, match="the class Unit cannot go into an FMU: its source, run again, gives"):
        parse(unit)
    unit = notebook(UNIT.replace("gain()", "RATE")).Unit
    assert start(unit) == 8.0


@pytest.mark.parametrize(
    ("cells", "problem"),
    [
        (
            ("del GAINS\n",),
            r"its source, run again, fails: NameError: name 'GAINS' is not defined\. Run its cell again",
        ),
        (("exec('class Unit(Component): pass')\n",), r"its source, run again, gives another Unit\. Run its cell again"),
        (("exec('class New(Component): pass'); Unit = New\n",), r"the class New .* its source is not kept, for it was"),
        (
            ("def make():\n    class Unit(Component): pass\n    return Unit\nUnit = make()\n",),
            r"make\.<locals>\.Unit\.",
        ),
        (("exec('half = open')\n",), "gives another half"),
        (
            (UNIT.replace("half(", "third("), "exec('third = object()')\n"),
            r"of third, a object which it names, the source is not kept\. Make third inside it, or put it into a file",
        ),
    ],
    ids=["deleted", "another", "exec", "nested", "replaced", "no source"],
)
def test_what_cannot_be_had_is_refused_by_name(notebook, cells, problem):
    unit = notebook(IMPORTS, DATA, BASE, UNIT, *cells).Unit
    with pytest.raises(ComponentFailed, match=problem):
        build_reference(unit)


def test_what_is_no_component_is_refused():
    with pytest.raises(UnknownComponent, match=r"builtins\.int is no component: derive it from components\.framework"):
        build_reference(int)
    from components.framework import PythonComponent

    with pytest.raises(UnknownComponent, match=r"PythonComponent is none of the catalog: derive a class of your own"):
        build_reference(PythonComponent)


def test_a_class_of_the_catalog_is_its_name():
    from components.environment.sum import Sum

    assert build_reference(Sum) == build_reference("Sum")


FLY = """
print(simulate(System(name="s", components={"unit": Unit}), Experiment(stop_time=1.0, communication_step_size=0.5))
      .info["components"]["unit"]["reference"])
"""
SCRIPT = "from cosim import Experiment, System, simulate\n" + IMPORTS.replace("import helper_of_mine\n", "").replace(
    "from helper_of_mine import twice as double\n", ""
)
TEXT = BASE + UNIT.replace("gain()", "1.0").replace("half(x.x)", "x.x").replace(" * helper_of_mine.FACTOR", "")


def python(folder, *arguments):
    return subprocess.run([sys.executable, *arguments], cwd=folder, capture_output=True, text=True)


def test_a_script_builds_its_own_class_without_being_run_twice(tmp_path):
    (tmp_path / "flight.py").write_text(f"{SCRIPT}{TEXT}\nprint('once')\n{FLY}")
    done = python(tmp_path, "flight.py")
    assert (done.returncode, done.stdout) == (0, f"once\n{tmp_path / 'flight.py'}:Unit\n"), done.stderr


@pytest.mark.skipif(sys.version_info >= (3, 13), reason="python -c keeps its source from 3.13 on")
def test_python_c_has_no_source(tmp_path):
    done = python(tmp_path, "-c", SCRIPT + TEXT + FLY)
    assert done.returncode == 1
    assert done.stderr.splitlines()[-1].endswith(
        "the class Unit cannot go into an FMU: its source is not kept, for it was defined at a prompt or by exec. "
        "Define it in a cell, or put it into a file."
    )
