"""What the runners share: a loop of FMUs as data, a clock of CPU time, and one line of figures."""

import json
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path

Port = tuple[str, str]


@dataclass(frozen=True)
class Loop:
    """Instances and FMUs, wires from outputs to inputs, steps of `step` s; `shown`: what is compared at the end."""

    name: str
    fmus: dict[str, str]
    wires: list[tuple[Port, Port]]
    shown: list[Port]
    step: float
    steps: int

    def write(self, path: Path) -> None:
        path.write_text(json.dumps(asdict(self)))

    @classmethod
    def told(cls) -> "tuple[Loop, bool]":
        """Return the loop of the command line, and whether rows are recorded."""
        told = json.loads(Path(sys.argv[1]).read_text())
        wires = [(tuple(source), tuple(target)) for source, target in told.pop("wires")]
        shown = [tuple(port) for port in told.pop("shown")]
        return cls(wires=wires, shown=shown, **told), sys.argv[2] == "1"

    @contextmanager
    def clock(self) -> Iterator[list[float]]:
        """Give a list that has the CPU seconds of the block, of all threads, when it ends."""
        taken: list[float] = []
        began = time.process_time()
        yield taken
        taken.append(time.process_time() - began)


def report(clock: list[float], loop: Loop, end: Sequence[float]) -> None:
    """Print microseconds a step and the values at the end, as the last line."""
    print(json.dumps({"us": clock[0] / loop.steps * 1e6, "end": list(map(float, end))}))
