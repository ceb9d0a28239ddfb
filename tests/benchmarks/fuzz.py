"""Many seeds of a fuzzer, from the command line: how many (the fuzzer's own number if not given), and from which on."""

import resource
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path

LONGEST, LARGEST = 5.0, 500.0  # s of one seed, MB of the process


def run(attempt: Callable[[int, Path], str], usual: int) -> None:
    """Try every seed; print how often each outcome came, the slowest seed, and the memory that was needed.

    `attempt(seed, folder)` returns the outcome in a word. Status 1 for what is no result and no error of ours, or above
    its limit.
    """
    count, first = (*map(int, sys.argv[1:3]), *(usual, 0)[len(sys.argv) - 1 :])
    outcomes: Counter[str] = Counter()
    slowest = (0.0, first)
    with tempfile.TemporaryDirectory() as folder:
        for seed in range(first, first + count):
            began = time.perf_counter()
            try:
                outcomes[attempt(seed, Path(folder))] += 1
            except Exception as error:
                outcomes["BROKEN"] += 1
                print(f"seed {seed}: {type(error).__name__}: {str(error)[:200]}")
            slowest = max(slowest, (time.perf_counter() - began, seed))
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024  # kB on Linux
    print(dict(outcomes))
    print(f"slowest: seed {slowest[1]}, {slowest[0]:.2f} s; memory at most {memory:.0f} MB")
    sys.exit(outcomes["BROKEN"] > 0 or slowest[0] > LONGEST or memory > LARGEST)
