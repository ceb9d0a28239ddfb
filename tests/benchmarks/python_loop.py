"""The loop in Python against fmpy's functions by ctypes with preallocated arrays, on the same FMU files.

    python tests/benchmarks/python_loop.py [--rounds 9] [--loops 2 zhang2018-ppatc ...]

Loops and runners are those of peers.py: delayed exchange, each contestant in a process of its own, in turn, with and
without recording each step; figures are CPU time a communication step. The same jobs: what fmpy's loop leaves out is
that outputs are finite, looks for Ctrl-C, and outputs that are read again after a step (they are what makes
zhang2018-ppatc's controller answer in the same step; see `adcs show`). Budget: twice fmpy's. For information: the
kernel.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import bench
import peers

CONTESTANTS = {
    "fmpy, ctypes": ("fmpy_loop.py",),
    "ours, Python": ("ours_loop.py", "python"),
    "ours, kernel": ("ours_loop.py", "kernel"),
}


def contestant(described: Path, record: bool, runner: str, *told: str) -> Callable[[], float]:
    """Return what flies a loop in a process and returns the CPU seconds of a step."""
    command = [sys.executable, str(peers.FOLDER / runner), str(described), str(int(record)), *told]
    paths = os.pathsep.join([str(peers.FOLDER), str(peers.FOLDER.parents[2])])

    def fly() -> float:
        environment = os.environ | {"PYTHONPATH": paths}
        done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
        if done.returncode:
            raise RuntimeError(done.stderr)
        return json.loads(done.stdout.splitlines()[-1])["us"] * 1e-6

    return fly


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=9)
    parser.add_argument("--steps", type=int, default=20_000)
    parser.add_argument("--loops", nargs="*", default=["2", "40", "zhang2018-ppatc"])
    told = parser.parse_args()
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        for name in told.loops:
            whole = peers.pairs(folder, int(name)) if name.isdigit() else peers.paper(folder, name)
            loop, described = replace(whole, steps=told.steps // max(1, len(whole.fmus) // 4)), folder / "loop.json"
            loop.write(described)
            for record in (False, True):
                flights = {what: contestant(described, record, *how) for what, how in CONTESTANTS.items()}
                title = f"{name}, {'every step recorded' if record else 'nothing recorded'}"
                times = bench.rounds(flights, told.rounds)
                bench.compare(title, times, "fmpy, ctypes", {"ours, Python": 2.0})


if __name__ == "__main__":
    main()
