"""What the runners share: a loop of FMUs as data, a clock of CPU time, and one line of figures.

A runner is told RUNNER.py LOOP.json record; record 1: every step is recorded, as the tool does it.
"""

import json
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path

Port = tuple[str, str]
PARTS = 4


@dataclass(frozen=True)
class Loop:
    """Instances and FMUs, wires from outputs to inputs, steps of `step` s.

    `shown`: what is compared, `samples` times at equal distances, last at the end; `samples` divides `steps`.
    """

    name: str
    fmus: dict[str, str]
    wires: list[tuple[Port, Port]]
    shown: list[Port]
    step: float
    steps: int
    samples: int = 1

    def write(self, path: Path) -> None:
        path.write_text(json.dumps(asdict(self)))

    @classmethod
    def told(cls) -> "tuple[Loop, bool]":
        """Return the loop of the command line, and whether rows are recorded."""
        told = json.loads(Path(sys.argv[1]).read_text())
        wires = [(tuple(source), tuple(target)) for source, target in told.pop("wires")]
        shown = [tuple(port) for port in told.pop("shown")]
        return cls(wires=wires, shown=shown, **told), sys.argv[2] == "1"

    @property
    def chunk(self) -> int:
        """The steps from one sample to the next."""
        return self.steps // self.samples

    @property
    def parts(self) -> tuple[int, ...]:
        """The same, in equal parts that are clocked one by one."""
        return (self.chunk // PARTS,) * PARTS if self.chunk % PARTS == 0 else (self.chunk,)


class Clock:
    """CPU seconds, of all threads, of blocks that are equal parts of a flight: as if each took what the least took."""

    def __init__(self) -> None:
        self.times: list[float] = []

    @contextmanager
    def running(self) -> Iterator[None]:
        began = time.process_time()
        yield
        self.times.append(time.process_time() - began)

    @property
    def seconds(self) -> float:
        return min(self.times) * len(self.times)


def report(loop: Loop, seconds: float, rows: Sequence[Sequence[float]]) -> None:
    """Print the CPU seconds of all steps and what was shown, a row a sample, as the last line."""
    print(
        json.dumps({"seconds": seconds, "us": seconds / loop.steps * 1e6, "rows": [list(map(float, r)) for r in rows]})
    )
