"""`adcs build` of everything for this machine: into an empty folder, and again when nothing has changed.

Each in a process of its own, as a user runs it. Budgets: cold under 2 minutes (both back ends), a rebuild of nothing
under 1 s. Inside: what the rebuild takes once the imports are done, and how many CasADi functions it builds (none).
"""

import ast
import os
import subprocess
import sys
import tempfile
import time
from statistics import median

import bench

ROUNDS = 7
COUNTED = """
import time
import casadi
built, original = [], casadi.Function.__init__
def counted(self, *arguments):
    built.append(arguments[:1])
    original(self, *arguments)
casadi.Function.__init__ = counted
from fmus.export.build import BACKENDS, build_all
began = time.perf_counter()
paths = build_all(BACKENDS)
print(repr((time.perf_counter() - began, len(built), len(paths))))
"""


def process(folder: str, *arguments: str) -> tuple[float, str]:
    """Run Python on the project with FMUs kept in a folder; return seconds and what it prints."""
    environment = os.environ | {"ADCS_BUILD": folder, "PYTHONPATH": os.pathsep.join(sys.path)}
    began = time.perf_counter()
    done = subprocess.run([sys.executable, *arguments], env=environment, capture_output=True, text=True, check=False)
    if done.returncode:
        raise RuntimeError(done.stderr)
    return time.perf_counter() - began, done.stdout


def main() -> None:
    adcs = ("-m", "cosim", "build")
    with tempfile.TemporaryDirectory() as native, tempfile.TemporaryDirectory() as both:
        cold = process(native, *adcs)[0]
        counted = ast.literal_eval(process(both, "-c", COUNTED)[1])
        again, bare, empty, inside = [], [], [], []
        for _ in range(ROUNDS):
            again.append(process(native, *adcs)[0])
            inside.append(ast.literal_eval(process(both, "-c", COUNTED)[1]))
            bare.append(process(native, "-c", "import casadi, typer")[0])
            empty.append(process(native, "-c", "pass")[0])
    bench.limits(
        f"adcs build of everything, host platform; rebuilds are medians of {ROUNDS}",
        [
            ("cold, native, whole process", cold, "s", 120),
            (f"cold, both back ends ({counted[2]} FMUs), inside", counted[0], "s", 120),
            ("CasADi functions built by it", counted[1], "", None),
            ("nothing to build, native, whole process", median(again), "s", 1),
            ("  least", min(again), "s", 1),
            ("nothing to build, both back ends, inside", median(i[0] for i in inside), "s", 1),
            ("CasADi functions built by it", max(i[1] for i in inside), "", 0),
            ("a process that imports casadi and typer", median(bare), "s", None),
            ("a process that does nothing", median(empty), "s", None),
        ],
    )


if __name__ == "__main__":
    main()
