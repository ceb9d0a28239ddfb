"""Many seeds of a fuzzer, from the command line: how many (the fuzzer's own number if not given), and from which on."""

import sys
import tempfile
from collections import Counter
from collections.abc import Callable
from pathlib import Path


def run(attempt: Callable[[int, Path], str], usual: int) -> None:
    """Try every seed and print how often each outcome came; what is no result and no error of ours ends with status 1.

    `attempt(seed, folder)` returns the outcome in a word.
    """
    count, first = (*map(int, sys.argv[1:3]), *(usual, 0)[len(sys.argv) - 1 :])
    outcomes: Counter[str] = Counter()
    with tempfile.TemporaryDirectory() as folder:
        for seed in range(first, first + count):
            try:
                outcomes[attempt(seed, Path(folder))] += 1
            except Exception as error:
                outcomes["BROKEN"] += 1
                print(f"seed {seed}: {type(error).__name__}: {str(error)[:200]}")
    print(dict(outcomes))
    sys.exit(outcomes["BROKEN"] > 0)
