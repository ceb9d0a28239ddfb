"""CPU time of what a user waits for before anything flies, each command a process of its own.

Budgets on a machine where `import numpy` takes 0.1 s: `import cosim` 0.2 s, `adcs --help` and `adcs list` 0.4 s,
`adcs run zhang2018-ppatc --stop 1` of built FMUs 1.2 s..
"""

import os
import subprocess
import sys
import tempfile
from statistics import median

import bench

ROUNDS = 7
COMMANDS = {
    "import numpy": ["-c", "import numpy"],
    "import cosim": ["-c", "import cosim"],
    "adcs --help": ["-m", "cosim", "--help"],
    "adcs list": ["-m", "cosim", "list"],
    "adcs run zhang2018-ppatc --stop 1": ["-m", "cosim", "run", "zhang2018-ppatc", "--stop", "1", "--force"],
}
BUDGETS = {"import cosim": 0.2, "adcs --help": 0.4, "adcs list": 0.4, "adcs run zhang2018-ppatc --stop 1": 1.2}


def cpu(arguments: list[str], folder: str) -> float:
    """Run Python in a process of its own; return its CPU seconds."""
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(p for p in sys.path if p)}
    before = os.times()
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    subprocess.run([sys.executable, *arguments], cwd=folder, env=environment, check=True, **quiet)
    after = os.times()
    return after.children_user + after.children_system - before.children_user - before.children_system


def main() -> None:
    with tempfile.TemporaryDirectory() as folder:
        times = bench.rounds({name: (lambda a=a: cpu(a, folder)) for name, a in COMMANDS.items()}, ROUNDS)
    rows = [(f"{name}, least of {ROUNDS}", min(own), "s", BUDGETS.get(name)) for name, own in times.items()]
    rows += [(f"{name}, median", median(own), "s", None) for name, own in times.items()]
    bench.limits("CPU before anything flies", rows)


if __name__ == "__main__":
    main()
