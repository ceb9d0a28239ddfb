"""A python FMU in a host in C, as the documentation says: libpython preloaded, the packages where Python finds them."""

import os
import re
import shlex
import subprocess
import sys
import sysconfig
from pathlib import Path

import fmpy
import numpy as np
import pytest
from numpy.testing import assert_allclose

from fmus.export.python.python_fmu import build_python
from fmus.toolchain import find_compiler

from .parts import every
from .slaves import Slave, unpack

LIBPYTHON = Path(sysconfig.get_config_var("LIBDIR") or "", sysconfig.get_config_var("INSTSONAME") or "")
STEPS, H = 20, 0.1

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not sys.platform.startswith("linux"), reason="on Linux alone the wrapper looks for libpython"),
    pytest.mark.skipif(".so" not in LIBPYTHON.name, reason="this Python has no shared library"),
]


@pytest.fixture(scope="module")
def host(tmp_path_factory):
    program = tmp_path_factory.mktemp("host") / "host"
    include = Path(fmpy.__file__).parent / "c-code"
    source = Path(__file__).with_name("host.c")
    subprocess.run([*find_compiler(), "-O1", f"-I{include}", str(source), "-o", str(program), "-ldl"], check=True)
    return program


@pytest.fixture(scope="module")
def swing(tmp_path_factory):
    return unpack(build_python(every()["Swing"], tmp_path_factory.mktemp("swing") / "Swing.fmu"))


def flown(host, folder, environment):
    """Run the host, in an environment that has no more than what is named."""
    description = fmpy.read_model_description(str(folder))
    of = {c: [v.valueReference for v in description.modelVariables if v.causality == c] for c in ("input", "output")}
    library = next((folder / "binaries" / "linux64").iterdir())
    numbers = [STEPS, H, len(of["input"]), len(of["output"]), *of["input"], *of["output"]]
    command = [host, library, description.guid, (folder / "resources").as_uri(), *map(str, numbers)]
    return subprocess.run(list(map(str, command)), env=environment, capture_output=True, text=True), of


def packages():
    """What a user sets: where the packages are, and, for a virtual environment, of which Python it is."""
    paths = {sysconfig.get_path("purelib"), sysconfig.get_path("platlib")}
    return {"PYTHONPATH": os.pathsep.join(sorted(paths)), "PYTHONHOME": sys.base_prefix}


def test_with_libpython_preloaded(host, swing):
    done, of = flown(host, swing, {"LD_PRELOAD": str(LIBPYTHON), **packages()})
    assert done.returncode == 0, shlex.join(done.args) + done.stderr
    rows = np.array([[float(x) for x in line.split()] for line in done.stdout.splitlines()])
    assert rows.shape == (STEPS, len(of["output"]))
    here = Slave(swing).begin()
    here.setReal(of["input"], [0.1 * (i + 1) for i in range(len(of["input"]))])
    here.exitInitializationMode()
    for k in range(STEPS):
        here.doStep(k * H, H)
        assert_allclose(rows[k], here.getReal(of["output"]), rtol=0, atol=0)  # the same code, 17 digits
    here.terminate()
    here.freeInstance()


def test_without_it(host, swing):
    done, _ = flown(host, swing, packages())
    assert done.returncode == 2 and "undefined symbol: " in done.stderr and "Py" in done.stderr


def test_without_the_packages(host, swing):
    """No site-packages: which package is imported first is missing, and it says so."""
    bare = {"LD_PRELOAD": str(LIBPYTHON), "PYTHONHOME": sys.base_prefix}
    hide = "import sys; sys.path = [p for p in sys.path if 'site-packages' not in p and 'dist-packages' not in p]"
    place = host.parent / "bare"
    place.mkdir()
    (place / "sitecustomize.py").write_text(hide)
    done, _ = flown(host, swing, {**bare, "PYTHONPATH": str(place)})
    assert done.returncode == 3 and done.stderr.endswith("no instance\n")
    assert re.search(
        "Swing: the package (casadi|numpy) is not installed for the Python that runs this FMU", done.stderr
    )
