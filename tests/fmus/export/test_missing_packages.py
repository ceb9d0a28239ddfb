"""A python FMU on a host whose Python lacks a package: a sentence in the host's log, not a traceback only.

The host is a process of its own, fmpy's slave with a logger, in which a package cannot be imported.
"""

import subprocess
import sys

import pytest

from fmus.export.python.python_fmu import build_python

from .parts import Gain

HOST = """
import ctypes, importlib.abc, sys
import fmpy
from fmpy import fmi2
from fmpy.logging import addLoggerProxy

class Missing(importlib.abc.MetaPathFinder):
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] == sys.argv[2]:
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)

sys.meta_path.insert(0, Missing())
said = []
callbacks = fmi2.fmi2CallbackFunctions()
callbacks.logger = fmi2.fmi2CallbackLoggerTYPE(lambda _e, _i, status, _c, text: said.append((status, text.decode())))
callbacks.allocateMemory = fmi2.fmi2CallbackAllocateMemoryTYPE(fmi2.calloc)
callbacks.freeMemory = fmi2.fmi2CallbackFreeMemoryTYPE(fmi2.free)
addLoggerProxy(ctypes.byref(callbacks))
description = fmpy.read_model_description(sys.argv[1])
slave = fmi2.FMU2Slave(
    guid=description.guid,
    unzipDirectory=fmpy.extract(sys.argv[1]),
    modelIdentifier=description.coSimulation.modelIdentifier,
    instanceName="unit",
)
try:
    slave.instantiate(callbacks=callbacks, loggingOn=sys.argv[3] == "on")
    print("instantiated")
except Exception:
    print(*(text for _, text in said))
"""


@pytest.fixture(scope="module")
def gain(tmp_path_factory):
    return build_python(Gain(), tmp_path_factory.mktemp("gain") / "Gain.fmu")


@pytest.mark.parametrize("logging", ["on", "off"])
@pytest.mark.parametrize(("package", "needed"), [("casadi", "'casadi>=3.7,<3.9'"), ("numpy", "'numpy>=1.26'")])
def test_what_is_missing_is_told(gain, package, needed, logging):
    """Where logging is off pythonfmu says nothing: it stands on standard error then, too."""
    forget = "sys.modules.pop('numpy')\n" * (package == "numpy")  # which fmpy has imported
    host = HOST.replace("try:\n    slave", f"{forget}try:\n    slave")
    done = subprocess.run([sys.executable, "-c", host, gain, package, logging], capture_output=True, text=True)
    sentence = (
        f"Gain: the package {package} is not installed for the Python that runs this FMU, {sys.version.split()[0]} in "
        f"{sys.prefix}. Install it there: python -m pip install {needed}."
    )
    assert done.returncode == 0, done.stderr
    assert done.stderr.splitlines()[0] == sentence
    assert (sentence in done.stdout) == (logging == "on")


def test_what_it_does_not_need(gain):
    done = subprocess.run([sys.executable, "-c", HOST, gain, "pandas", "on"], capture_output=True, text=True)
    assert done.stdout == "instantiated\n", done.stderr
