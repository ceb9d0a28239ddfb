"""Python FMUs leave the heap sound: a process that has flown them, in order or not, ends with status 0 and no word.

In processes of their own, whose allocators check what they are given back.
"""

import ctypes.util
import os
import subprocess
import sys
from pathlib import Path

import pytest

from fmus.export.python.python_fmu import build_python

from .parts import every
from .slaves import unpack

CHECKED = {"PYTHONMALLOC": "debug", "MALLOC_CHECK_": "3", "MALLOC_PERTURB_": "165", "PYTHONFAULTHANDLER": "1"}
PRELUDE = """
import contextlib, gc, sys
from fmpy import read_model_description
from fmpy.fmi2 import FMU2Slave, fmi2CallbackFunctions, fmi2CallbackLoggerTYPE
from fmpy.fmi2 import fmi2CallbackAllocateMemoryTYPE, fmi2CallbackFreeMemoryTYPE, calloc, free

folder = sys.argv[1]
said = read_model_description(folder)
callbacks = fmi2CallbackFunctions()
callbacks.logger = fmi2CallbackLoggerTYPE(lambda *arguments: None)
callbacks.allocateMemory = fmi2CallbackAllocateMemoryTYPE(calloc)
callbacks.freeMemory = fmi2CallbackFreeMemoryTYPE(free)


def new():
    slave = FMU2Slave(guid=said.guid, unzipDirectory=folder, modelIdentifier=said.modelName, instanceName="one")
    slave.instantiate(callbacks=callbacks, loggingOn=True)
    return slave


def started(slave=None):
    slave = slave or new()
    slave.setupExperiment(startTime=0.0)
    slave.enterInitializationMode()
    slave.exitInitializationMode()
    slave.doStep(0.0, 0.1)
    return slave


def wrong(slave, times=1):
    for call, arguments in (
        (slave.getReal, ([2**32 - 1],)),
        (slave.setReal, ([0], [float("nan")])),
        (slave.getInteger, ([0],)),
        (slave.setBoolean, ([0], [True])),
        (slave.getString, ([0],)),
        (slave.enterInitializationMode, ()),
        (slave.doStep, (7.0, 0.1)),
        (slave.deSerializeFMUstate, (b"damaged",)),
        (slave.deSerializeFMUstate, (bytes(100),)),
    ):
        for _ in range(times):
            with contextlib.suppress(Exception):
                call(*arguments)
                raise SystemExit(f"{call} was not refused")
            gc.collect()
"""
ENDS = {
    "freed": "slave = started(); slave.terminate(); slave.fmi2FreeInstance(slave.component)",
    "freed without fmi2Terminate": "slave = started(); slave.fmi2FreeInstance(slave.component)",
    "terminated only": "slave = started(); slave.terminate()",
    "left as it is": "slave = started()",
    "wrong calls, freed": "slave = started(); wrong(slave); slave.fmi2FreeInstance(slave.component)",
    "wrong calls again and again": "slave = started(); wrong(slave, 5); slave.doStep(0.1, 0.1)\n"
    "slave.terminate(); slave.fmi2FreeInstance(slave.component)",
    "wrong calls, left": "slave = started(); wrong(slave)",
    "wrong calls, reset": "slave = started(); wrong(slave); slave.reset(); wrong(started(slave))\n"
    "slave.fmi2FreeInstance(slave.component)",
    "many, with others alive": "others = [started() for _ in range(3)]\n"
    "for _ in range(10):\n    slave = started(); wrong(slave); slave.fmi2FreeInstance(slave.component)\n"
    "for other in others: other.doStep(0.1, 0.1); other.fmi2FreeInstance(other.component)",
    "nothing to reset to": "import os; slave = started()\n"
    "os.rename(f'{folder}/resources/component.json', folder + '/x')\n"
    "slave.reset(); wrong(slave, 2); slave.fmi2FreeInstance(slave.component)\n"
    "with contextlib.suppress(Exception): new()\n"
    "os.rename(folder + '/x', f'{folder}/resources/component.json')",
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    return unpack(build_python(every()["Sum"], tmp_path_factory.mktemp("exit") / "Sum.fmu"))


def checking_environment() -> dict[str, str]:
    """With glibc's checking allocator where there is one."""
    checker = "libc_malloc_debug.so.0"
    there = ctypes.util.find_library("c_malloc_debug") is not None or any(Path("/").glob(f"usr/lib*/**/{checker}"))
    return os.environ | CHECKED | ({"LD_PRELOAD": checker} if there else {})


@pytest.mark.parametrize("end", ENDS.values(), ids=ENDS)
def test_a_process_ends_well(folder, end):
    code = f"{PRELUDE}\n{end}\nprint('done', flush=True)"
    command = [sys.executable, "-c", code, str(folder)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, env=checking_environment())
    assert (done.returncode, done.stdout, done.stderr) == (0, "done\n", "")


def test_the_same_calls_end_a_process_where_pythonfmu_drops_what_it_does_not_own(folder):
    """What an exception costs without the references that an instance adds: the checks find it."""
    bare = "slave = started(); m = next(m for n, m in sys.modules.items() if n.startswith('adcs_slave'))\n"
    bare += "m._keep = lambda *instances: None; wrong(slave, 3); slave.fmi2FreeInstance(slave.component); gc.collect()"
    command = [sys.executable, "-c", f"{PRELUDE}\n{bare}", str(folder)]
    assert subprocess.run(command, capture_output=True, check=False, env=checking_environment()).returncode < 0
